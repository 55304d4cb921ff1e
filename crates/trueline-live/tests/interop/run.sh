#!/usr/bin/env bash
# Trueline's EGM against two programs not written here, over loopback UDP. Opt-in: it downloads from the Python
# package index and takes about two minutes.
#
#   crates/trueline-live/tests/interop/run.sh
#
#   TRUELINE=...   the program to test      (default: target/release/trueline)
#   PYTHON=...     Python 3.11 or newer     (default: python3)
#   KEEP=DIR       keep the logs in DIR
#
# (a) `trueline robot-sim` must be able to drive both packages' PC side, which moves it 10 mm along x.
# (b) `trueline listen` and `trueline record` must take every frame of a robot made of each package's message classes,
#     for every RobotWare generation, and answer nothing, neither to it nor to a stranger with stale numbers.
#
# Each package gets a virtual environment of its own (both register "egm.proto", so they cannot share a process);
# everything is removed at the end. PASS and FAIL lines go to stdout; the exit code is 0 if nothing failed.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
TRUELINE=${TRUELINE:-$here/../../../../target/release/trueline}
PYTHON=${PYTHON:-python3}

# ---- the commands under test: PORT and DIR are replaced ----------------------------------------------------------
ROBOT_SIM=("$TRUELINE" robot-sim --pc 127.0.0.1:PORT --for-s 6 --mode guidance --near-mm 0.05 --near-for-s 3)
LISTEN=("$TRUELINE" listen --bind 127.0.0.1:PORT --for-s 4)
RECORD=("$TRUELINE" record --bind 127.0.0.1:PORT --for-s 4 --out DIR)
# How many frames of the robot it took, by the line that `sed -nE` finds this in.
LISTEN_COUNT='s/^ *frames +([0-9]+),.*$/\1/p'
# ---- the peers ---------------------------------------------------------------------------------------------------
CLIENT=abb-robot-client CLIENT_VERSION=0.4.0
EGM=ABBRobotEGM EGM_VERSION=1.0.7
# ---- limits ------------------------------------------------------------------------------------------------------
MOVE_S=4            # the commanded move; the robot must still run when it ends (ROBOT_SIM's --for-s)
SIM_MESSAGES=1000   # at 4.032 ms, 4.5 s are 1116 messages
MOVE_MM=9.9         # of 10 mm
END_ERROR_MM=0.2    # last command against last measured position, after 0.5 s of standing still
STUB_S=2.5          # shorter than LISTEN's --for-s, which starts WARM_UP_S earlier
WARM_UP_S=0.7
# ------------------------------------------------------------------------------------------------------------------

export PYTHONDONTWRITEBYTECODE=1
work=$(mktemp -d)
jobs_started=()
cleanup() {
    for pid in "${jobs_started[@]}"; do kill "$pid" 2>/dev/null || true; done
    if [ -n "${KEEP:-}" ]; then mkdir -p "$KEEP" && cp -r "$work/logs/." "$KEEP"; fi
    rm -rf "$work"
}
trap cleanup EXIT
mkdir "$work/logs"
command -v "$TRUELINE" > /dev/null || { echo "run.sh: no program $TRUELINE: build it or set TRUELINE" >&2; exit 2; }

failed=0
verdict() { # verdict NAME GOOD TEXT
    if [ "$2" = yes ]; then echo "PASS $1: $3"; else echo "FAIL $1: $3"; failed=$((failed + 1)); fi
}
check() { "$PYTHON" "$here/check.py" "$@" || failed=$((failed + 1)); }
free_port() { "$PYTHON" -c 'import socket; s = socket.socket(type=socket.SOCK_DGRAM); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])'; }

