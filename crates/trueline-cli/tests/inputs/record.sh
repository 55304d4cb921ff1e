#!/usr/bin/env bash
# A camera's output on a digital input of a robot, whole programs in real time, for every protocol: opt-in, on loopback, five minutes.
#
#   TRUELINE=target/release/trueline crates/trueline-cli/tests/inputs/record.sh [PROTOCOL …]
#
# `camera-sim` shows the example's plan, its output wired to the simulated robot's input; `record` writes robot, pictures and input;
# `calibrate` and `doctor` compare the measured offset with the estimated one. Then the same with an input that is 5 ms late, which
# `doctor` must contradict. The pictures keep no step with a robot's cycle, so that edges lie everywhere in it. On a busy PC run it with
# real-time priority (`chrt -r 5`, as root). PASS and FAIL lines go to stdout; the exit code is 0 if nothing failed.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
TRUELINE=$(realpath "${TRUELINE:-$here/../../../../target/release/trueline}")
protocols=("$@")
[ $# -gt 0 ] || protocols=(egm ur-rtde fanuc-hspo fanuc-stream-motion kuka-rsi)
work=$(mktemp -d)
trap 'kill $(jobs -p) 2>/dev/null || true; rm -rf "$work"' EXIT
cd "$work"
failed=0
verdict() { if [ "$2" = 0 ]; then echo "PASS $1: $3"; else echo "FAIL $1: $3"; failed=1; fi; }

"$TRUELINE" plan --example --out plan --duration-s 20 --tries 300 --quiet > /dev/null
# A camera of a quarter of the resolution, so that its pictures are drawn in time on any machine.
awk '$1 == "width" { $3 = 612 } $1 == "height" { $3 = 500 } $1 ~ /^[fc][xy]$/ { $3 /= 4 } { print }' plan/sensor.toml > small.toml
mv small.toml plan/sensor.toml

cell() { # cell PROTOCOL DELAY_MS: records, calibrates, asks the doctor; leaves out-*.txt and sets `code` to the doctor's
    local port=$((20000 + RANDOM % 8000)) truth=$((30000 + RANDOM % 8000)) wire=$((40000 + RANDOM % 8000))
    local address=127.0.$((RANDOM % 200 + 1)).$((RANDOM % 200 + 2)) robot record
    case $1 in
        egm) robot="robot-sim --pc 127.0.0.1:$port" record="--bind 127.0.0.1:$port" ;;
        fanuc-hspo | kuka-rsi) robot="stream-sim --protocol $1 --pc 127.0.0.1:$port" record="--protocol $1 --bind 127.0.0.1:$port" ;;
        *) robot="stream-sim --protocol $1 --listen 127.0.0.1:$port" record="--protocol $1 --robot 127.0.0.1 --robot-port $port" ;;
    esac
    [ "$1" != fanuc-stream-motion ] || record="$record --inputs DI101"
    rm -rf out
    # An exposure of more than the longest cycle: shorter pulses are seen by chance only.
    "$TRUELINE" camera-sim plan --address "$address" --robot-truth "127.0.0.1:$truth" --trigger-to "127.0.0.1:$wire" --exposure-ms 20 --fps 4.7 \
        --latency-ms 150 --truth truth.toml --for-s 60 > out-camera.txt 2>&1 & local camera=$!
    # Words that are options stand unquoted.
    # shellcheck disable=SC2086
    "$TRUELINE" $robot --path plan --truth-to "127.0.0.1:$truth" --input-from "127.0.0.1:$wire" --input-delay-ms "$2" \
        > out-robot.txt 2>&1 & local sim=$!
    # shellcheck disable=SC2086
    "$TRUELINE" record $record --camera "$address" --sensor plan/sensor.toml --out out --for-s 23 > out-record.txt 2>&1 || true
    kill "$camera" "$sim" 2> /dev/null || true
    wait "$camera" "$sim" 2> /dev/null || true
    calibrated=0; "$TRUELINE" calibrate out --json out.json > out-calibrate.txt 2>&1 || calibrated=$?
    code=0; "$TRUELINE" doctor out > out-doctor.txt 2>&1 || code=$?
    told=$(grep -h "time offset measured by" out-doctor.txt | head -n 1 || true)
    facts="$told; true $(awk '$1 == "time_offset_s" { printf "%.3f ms", 1000 * $3 }' truth.toml)"
}

for protocol in "${protocols[@]}"; do
    cell "$protocol" 0
    good=1
    [ "$calibrated" = 0 ] && [ "$code" = 0 ] && grep -q "they agree" out-doctor.txt && grep -q "they agree" out-calibrate.txt && good=0
    verdict "$protocol, calibrate $calibrated, doctor $code" "$good" "$facts"
    [ "$good" = 0 ] || cat out-*.txt
    cell "$protocol" 5
    good=1
    [ "$code" = 1 ] && grep -q "time offset measured by" out-doctor.txt && ! grep -q "they agree" out-doctor.txt && good=0
    verdict "$protocol, 5 ms late, calibrate $calibrated, doctor $code" "$good" "$facts"
    [ "$good" = 0 ] || cat out-*.txt
done
exit $failed
