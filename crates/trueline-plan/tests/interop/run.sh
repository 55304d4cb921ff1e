#!/usr/bin/env bash
# Plans against code that was not written here, and scans cast by other geometry. Opt-in: it downloads from the Python package index and
# takes some minutes.
#
#   crates/trueline-plan/tests/interop/run.sh [CELLS]
#
#   TRUELINE=...  the program to test               (default: target/release/trueline)
#   PYTHON=...    Python 3.11 or newer              (default: python3)
#   VENV=DIR      use or make the environment there (default: a temporary one)
#
# - wrong_cells.py plans the example's first scan, casts it by numpy and scipy in so many randomly wrong cells (200), calibrates each from
#   nothing, and compares the spread of the estimates with the prediction.
# - arm_limits.py plans with a UR5e, and looks at the joints' angles with ikpy and a URDF from airo-models: where they bring the tool, and
#   what they use of ranges and speeds.
#
# PASS and FAIL lines go to stdout; the exit code is 0 if nothing failed.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
TRUELINE=$(realpath "${TRUELINE:-$here/../../../../target/release/trueline}")
PYTHON=${PYTHON:-python3}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
VENV=${VENV:-$work/venv}
if [ ! -x "$VENV/bin/python" ]; then
    "$PYTHON" -m venv "$VENV"
    "$VENV/bin/pip" install --quiet numpy scipy ikpy==4.2.1 airo-models==0.0.12
fi
failed=0
"$VENV/bin/python" "$here/arm_limits.py" "$TRUELINE" "$work/arm" || failed=1
"$VENV/bin/python" "$here/wrong_cells.py" "$TRUELINE" "$work/cells" "${1:-200}" || failed=1
exit $failed