# start LOG WORD ...: run in the background with PORT and DIR replaced; its id is then in $started.
start() {
    local log=$1 words=()
    shift
    for word in "$@"; do word=${word//PORT/$port}; words+=("${word//DIR/$out_dir}"); done
    "${words[@]}" > "$log" 2> "$log.err" &
    started=$!
    jobs_started+=("$started")
}

# finish NAME LOG PID: wait; a bad exit code is a failure and shows the end of what the program said.
finish() {
    local code=0
    wait "$3" || code=$?
    if [ "$code" = 0 ]; then return; fi
    verdict "$1" no "exit code $code of $(basename "$2")"
    tail -n 5 "$2.err" | sed 's/^/    /'
}

venv() { # venv NAME VERSION
    "$PYTHON" -m venv "$work/$1"
    "$work/$1/bin/pip" install --quiet --disable-pip-version-check "$1==$2"
}
echo "installing $CLIENT $CLIENT_VERSION and $EGM $EGM_VERSION"
venv "$CLIENT" "$CLIENT_VERSION"
venv "$EGM" "$EGM_VERSION"

# (a) the simulated controller against a PC program
robot_sim() { # robot_sim PACKAGE PROGRAM
    local name="robot-sim with $1" log="$work/logs/sim-$1" pc
    port=$(free_port) out_dir=
    start "$log.pc" "$work/$1/bin/python" "$here/$2" --port "$port" --seconds "$MOVE_S"
    pc=$started
    sleep "$WARM_UP_S"
    start "$log.trueline" "${ROBOT_SIM[@]}"
    finish "$name" "$log.pc" "$pc"
    # The program on the PC ends before the controller, which says so as a real one does, and ends with 1.
    local code=0 events
    wait "$started" || code=$?
    events=$(sed -nE 's/^([0-9.]+) s: (event [0-9]+).*/\1 \2/p' "$log.trueline.err")
    verdict "$name" "$(awk -v code="$code" -v least="$MOVE_S" \
        'END { print (code == 1 && NR == 1 && $3 == 41822 && $1 > least) ? "yes" : "no" }' <<< "$events")" \
        "exit code $code after what it saw: ${events:-nothing}"
    check "$name" "$log.pc" messages_received ge "$SIM_MESSAGES"
    check "$name" "$log.pc" seqno_lost eq 0
    check "$name" "$log.pc" seqno_backward eq 0
    check "$name" "$log.pc" silences_of_100_ms eq 0
    check "$name" "$log.pc" commands_refused eq 0
    check "$name" "$log.pc" moved_x_mm ge "$MOVE_MM"
    check "$name" "$log.pc" command_error_mm le "$END_ERROR_MM"
}

# (b) a robot made of the package against a listening command
stub() { # stub PACKAGE COMMAND-NAME GENERATION EXTRA ... -- COMMAND ...
    local package=$1 what=$2 generation=$3 extra=() name log pc count sent
    shift 3
    while [ "$1" != -- ]; do extra+=("$1"); shift; done
    shift
    name="$what with $package $generation${extra[*]:+ ${extra[*]}}"
    log="$work/logs/$what-$package-$generation${extra[*]}"
    port=$(free_port) out_dir=$log.out
    start "$log.trueline" "$@"
    pc=$started
    sleep "$WARM_UP_S"
    start "$log.stub" "$work/$package/bin/python" "$here/robot_stub.py" "$package" --pc 127.0.0.1:"$port" \
        --seconds "$STUB_S" --generation "$generation" "${extra[@]}"
    finish "$name" "$log.stub" "$started"
    finish "$name" "$log.trueline" "$pc"
    check "$name" "$log.stub" replies eq 0
    check "$name" "$log.stub" sent ge 600
    case " ${extra[*]} " in *" --rogue "*) check "$name" "$log.stub" rogue_replies eq 0 ;; esac
    sent=$("$PYTHON" -c 'import json, sys; print(json.loads(sys.stdin.read().splitlines()[-1])["sent"])' < "$log.stub" || echo none)
    count=$(sed -nE "$LISTEN_COUNT" "$log.trueline" | tail -n 1)
    if [ "$count" = "$sent" ]; then verdict "$name" yes "$count of $sent frames"; else verdict "$name" no "${count:-no count} of $sent frames"; fi
}

robot_sim "$CLIENT" pc_abb_robot_client.py
robot_sim "$EGM" pc_abb_robot_egm.py
for package in "$CLIENT" "$EGM"; do
    for generation in 6.07 6.10 7.7 7.16; do stub "$package" listen "$generation" -- "${LISTEN[@]}"; done
    stub "$package" listen 7.7 --rogue -- "${LISTEN[@]}"
    stub "$package" record 7.7 -- "${RECORD[@]}"
done

if [ "$failed" = 0 ]; then echo "all passed"; else echo "$failed failed"; exit 1; fi
