"""Runs the notebooks from top to bottom: ``python notebooks/run.py OUT``; writes them with what they print and draw.

The notebooks are Python files in the percent format, which Jupyter opens with jupytext.
"""

import sys
from pathlib import Path

import jupytext
import nbformat
from nbclient import NotebookClient

LIMIT_S = 300


def main() -> None:
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    for source in sorted(Path(__file__).parent.glob("[0-9]*.py")):
        notebook = jupytext.read(source)
        NotebookClient(notebook, timeout=LIMIT_S, kernel_name="python3").execute(cwd=str(out))
        nbformat.write(notebook, out / f"{source.stem}.ipynb")
        print(f"{source.stem}: {len(notebook.cells)} cells")


if __name__ == "__main__":
    main()
