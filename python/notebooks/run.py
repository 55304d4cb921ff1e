"""Runs the notebooks from top to bottom: ``python notebooks/run.py OUT``; writes them with their
output and drawings.

The notebooks are Python files in the percent format, which Jupyter opens with jupytext.
"""

import sys
from pathlib import Path

import jupytext
import nbformat
from nbclient import NotebookClient

LIMIT_S = 300
MOST_KB = 300


def main() -> None:
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    for source in sorted(Path(__file__).parent.glob("[0-9]*.py")):
        notebook = jupytext.read(source)
        NotebookClient(notebook, timeout=LIMIT_S, kernel_name="python3").execute(cwd=str(out))
        written = out / f"{source.stem}.ipynb"
        nbformat.write(notebook, written)
        kilobytes = written.stat().st_size // 1000
        if kilobytes > MOST_KB:
            raise SystemExit(f"{source.stem}: {kilobytes} kB; show less")
        print(f"{source.stem}: {len(notebook.cells)} cells, {kilobytes} kB")


if __name__ == "__main__":
    main()
