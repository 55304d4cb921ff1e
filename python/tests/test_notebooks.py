"""The notebooks as .ipynb are those of the Python files beside them."""

import runpy
from pathlib import Path

import pytest

NOTEBOOKS = Path(__file__).parents[1] / "notebooks"
WRITER = runpy.run_path(str(NOTEBOOKS / "to_ipynb.py"))
SOURCES: list[Path] = WRITER["sources"]()


@pytest.mark.parametrize("source", SOURCES, ids=lambda source: source.stem)
def test_notebooks_are_in_step(source: Path) -> None:
    written = source.with_suffix(".ipynb")
    assert written.read_text() == WRITER["as_ipynb"](source), f"{written.name}: python notebooks/to_ipynb.py writes it"


def test_no_notebook_is_without_its_source() -> None:
    assert SOURCES
    assert [path.stem for path in sorted(NOTEBOOKS.glob("*.ipynb"))] == [path.stem for path in SOURCES]
