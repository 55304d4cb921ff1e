"""The parts of the reference that come from the program itself: its help, its presets, the schema of its result."""

import json
import re
import subprocess
from pathlib import Path

DEVICES = ("robot-sim", "stream-sim", "camera-sim")
COMMAND = re.compile(r"^  ([a-z][a-z0-9-]*) +(\S.*)$")
EXIT_CODES = re.compile(r"Exit code: (.*?)(?:\n\n|\Z)", re.DOTALL)


def help_of(program: Path, words: list[str]) -> str:
    """The help of a command, as it prints it."""
    done = subprocess.run([program, *words, "--help"], text=True, capture_output=True, check=True)
    return "\n".join(line.rstrip() for line in done.stdout.splitlines())


def commands_in(text: str) -> list[tuple[str, str]]:
    """Names and first sentences of the commands that a help lists, without `help`."""
    listed, inside = [], False
    for line in text.splitlines():
        if line and not line.startswith(" "):
            inside = line == "Commands:"
        elif inside and (match := COMMAND.match(line)):
            listed.append((match[1], match[2]))
        elif inside and listed and line.strip():
            listed[-1] = (listed[-1][0], f"{listed[-1][1]} {line.strip()}")
    return [(name, words) for name, words in listed if name != "help"]


def all_commands(program: Path) -> list[tuple[str, str, str]]:
    """Name, first sentence and help of every command and of every command of a command."""
    found = []
    for name, words in commands_in(help_of(program, [])):
        text = help_of(program, [name])
        found.append((f"trueline {name}", words, text))
        for inner, inner_words in commands_in(text):
            found.append((f"trueline {name} {inner}", inner_words, help_of(program, [name, inner])))
    for name in DEVICES:  # `trueline robot-sim` is `trueline-testbench robot-sim`
        text = help_of(program, [name])
        found.append((f"trueline-testbench {name}", text.split("\n\n", 1)[0], text))
    return found


def anchor(name: str) -> str:
    """Anchor of a command in the page of all commands."""
    return name.replace(" ", "-")


def commands(program: Path) -> str:
    """A table of all commands, then the help of each."""
    listed = all_commands(program)
    rows = [f"| [`{name}`](#{anchor(name)}) | {words} |" for name, words, _ in listed]
    sections = [f"## `{name}` {{#{anchor(name)}}}\n\n```text\n{text}\n```" for name, _, text in listed]
    return "\n".join(["| Command | What it does |", "|---|---|", *rows]) + "\n\n" + "\n\n".join(sections) + "\n"


def exit_codes(program: Path) -> str:
    """Exit codes of each command."""
    rows = []
    for name, _, text in all_commands(program):
        if match := EXIT_CODES.search(text):
            rows.append(f"| `{name}` | {' '.join(match[1].split())} |")
    return "\n".join(["| Command | Exit codes |", "|---|---|", *rows]) + "\n"


def preset_names(program: Path) -> list[tuple[str, str]]:
    """Presets of `simulate` with their sentences."""
    text = help_of(program, ["simulate"]).split("--preset", 1)[1].split("[default", 1)[0]
    return re.findall(r"- ([a-z-]+): +(.*)", text)


def significant(value: float) -> str:
    """Two significant digits."""
    return f"{value:.2g}"


def preset_row(program: Path, name: str, words: str, scratch: Path) -> str:
    """Result of calibrating one simulated scan of a preset."""
    scan, result = scratch / f"preset-{name}", scratch / f"preset-{name}.json"
    subprocess.run([program, "simulate", "--quiet", "--preset", name, "--out", scan], check=True)
    calibrate = [program, "calibrate", scan, "--quiet", "--json", result]
    subprocess.run(calibrate, stderr=subprocess.DEVNULL, check=False)
    found = json.loads(result.read_text())
    sigma = found["sigma_noise"] or {}
    parts = (("time_offset_s", 1e3), ("rotation_rad", 57.29577951), ("translation_mm", 1.0))
    cells = []
    for key, factor in parts:
        values = sigma.get(key)
        values = values if isinstance(values, list) else [values]
        cells.append("undetermined" if None in values else significant(factor * max(values)))
    codes = ", ".join(dict.fromkeys(fact["code"] for fact in found["reasons"])) or "accepted"
    return f"| `{name}` | {words} | {found['residuals']['used']} | {codes} | {' | '.join(cells)} |"


