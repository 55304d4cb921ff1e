"""Tables in README.md and in the book are those of the runs, as the files that they name hold them."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
BLOCK = re.compile(r"<!-- table: (\S+) -->\n(.*?)<!-- end -->", re.DOTALL)
PAGES = [ROOT / "profilebench/README.md", *sorted((ROOT / "docs/book/src/comparison").glob("*.md"))]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_tables_are_those_of_the_runs(page: Path) -> None:
    for name, text in BLOCK.findall(page.read_text()):
        assert text.strip() == (ROOT / name).read_text().strip(), f"{page.name}: {name} differs: python tests/test_tables.py writes it"


def write() -> None:
    """Put the tables into the pages."""
    for page in PAGES:
        text = page.read_text()
        page.write_text(
            BLOCK.sub(lambda m: f"<!-- table: {m[1]} -->\n\n{(ROOT / m[1]).read_text()}\n<!-- end -->", text)
        )


if __name__ == "__main__":
    write()
