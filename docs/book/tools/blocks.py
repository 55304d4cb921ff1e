"""Runs the commands of the book.

Every block of ``sh`` is preceded by a comment that says what is to become of it:

    <!-- run -->                                     it must end with exit code 0
    <!-- run: exit 1 -->                             it must end with that code
    <!-- run: exit 1, clock-step in result.json -->  and this code must be among the reasons or warnings of that result
    <!-- not run: needs a robot -->                  it is not run, and why

A block of ``text`` after ``<!-- output -->`` is what the block before it prints (stdout and stderr); a line ``…`` stands
for any lines. The blocks of a page run in their order in one empty folder. Blocks of ``python`` may be marked in the same way; they run
where the environment names an interpreter with the module trueline (``TRUELINE_PYTHON``), and are passed over elsewhere.
"""

import json
import re
import subprocess
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

FENCE = re.compile(r"^```\s*([\w-]*)\s*$")
COMMENT = re.compile(r"^<!-- (run|not run|output)(?:: (.*))? -->$")
EXIT = re.compile(r"^exit (\d+)$")
CODE_IN = re.compile(r"^([a-z-]+) in (\S+)$")
LONGEST_S = 180
PYTHON = "TRUELINE_PYTHON"


@dataclass
class Block:
    """One fenced block: its place, the comment before it, and its lines."""

    line: int
    language: str
    mark: str | None
    detail: str
    lines: list[str]


@dataclass
class Expected:
    """The requirements of a block."""

    exit_code: int = 0
    codes: list[tuple[str, str]] = field(default_factory=list)


def blocks_of(text: str) -> list[Block]:
    """All fenced blocks of a page."""
    found, inside, before = [], None, ""
    for number, line in enumerate(text.splitlines(), 1):
        fence = FENCE.match(line)
        if inside is not None:
            if line.rstrip() == "```":
                found.append(inside)
                inside = None
            else:
                inside.lines.append(line)
        elif fence:
            comment = COMMENT.match(before)
            mark, detail = (comment[1], comment[2] or "") if comment else (None, "")
            inside = Block(number, fence[1], mark, detail, [])
        if line.strip():
            before = line.strip()
    return found


def expected_of(detail: str) -> Expected:
    """The conditions in the comment of a block that is run."""
    expected = Expected()
    for condition in filter(None, (part.strip() for part in detail.split(","))):
        if match := EXIT.match(condition):
            expected.exit_code = int(match[1])
        elif match := CODE_IN.match(condition):
            expected.codes.append((match[1], match[2]))
        else:
            raise ValueError(f"`{condition}` is no condition")
    return expected


def codes_in(result: Path) -> set[str]:
    """Codes of all reasons and warnings of a result."""
    content = json.loads(result.read_text())
    return {fact["code"] for fact in content["reasons"] + content["warnings"]}


def run(block: Block, folder: Path, environment: dict[str, str]) -> tuple[str, list[str]]:
    """Output of the block, and its faults."""
    try:
        expected = expected_of(block.detail)
    except ValueError as error:
        return "", [str(error)]
    script = "\n".join(block.lines)
    command = ["bash", "-e", "-o", "pipefail", "-c"] if block.language == "sh" else [environment[PYTHON], "-c"]
    try:
        done = subprocess.run(
            [*command, script], cwd=folder, env=environment, text=True, timeout=LONGEST_S,
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False,
        )
    except subprocess.TimeoutExpired:
        return "", [f"did not end within {LONGEST_S} s"]
    faults = []
    if done.returncode != expected.exit_code:
        faults.append(f"exit code {done.returncode} instead of {expected.exit_code}:\n{done.stdout}")
    for code, name in expected.codes:
        result = folder / name
        found = codes_in(result) if result.is_file() else set()
        if code not in found:
            faults.append(f"`{code}` is not in {name}, which has {sorted(found)}")
    return done.stdout, faults


def same(wanted: list[str], printed: list[str]) -> bool:
    """Whether the printed lines are the wanted ones; a wanted ``…`` stands for any number of lines."""
    if not wanted:
        return not printed
    if wanted[0].strip() == "…":
        return any(same(wanted[1:], printed[skip:]) for skip in range(len(printed) + 1))
    return bool(printed) and wanted[0].rstrip() == printed[0].rstrip() and same(wanted[1:], printed[1:])


def replaced(text: str, block: Block, printed: list[str]) -> str:
    """The page with other lines in one block; the line numbers of the blocks before it stay."""
    lines = text.splitlines()
    lines[block.line : block.line + len(block.lines)] = [line.rstrip() for line in printed]
    return "\n".join(lines) + "\n"


def check_page(page: Path, folder: Path, environment: dict[str, str], update: bool) -> list[str]:
    """Runs the blocks of one page; returns what is wrong."""
    folder.mkdir(parents=True)
    faults, outputs, printed, wrong = [], [], "", []
    for block in blocks_of(page.read_text()):
        where = f"{page.name}:{block.line}"
        if block.language == "python" and PYTHON not in environment:
            continue
        if block.language in ("sh", "python") and block.mark == "run":
            printed, wrong = run(block, folder, environment)
            faults += [f"{where}: {fault}" for fault in wrong]
        elif block.language == "sh" and not (block.mark == "not run" and block.detail):
            faults.append(f"{where}: say `<!-- run -->` or `<!-- not run: why -->` before it")
        elif block.mark == "output" and not wrong and not same(block.lines, printed.splitlines()):
            if update and "…" not in (line.strip() for line in block.lines):
                outputs.append((block, printed.splitlines()))
            else:
                faults.append(f"{where}: the output is another one:\n{printed}")
    for block, lines in reversed(outputs):
        page.write_text(replaced(page.read_text(), block, lines))
    return faults


def check(pages: list[Path], scratch: Path, environment: dict[str, str], update: bool) -> list[str]:
    """Runs the blocks of all pages, two pages at a time; returns what is wrong."""
    folders = [scratch / f"page-{number}" for number in range(len(pages))]
    with ThreadPoolExecutor(2) as pool:
        faults = pool.map(lambda job: check_page(*job, environment, update), zip(pages, folders))
    return [fault for page in faults for fault in page]


def counted(pages: list[Path]) -> str:
    """Number of commands that are run, and number of the others."""
    marks = [block.mark for page in pages for block in blocks_of(page.read_text()) if block.language in ("sh", "python")]
    return f"{marks.count('run')} blocks of commands are run, {marks.count('not run')} are not, each with its reason"
