"""Every reference that the book cites is in the list of references."""

import re
from pathlib import Path

KEY = re.compile(r"\b([A-Z][A-Za-z]+(?:19|20)\d\d)\b")


def check(references: Path, pages: list[Path]) -> list[str]:
    """Returns what is cited and not listed."""
    listed = set(re.findall(r"\*\*\[(\w+)\]\*\*", references.read_text()))
    cited = {(page.name, key) for page in pages for key in KEY.findall(page.read_text())}
    return [f"{page} cites {key}, which {references.name} does not list" for page, key in sorted(cited) if key not in listed]
