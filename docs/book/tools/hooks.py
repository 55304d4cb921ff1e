"""Additions to MkDocs: formulas as MathML, links to the source, and reports made at the time of
building."""

import os
import posixpath
import re
from pathlib import Path

from latex2mathml.converter import convert
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File

LINK = re.compile(r"\]\(((?:\.\./)+[^)#\s]+)(#[^)\s]*)?\)")
FORMULA = re.compile(r'<(span|div) class="arithmatex">(?:\\\((.*?)\\\)|\\\[(.*?)\\\])</\1>', re.DOTALL)
ENTITIES = {"&lt;": "<", "&gt;": ">", "&amp;": "&"}
ROOT = Path(__file__).resolve().parents[3]
PAGES = "docs/book/src"


def source_of(page: str, target: str) -> str | None:
    """The file of the repository that a link of a page names, if it is none of the book's own."""
    path = posixpath.normpath(posixpath.join(PAGES, posixpath.dirname(page), target))
    return None if path.startswith(PAGES) else path


def name_in_site(path: str) -> str:
    """Place of a repository file in the site; source as text, so that a browser shows it."""
    return f"source/{path}" if path.endswith(".png") else f"source/{path}.txt"


def on_files(files, config):
    """Adds the source files that pages link to, and the reports."""
    linked = set()
    for page in files.documentation_pages():
        for match in LINK.finditer(Path(page.abs_src_path).read_text()):
            if path := source_of(page.src_uri, match[1]):
                linked.add((page.src_uri, path))
    for path in sorted({path for _, path in linked}):
        if not (ROOT / path).is_file():
            pages = ", ".join(page for page, other in linked if other == path)
            raise PluginError(f"{pages}: there is no file {path} in the repository")
        files.append(File.generated(config, name_in_site(path), abs_src_path=str(ROOT / path)))
    extra = os.environ.get("TRUELINE_BOOK_EXTRA")
    for file in sorted(path for path in Path(extra).rglob("*.*") if path.is_file()) if extra else []:
        files.append(File.generated(config, file.relative_to(extra).as_posix(), abs_src_path=str(file)))
    return files


def on_page_markdown(markdown, page, config, files):
    """Turns links to the repository's files into links inside the site."""
    def moved(match):
        path = source_of(page.file.src_uri, match[1])
        if path is None:
            return match[0]
        here = posixpath.dirname(page.file.src_uri)
        return f"]({posixpath.relpath(name_in_site(path), here or '.')})"

    return LINK.sub(moved, markdown)


def on_page_content(html, page, config, files):
    """Turns formulas into MathML, which browsers show without a script."""
    def formula(match):
        text = match[2] if match[2] is not None else match[3]
        for entity, character in ENTITIES.items():
            text = text.replace(entity, character)
        return convert(text, display="inline" if match[1] == "span" else "block")

    return FORMULA.sub(formula, html)
