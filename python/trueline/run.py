"""The program itself, for whatever has no function of its own."""

from __future__ import annotations

import subprocess
import sys

from ._trueline import TruelineError


def run(*words: str) -> str:
    """Run the program; what it prints on its standard output.

    Ctrl-C reaches it as well.

    Raises
    ------
    TruelineError
        If it could not run, with its hint.

    Examples
    --------
    >>> run("--version").split()[0]
    'trueline'
    """
    done = subprocess.run([sys.executable, "-m", "trueline", *words], capture_output=True, text=True, check=False)
    if done.returncode in (0, 1):
        return done.stdout
    message, _, hint = done.stderr.strip().removeprefix("error: ").partition("\n\nhint: ")
    error = TruelineError(message)
    error.hint = hint
    if hint:
        error.add_note(f"hint: {hint}")
    raise error
