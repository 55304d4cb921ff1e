#!/usr/bin/env bash
# Poses of a ROS 2 topic, published over DDS by a program not written here, on loopback. Opt-in: it downloads cyclonedds from the
# Python package index.
#
#   cargo build --bin trueline --features full,ros2 && TRUELINE=target/debug/trueline crates/trueline-cell/tests/interop/ros2.sh
#
#   PYTHON=...   Python 3.11 or newer   (default: python3)
#   VENV=DIR     use or make the environment there
#
# PASS and FAIL lines go to stdout; the exit code is 0 if nothing failed. No ROS is needed, and none was at hand: what is judged is the
# library's DDS against Eclipse Cyclone DDS, which is one of those that ROS 2 runs on, and our reading of its messages.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
TRUELINE=$(realpath "${TRUELINE:-$here/../../../../target/release/trueline}")
PYTHON=${PYTHON:-python3}
work=$(mktemp -d)
trap 'kill $(jobs -p) 2>/dev/null || true; rm -rf "$work"' EXIT
VENV=${VENV:-$work/venv}
if [ ! -x "$VENV/bin/python" ]; then
    "$PYTHON" -m venv "$VENV"
    "$VENV/bin/pip" install --quiet cyclonedds==11.0.1
fi
cd "$work"
export CYCLONEDDS_URI='<CycloneDDS><Domain><General><AllowMulticast>false</AllowMulticast><Interfaces><NetworkInterface
address="127.0.0.1"/></Interfaces></General><Discovery><ParticipantIndex>auto</ParticipantIndex><Peers><Peer
address="127.0.0.1"/></Peers></Discovery></Domain></CycloneDDS>'
failed=0
verdict() { if [ "$2" = 0 ]; then echo "PASS $1: $3"; else echo "FAIL $1: $3"; failed=1; fi; }

"$VENV/bin/python" "$here/ros2_driver.py" 40 /tcp_pose > sent & driver=$!
code=0; "$TRUELINE" listen --ros2 /tcp_pose --for-s 12 --json listen.json > listen.txt 2>&1 || code=$?
text=$("$PYTHON" - <<'PY' 2>&1
import json
told = json.load(open("listen.json"))
assert told["poses"] > 200 and not told["not_used"], told
x, y, z = told["robot"]["position_mm"]
assert 500 < x < 1000 and abs(y + 250) < 1e-6 and abs(z - 750) < 1e-6, told
print(told["protocol"], told["poses"], "poses,", told["lost"], "lost, at", told["robot"]["position_mm"])
PY
) || code=1
verdict "a topic of Cyclone DDS is listened to" "$code" "$text"
echo 'kind = "profiler"' > sensor.toml
code=0; "$TRUELINE" record --ros2 /tcp_pose --for-s 10 --out cell --sensor sensor.toml --quiet > record.txt 2>&1 || code=$?
"$TRUELINE" import mcap cell --out folder > import.txt 2>&1 || code=$?
text=$("$PYTHON" - <<'PY' 2>&1
import csv
rows = [row for row in csv.DictReader(line for line in open("folder/robot.csv") if not line.startswith("#"))]
assert len(rows) > 150, len(rows)
# 0.1 mm a message; a row was lost where two steps are in one.
steps = [round((float(b["x_mm"]) - float(a["x_mm"])) / 0.1) for a, b in zip(rows, rows[1:])]
assert all(step >= 1 for step in steps) and sum(step > 1 for step in steps) <= 5, steps
print(len(rows), "poses recorded and read back")
PY
) || code=1
verdict "they are recorded" "$code" "$text"
code=0; "$TRUELINE" listen --ros2 /nothing_there --for-s 1 > none.txt 2>&1 || code=$?
verdict "a topic that nobody publishes is said to be silent" "$([ "$code" = 1 ]; echo $?)" "$(head -n 1 none.txt)"

# ---- transforms ----------------------------------------------------------------------------------------------------
kill "$driver" 2>/dev/null || true
heard() { # heard KIND: listens to a driver of that kind
    "$VENV/bin/python" "$here/ros2_driver.py" 25 /tf "$1" > sent & driver=$!
    sleep 1
    code=0; "$TRUELINE" listen --ros2 /tf --ros2-frames base:tool0 --for-s 15 --json tf.json > "tf-$1.txt" 2>&1 || code=$?
    kill "$driver" 2>/dev/null || true
    wait "$driver" 2>/dev/null || true
}
heard tf
text=$("$PYTHON" - <<'PY' 2>&1
import json
told = json.load(open("tf.json"))
x, y, z = told["robot"]["position_mm"]
assert told["poses"] > 200 and 500 < x < 1000 and abs(y - 250) < 1e-6 and abs(z - 625) < 1e-6, told
print(told["poses"], "poses at", told["robot"]["position_mm"], told["notes"])
PY
) || code=1
verdict "transforms of Cyclone DDS are composed, with a static one from before" "$code" "$text"
heard loop
verdict "a loop of frames ends it" "$([ "$code" = 1 ] && grep -q "form a loop" tf-loop.txt; echo $?)" "$(tail -n 1 tf-loop.txt)"
heard missing
verdict "a missing transform is told" "$([ "$code" = 1 ] && grep -q "no transforms lead from" tf-missing.txt; echo $?)" "$(grep lead tf-missing.txt)"
heard changed
verdict "a static transform that changes ends it" "$([ "$code" = 1 ] && grep -q "static transform of .tool0. changed" tf-changed.txt; echo $?)" "$(tail -n 1 tf-changed.txt)"

# ---- the node ------------------------------------------------------------------------------------------------------
cat > robot.urdf <<'XML'
<robot name="slide"><link name="base_link"/><link name="tool0"/>
  <joint name="slide" type="prismatic"><parent link="base_link"/><child link="tool0"/><axis xyz="1 0 0"/></joint></robot>
XML
"$TRUELINE" simulate --quiet --preset profiler --seed 4 --time-offset-ms 20 --out profiler > simulate.txt 2>&1
# The sensor as its file states it: the cell computes with this.
"$TRUELINE" calibrate profiler --sensor fixed --quiet --json result.json > calibrate.txt 2>&1
# Its verdict is that of the last weld.
"$TRUELINE" simulate --quiet --production 3 --out welds > production.txt 2>&1
"$TRUELINE" watch --state watch.sqlite --calibration result.json --quiet welds/weld-* > watch.txt 2>&1 || true
node() { # node KIND OPTIONS...: a cell whose robot publishes poses or joints
    local kind=$1; shift
    "$TRUELINE" ros2-node --calibration result.json --sensor profiler/sensor.toml --profiles /profiler/points --state watch.sqlite --for-s 60 "$@" > "node-$kind.txt" 2>&1 & node=$!
    code=0; text=$("$VENV/bin/python" "$here/ros2_cell.py" result.json "$kind" 2>&1) || code=$?
    kill -INT "$node" 2>/dev/null || true
    wait "$node" || code=$?
    verdict "points of a node whose robot publishes $kind are where they should be" "$code" "$text"
}
node poses --poses /tcp_pose
node transforms --poses /tf
node joints --poses /joint_states --urdf robot.urdf
[ "$failed" = 0 ] || cat ./*.txt
exit $failed
