"""Every code of a reason or a warning has its place in the book."""

import re
from pathlib import Path

VERDICT = Path("crates/trueline-method/src/verdict")
# A warning that names a cause has the cause's code.
CAUSES = VERDICT.parent / "assess/cause_kind.rs"
CODE = re.compile(r'=> "([a-z][a-z0-9-]*)"')


def codes_of(source: Path) -> list[str]:
    """The codes that a file gives, in their order."""
    body = re.split(r"fn code\(&?self\)", source.read_text(), maxsplit=1)[1].split("\n    }\n", 1)[0]
    return CODE.findall(body)


def check(root: Path, pages: Path) -> list[str]:
    """Checks for a page for each reason, a section for each warning, and none for codes that do not
    exist; returns the faults."""
    reasons, warnings = (codes_of(root / VERDICT / name) for name in ("reason.rs", "warning.rs"))
    warnings += codes_of(root / CAUSES)
    faults = [] if reasons and warnings else [f"no codes were found in {VERDICT}"]
    folder = pages / "how-to/not-accepted"
    written = {page.stem for page in folder.glob("*.md")} - {"index", "warnings"}
    faults += [f"reason `{code}` has no page {folder.name}/{code}.md" for code in reasons if code not in written]
    faults += [f"{folder.name}/{page}.md is of no reason" for page in sorted(written - set(reasons))]
    sections = re.findall(r"^## .*\{#([a-z-]+)\}$", (folder / "warnings.md").read_text(), re.MULTILINE)
    faults += [f"warning `{code}` has no section in warnings.md" for code in warnings if code not in sections]
    faults += [f"section `{code}` of warnings.md is of no warning" for code in sections if code not in warnings]
    for code in reasons:
        page = folder / f"{code}.md"
        if page.is_file() and f"`{code}`" not in page.read_text():
            faults.append(f"{page.name} does not name its code")
    return faults