def presets(program: Path, scratch: Path) -> str:
    """A table of the presets, each simulated and calibrated."""
    head = "| Preset | Scan | Features used | Result | ± time offset, ms | ± rotation, ° | ± translation, mm |"
    rows = [preset_row(program, name, words, scratch) for name, words in preset_names(program)]
    return "\n".join([head, "|---|---|---|---|---|---|---|", *rows]) + "\n"


def type_of(schema: dict) -> str:
    """The type of a key in words."""
    if "$ref" in schema:
        return f"[{(name := schema['$ref'].rsplit('/', 1)[1])}](#{name.lower()})"
    if "anyOf" in schema:
        return " or ".join(type_of(part) for part in schema["anyOf"])
    kind = schema.get("type", "any")
    if kind == "array" and isinstance(schema.get("items"), dict):
        size = f" of {schema['minItems']}" if schema.get("minItems") == schema.get("maxItems", -1) else ""
        return f"list{size}: {type_of(schema['items'])}"
    return " or ".join(kind) if isinstance(kind, list) else kind


def keys_of(schema: dict) -> str:
    """A table of the keys of an object."""
    rows = []
    for key, value in schema.get("properties", {}).items():
        words = " ".join(value.get("description", "").split())
        rows.append(f"| `{key}` | {type_of(value)} | {words} |")
    return "\n".join(["| Key | Type | Meaning |", "|---|---|---|", *rows])


def result(schema_file: Path) -> str:
    """All keys of a result, from its JSON Schema."""
    schema = json.loads(schema_file.read_text())
    parts = ["## The result {#result}", keys_of(schema)]
    for name, part in schema["$defs"].items():
        words = " ".join(part.get("description", "").split())
        parts.append(f"## {name} {{#{name.lower()}}}\n\n{words}")
        if "properties" in part:
            parts.append(keys_of(part))
        elif values := part.get("enum") or [one["const"] for one in part.get("oneOf", []) if "const" in one]:
            parts.append("One of: " + ", ".join(f"`{value}`" for value in values) + ".")
    return "\n\n".join(parts) + "\n"


def not_accepted(pages: Path) -> str:
    """A table of the reasons, from the titles of their pages."""
    rows = []
    for page in sorted((pages / "how-to/not-accepted").glob("*.md")):
        if page.stem not in ("index", "warnings"):
            title = page.read_text().split("\n", 1)[0].removeprefix("# ")
            rows.append(f"| [`{page.stem}`]({page.name}) | {title} |")
    return "\n".join(["| Code | Page |", "|---|---|", *rows]) + "\n"


def export_forms(program: Path) -> str:
    """The forms of `trueline export`, as its list has them."""
    done = subprocess.run([program, "export", "--list"], text=True, capture_output=True, check=True)
    return f"```text\n{done.stdout.rstrip()}\n```\n"


def reproduced(tables: Path) -> str:
    """The tables of the paper's experiments, their headings two levels lower."""
    return re.sub(r"^#+", lambda match: f"##{match[0]}", tables.read_text(), flags=re.MULTILINE)


def generate(program: Path, root: Path, pages: Path, scratch: Path) -> dict[str, str]:
    """All generated parts by their name in the comments of a page."""
    repeat = [program, "reproduce", "--quiet", "--repeats", "2", "--out", scratch / "reproduced"]
    subprocess.run(repeat, check=True)
    return {
        "commands": commands(program),
        "exit-codes": exit_codes(program),
        "presets": presets(program, scratch),
        "result": result(root / "docs/result.schema.json"),
        "not-accepted": not_accepted(pages),
        "reproduced": reproduced(scratch / "reproduced/tables.md"),
        "export-forms": export_forms(program),
    }
