"""One PASS or FAIL line about a number in the JSON line that a program printed last.

    python check.py NAME FILE KEY OP VALUE      OP: eq ne lt le gt ge
"""

import json
import operator
import pathlib
import sys


def main():
    """Exit code 0 for PASS."""
    name, path, key, op, limit = sys.argv[1:]
    lines = pathlib.Path(path).read_text().splitlines()
    try:
        got = json.loads(lines[-1])[key]
        good = getattr(operator, op)(got, json.loads(limit))
    except (IndexError, KeyError, TypeError, ValueError) as error:
        got, good = f"nothing ({type(error).__name__})", False
    got = round(got, 6) if isinstance(got, float) else got
    print(f"{'PASS' if good else 'FAIL'} {name}: {key} = {json.dumps(got)}, wanted {op} {limit}", flush=True)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
