"""Writes the notebooks as .ipynb, without what they print: ``python notebooks/to_ipynb.py``.

The Python files are the source. ``tests/test_notebooks.py`` fails if a notebook is not what this writes.
"""

from pathlib import Path

import jupytext
import nbformat

FOLDER = Path(__file__).parent


def sources() -> list[Path]:
    """The notebooks as Python files."""
    return sorted(FOLDER.glob("[0-9]*.py"))


def as_ipynb(source: Path) -> str:
    """The text of the notebook; its cells are numbered, so that the same source gives the same text."""
    notebook = jupytext.read(source)
    notebook.metadata = {"kernelspec": notebook.metadata["kernelspec"], "language_info": {"name": "python"}}
    for number, cell in enumerate(notebook.cells):
        cell.id = f"cell-{number}"
        cell.metadata = {}
    notebook.nbformat, notebook.nbformat_minor = 4, 5
    nbformat.validate(notebook)
    return nbformat.writes(notebook).rstrip() + "\n"


if __name__ == "__main__":
    for source in sources():
        source.with_suffix(".ipynb").write_text(as_ipynb(source))
