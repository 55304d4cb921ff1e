#!/usr/bin/env bash
# Trueline's streams of UR, FANUC and KUKA against packages not written here, over loopback. Opt-in: it downloads from the
# Python package index and takes about a minute.
#
#   crates/trueline-live/tests/interop/robots.sh
#
#   TRUELINE=...     the program to test                  (default: target/release/trueline)
#   PYTHON=...       Python 3.11 or newer                 (default: python3)
#   VENV=DIR         use or make the environment there    (default: a temporary one)
#   RTDE_CLIENT=DIR  folder of Universal Robots' RTDE_Python_Client_Library; without it that client is left out, and said so
#   KROSHU=DIR       folder kuka_rsi_simulator of kroshu's kuka_drivers; without it that simulator is left out, and said so; needs numpy
#
# PASS, FAIL and SKIP lines go to stdout; the exit code is 0 if nothing failed.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
TRUELINE=${TRUELINE:-$here/../../../../target/release/trueline}
PYTHON=${PYTHON:-python3}
work=$(mktemp -d)
jobs_started=()
cleanup() {
    for pid in "${jobs_started[@]}"; do kill "$pid" 2>/dev/null || true; done
    rm -rf "$work"
}
trap cleanup EXIT
VENV=${VENV:-$work/venv}
if [ ! -x "$VENV/bin/python" ]; then
    "$PYTHON" -m venv "$VENV"
    "$VENV/bin/pip" install --quiet ur-rtde==1.6.5 airo-fanuc==0.1.0 fanuc-ucl==2.0.2 rsipi==0.3.0
fi
peer() { timeout 60 "$VENV/bin/python" "$here/robots_peer.py" "$@"; }
failed=0
verdict() { # verdict NAME EXIT_CODE TEXT
    if [ "$2" = 0 ]; then echo "PASS $1: $3"; else echo "FAIL $1: $3"; failed=$((failed + 1)); fi
}
sim() { "$TRUELINE" stream-sim --quiet "$@" & started=$!; jobs_started+=("$started"); sleep 0.7; }
stop() { kill "$1" 2>/dev/null || true; wait "$1" 2>/dev/null || true; }

# ---- their clients, our simulated controllers ----------------------------------------------------------------------
sim --protocol ur-rtde --listen 127.0.0.1:30004 --rest-s 60
code=0; text=$(peer ur-rtde 127.0.0.1) || code=$?
verdict "ur-rtde reads our RTDE server" "$code" "$text"
if [ -n "${RTDE_CLIENT:-}" ]; then
    code=0; text=$(peer ur-own 127.0.0.1 "$RTDE_CLIENT") || code=$?
    verdict "Universal Robots' client reads our RTDE server" "$code" "$text"
else
    echo "SKIP Universal Robots' client: RTDE_CLIENT is not set"
fi
stop "$started"

peer fanuc-ucl-hspo 127.0.0.1:15000 > "$work/hspo" & receiver=$!
sleep 0.5
sim --protocol fanuc-hspo --pc 127.0.0.1:15000 --rest-s 60
code=0; wait "$receiver" || code=$?
verdict "fanuc-ucl hears our HSPO" "$code" "$(cat "$work/hspo")"
stop "$started"

sim --protocol fanuc-stream-motion --listen 127.0.0.1:60015 --version-of 3 --rest-s 60
code=0; text=$(peer airo-fanuc-client 127.0.0.1 60015) || code=$?
verdict "airo-fanuc listens to our Stream Motion 3" "$code" "$text"
stop "$started"
sim --protocol fanuc-stream-motion --listen 127.0.0.1:60015 --version-of 2 --rest-s 60
code=0; text=$(peer fanuc-ucl-stmo 127.0.0.1) || code=$?
verdict "fanuc-ucl reads our Stream Motion 2" "$code" "$text"
stop "$started"

# ---- their controllers, our listener -------------------------------------------------------------------------------
for version in 3 4; do
    peer airo-fanuc-emulator "$version" 8 > "$work/crx" & emulator=$!
    for _ in $(seq 200); do [ -s "$work/crx" ] && break; sleep 0.1; done
    rm -f "$work/listen.json"
    port=$(head -n 1 "$work/crx")
    code=0
    "$TRUELINE" listen --protocol fanuc-stream-motion --robot 127.0.0.1 --robot-port "$port" --for-s 3 \
        --json "$work/listen.json" > "$work/listen" || code=$?
    text=$("$PYTHON" - "$work/listen.json" <<'PY'
import json, sys
told = json.load(open(sys.argv[1]))
robot = told["robot"] or {"position_mm": [0, 0, 0]}
assert told["poses"] > 100 and told["sessions"] == 1, told
assert all(abs(a - b) < 1e-3 for a, b in zip(robot["position_mm"], [500, 10, 400])), robot
print(told["protocol"], told["poses"], "poses,", told["lost"], "lost, at", robot["position_mm"])
PY
) || code=1
    wait "$emulator" || code=1
    verdict "airo-fanuc's emulator, version $version, is listened to without a violation" "$code" "$text; $(tail -n 1 "$work/crx")"
