#!/usr/bin/env python3
"""Checks the book against the program, and builds it.

    python check.py --program ../../target/release/trueline [--python INTERPRETER] [--site DIR] [--update]

It checks: a page or a section for every code of a reason or a warning; the generated parts of
pages, which stand between two comments; the figures; every command of every page with its exit code
and output; citations; the links, also those to the source. Needs Python 3.11 and the packages of
requirements.txt. --python names an interpreter with the module trueline, for the blocks of Python;
without it they are not run, and a message says so. --update writes the differences into the book
instead of failing.
"""

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

BOOK = Path(__file__).resolve().parent
ROOT = BOOK.parents[1]
PAGES = BOOK / "src"
sys.path.insert(0, str(BOOK / "tools"))

import blocks  # noqa: E402
import citations  # noqa: E402
import codes  # noqa: E402
import figures  # noqa: E402
import gallery  # noqa: E402
import reference  # noqa: E402

INCLUDE = re.compile(r"^\s*(--8<--|\{\{#include)", re.MULTILINE)
NUMBER = re.compile(r"-?\d+(?:\.\d+)?")
SAME_PX = 1.5
# Generated text stands in the pages themselves, so that they can be read in a checkout.
PART = re.compile(r"<!-- made by check.py: (\S+) -->(.*?)<!-- end of \1 -->", re.DOTALL)


def same_drawing(first: str, second: str) -> bool:
    """Whether two drawings have the same words, and numbers that differ by less than a reader can
    see."""
    if NUMBER.sub("#", first) != NUMBER.sub("#", second):
        return False
    pairs = zip(NUMBER.findall(first), NUMBER.findall(second))
    return all(abs(float(a) - float(b)) <= SAME_PX for a, b in pairs)


def compare_parts(generated: dict[str, str], pages: list[Path], update: bool) -> list[str]:
    """Compares the generated parts of pages, between two comments, with the program's present
    output, or writes them; returns the differences."""
    faults, found = [], set()
    for page in pages:
        text = page.read_text()
        if INCLUDE.search(text):
            faults.append(f"{page.relative_to(ROOT)} shows a raw include in a checkout")
        for part in PART.finditer(text):
            name = part[1]
            found.add(name)
            now = generated.get(name)
            if now is None:
                faults.append(f"{page.relative_to(ROOT)}: nothing makes the part {name}")
            elif part[2].strip() == now.strip():
                continue
            elif update:
                text = text.replace(part[2], f"\n\n{now.strip()}\n\n", 1)
                page.write_text(text)
            else:
                faults.append(f"{page.relative_to(ROOT)}: the part {name} is not what the program gives: run check.py --update")
    return faults + [f"no page has the part {name}" for name in sorted(set(generated) - found)]


def compare(generated: dict[str, str], folder: Path, same, update: bool) -> list[str]:
    """Compares files with what the program gives now, or writes them; returns what differs."""
    faults = []
    for name, text in generated.items():
        file = folder / name
        if file.is_file() and same(file.read_text(), text):
            continue
        if update:
            file.write_text(text)
        else:
            faults.append(f"{file.relative_to(ROOT)} is not what the program gives: run check.py --update")
    known = {path.name for path in folder.iterdir()}
    faults += [f"{folder.relative_to(ROOT)}/{name} is made by nothing" for name in sorted(known - set(generated))]
    return faults


def build(site: Path, environment: dict[str, str], extra: Path) -> list[str]:
    """Builds the site; every warning is a fault."""
    environment = {**environment, "TRUELINE_BOOK_EXTRA": str(extra), "NO_MKDOCS_2_WARNING": "1"}
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "-f", BOOK / "mkdocs.yml", "-d", site]
    done = subprocess.run(command, env=environment, text=True, capture_output=True, check=False)
    return [] if done.returncode == 0 else [f"mkdocs:\n{done.stdout}{done.stderr}"]


def arguments() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", type=Path, required=True, help="the program trueline, of any profile")
    parser.add_argument("--python", type=Path, help="an interpreter that has the module trueline")
    parser.add_argument("--site", type=Path, help="where to leave the pages")
    parser.add_argument("--update", action="store_true", help="write what differs")
    return parser.parse_args()


def check(options: argparse.Namespace, scratch: Path) -> list[str]:
    """Every check in turn; returns what is wrong."""
    program = scratch / "bin/trueline"
    program.parent.mkdir()
    shutil.copy(options.program, program)
    environment = {**os.environ, "PATH": f"{program.parent}:{os.environ['PATH']}"}
    if options.python:
        environment[blocks.PYTHON] = str(options.python.absolute())
    else:
        print("the blocks of Python are not run: no --python", file=sys.stderr)
    pages, extra = sorted(PAGES.rglob("*.md")), scratch / "extra"
    print(blocks.counted(pages), file=sys.stderr)
    with ThreadPoolExecutor(2) as pool:
        drawings = pool.submit(figures.generate, program, scratch)
        generated = reference.generate(program, ROOT, PAGES, scratch)
        gallery.generate(program, extra, scratch)
    faults = codes.check(ROOT, PAGES) + citations.check(ROOT / "docs/references.md", pages)
    faults += compare_parts(generated, pages, options.update)
    faults += compare(drawings.result(), PAGES / "figures", same_drawing, options.update)
    faults += blocks.check(pages, scratch / "blocks", environment, options.update)
    return faults + build((options.site or scratch / "site").resolve(), environment, extra)


def main() -> int:
    """Checks, and says what is wrong."""
    options = arguments()
    with tempfile.TemporaryDirectory() as folder:
        faults = check(options, Path(folder))
    for fault in faults:
        print(fault, file=sys.stderr)
    print(f"{len(faults)} faults" if faults else "the book is right", file=sys.stderr)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
