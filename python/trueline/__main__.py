"""The program: ``python -m trueline``."""

import signal
import sys

from ._trueline import main as run


def main() -> int:
    """Run the program with the words of this command line; its exit code."""
    # The program handles Ctrl-C itself; Python would only look after the program has ended.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return run(["trueline", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