done

"$TRUELINE" plan --example --out "$work/plan" --tries 300 --quiet > /dev/null
"$TRUELINE" robot-program kuka "$work/plan" --pc 127.0.0.1:64016 --out "$work/krc" 2> /dev/null
rsi() { # rsi PORT NAME [CONFIGURATION]
    local port=$1 name=$2; shift 2
    "$TRUELINE" listen --protocol kuka-rsi --bind "127.0.0.1:$port" --for-s 6 --json "$work/rsi.json" > "$work/listen" & listener=$!
    sleep 0.5
    code=0; text=$(peer rsipi-server "$port" 3 "$@") || code=$?
    wait "$listener" || code=$?
    text="$text $("$PYTHON" - "$work/rsi.json" <<'PY'
import json, sys
told = json.load(open(sys.argv[1]))
assert told["poses"] > 50 and not told["not_used"], told
print(told["poses"], "poses,", told["lost"], "lost, not used", told["not_used"])
PY
)" || code=1
    verdict "$name" "$code" "$text"
}
rsi 64017 "rsipi's controller with its ONLYSEND context is listened to"
rsi 64016 "rsipi's controller sends by the configuration of robot-program" "$work/krc/trueline_ethernet.xml"

# ---- their controllers that wait for answers -----------------------------------------------------------------------
answered() { # answered NAME PORT CONFIGURATION PEER-ARGUMENTS: the controller judges, and our listener says how many it answered
    local name=$1 port=$2 config=$3; shift 3
    peer "$@" > "$work/waits" & waits=$!
    for _ in $(seq 100); do [ -s "$config" ] && break; sleep 0.1; done
    code=0
    "$TRUELINE" listen --protocol kuka-rsi --bind "127.0.0.1:$port" --robot 127.0.0.1 --answer-rsi "$config" --for-s 9 \
        --json "$work/answered.json" > "$work/listen" || code=$?
    wait "$waits" || code=$?
    text=$("$PYTHON" - "$work/answered.json" <<'PY'
import json, sys
told = json.load(open(sys.argv[1]))
assert told["poses"] > 50, told
print(told["poses"], "poses;", told["notes"][0].split(";")[0].split(": ")[1])
PY
) || code=1
    verdict "$name" "$code" "$text; $(tail -n 1 "$work/waits")"
}
answered "rsipi's controller that waits for answers accepts ours" 64019 "$work/rsipi.xml" rsipi-answered 64019 4 "$work/rsipi.xml"
if [ -n "${KROSHU:-}" ]; then
    printf '<ROOT><CONFIG><PORT>59152</PORT><SENTYPE>KROSHU</SENTYPE><ONLYSEND>FALSE</ONLYSEND></CONFIG><RECEIVE><ELEMENTS>%s</ELEMENTS></RECEIVE></ROOT>' \
        "$(for k in 1 2 3 4 5 6; do echo "<ELEMENT TAG=\"AK.A$k\" TYPE=\"DOUBLE\" INDX=\"$k\" HOLDON=\"1\"/>"; done)" > "$work/kroshu.xml"
    answered "kroshu's simulator accepts our answers" 59152 "$work/kroshu.xml" kroshu "$KROSHU" 59152 5
else
    echo "SKIP kroshu's simulator: KROSHU is not set"
fi

# ---- recordings ----------------------------------------------------------------------------------------------------
echo 'kind = "profiler"' > "$work/sensor.toml"
record() { # record NAME TRUELINE-ARGUMENTS
    local name=$1; shift
    code=0
    "$TRUELINE" record --quiet --for-s 2 --out "$work/$name" "$@" || code=$?
    "$TRUELINE" import mcap "$work/$name/recording.mcap" --sensor "$work/sensor.toml" --out "$work/$name-folder" > /dev/null 2> "$work/$name-import" || code=$?
    rows=$(wc -l < "$work/$name-folder/robot.csv" 2> /dev/null || echo 0)
    [ "$rows" -gt 100 ] || code=1
    verdict "record and import $name" "$code" "$rows lines in robot.csv"
}
sim --protocol ur-rtde --listen 127.0.0.1:30004
record ur-rtde --protocol ur-rtde --robot 127.0.0.1
stop "$started"
sim --protocol kuka-rsi --pc 127.0.0.1:64018
record kuka-rsi --protocol kuka-rsi --bind 127.0.0.1:64018
stop "$started"
[ "$failed" = 0 ]
