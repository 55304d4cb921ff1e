"""Pages of HTML, which notebooks show."""

from __future__ import annotations

import html


class Page(str):
    """A page of HTML as text: write it to a file, or let a notebook show it by naming it on the last line of a cell."""

    __slots__ = ()

    def __repr__(self) -> str:
        return f"<trueline page: {len(self)} characters of HTML>"

    def _repr_html_(self) -> str:
        return framed(self, "800px")


def framed(page: str, height: str) -> str:
    """A page inside another one: its style and its scripts stay its own."""
    return (
        f'<iframe srcdoc="{html.escape(page, quote=True)}" sandbox="allow-scripts" title="Report"'
        f' style="width:100%;height:{height};border:0"></iframe>'
    )
