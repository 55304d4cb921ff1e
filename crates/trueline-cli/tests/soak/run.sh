#!/usr/bin/env bash
# A long scan over a bad network: opt-in, on loopback.
#
#   crates/trueline-cli/tests/soak/run.sh [SECONDS]        (default 600)
#
#   TRUELINE=...   the program to test (default: target/release/trueline)
#
# `robot-sim` sends at 248 Hz with 1 % loss (three in a row on average), 1 % overtaking and 0.5 % repetition; `scan` leads it along a path as long as
# that, answers and records; a second sender throws junk at it, fifty datagrams a second. Checked: every frame that
# was sent was heard, the memory of `scan` does not grow after the first tenth, and the recording can be read. The
# time from a frame's receipt by the kernel to its answer is reported, not judged.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
TRUELINE=${TRUELINE:-$here/../../../../target/release/trueline}
seconds=${1:-600}
work=$(mktemp -d)
trap 'kill $(jobs -p) 2>/dev/null || true; rm -rf "$work"' EXIT
port=$((20000 + RANDOM % 20000))

# There and back along 0.4 m, weaving and tilting; a pose every 20 ms.
awk -v seconds="$seconds" 'BEGIN {
    print "time_s,x_mm,y_mm,z_mm,qw,qx,qy,qz"
    for (k = 0; k <= seconds * 50; k++) {
        t = k / 50
        a = 0.075 * sin(0.9 * t)
        printf "%.2f,%.6f,%.6f,600,%.9f,%.9f,0,0\n", t, 900 + 200 * sin(0.2 * t), 15 * sin(1.3 * t), sin(a), cos(a)
    }
}' > "$work/path.csv"
"$TRUELINE" scan "$work/path.csv" --write-limits "$work/limits.toml" 2> /dev/null

(echo move | "$TRUELINE" scan "$work/path.csv" --limits "$work/limits.toml" --enable-motion --bind 127.0.0.1:$port \
    --robot 127.0.0.1 --out "$work/scan" > "$work/scan.txt" 2> "$work/scan.err" && code=0 || code=$?; echo "$code" > "$work/code") &
sleep 1
scan=$(pgrep -n -f "bind 127.0.0.1:$port")
"$TRUELINE" robot-sim --pc 127.0.0.1:$port --mode guidance --path "$work/path.csv" --gain-per-s 20 --near-mm 0.05 \
    --near-deg 0.05 --near-for-s 3 --loss 0.01 --burst 3 --reorder 0.01 --duplicate 0.005 --for-s "$((seconds + 60))" \
    2> "$work/robot.err" &
robot=$!
(while kill -0 "$robot" 2> /dev/null; do
    head -c $((RANDOM % 400 + 1)) /dev/urandom > "/dev/udp/127.0.0.1/$port" || true
    sleep 0.02
done) &

memory_kib() { awk '/^VmRSS/ { print $2 }' "/proc/$scan/status" 2> /dev/null; }
sleep "$(awk -v s="$seconds" 'BEGIN { print s / 10 }')"
early=$(memory_kib)
late=$early
while kill -0 "$robot" 2> /dev/null; do
    late=$(memory_kib || true)
    late=${late:-$last}
    last=$late
    sleep 1
done
wait "$robot" || true
for _ in $(seq 100); do [ -s "$work/code" ] && break; sleep 0.1; done

cat "$work/scan.txt" "$work/scan.err" "$work/robot.err"
sent=$(sed -nE 's/^([0-9]+) frames sent.*/\1/p' "$work/robot.err")
heard=$(sed -nE 's/^ +frames +([0-9]+),.*/\1/p' "$work/scan.txt")
again=$(sed -nE 's/.*repeated ([0-9]+);.*/\1/p' "$work/scan.txt")
failed=0
verdict() { if [ "$2" = yes ]; then echo "PASS $1"; else echo "FAIL $1"; failed=1; fi; }
verdict "$heard frames and $again repetitions heard, $sent datagrams sent" \
    "$([ "$((heard + again))" = "$sent" ] && echo yes || echo no)"
verdict "memory $early KiB after a tenth, $late KiB at the end" \
    "$([ "$((late - early))" -le 2048 ] && echo yes || echo no)"
verdict "scan ended with code $(cat "$work/code")" "$([ "$(cat "$work/code")" = 0 ] && echo yes || echo no)"
exit $failed
