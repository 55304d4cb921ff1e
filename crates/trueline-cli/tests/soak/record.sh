#!/usr/bin/env bash
# A long recording of robot and camera in a bad cell: opt-in, on loopback.
#
#   crates/trueline-cli/tests/soak/record.sh [SECONDS]        (default 3600)
#
#   TRUELINE=...   the program to test (default: target/release/trueline)
#   CLOCK=step     also set this machine's clock by half a second and back, every ten minutes (needs root)
#
# `robot-sim` goes there and back along the example's plan at 248 Hz, 1 % of its datagrams lost, three in a row on average.
# `camera-sim` shows it at 5 pictures a second, and is taken away for five seconds every two minutes. `record` writes both, with its
# estimate on a live page. Then the same for a minute onto a disk of 3 MB (needs root: a tmpfs is mounted).
#
# Checked: every frame of the robot that was sent was recorded; every picture that was received is in the recording, and the
# camera is taken up each time; the memory of `record` after a fifth of the time is that at the end; the recording is read back
# whole and calibrates to the camera's true time offset; a full disk is said, and what was written before can be read.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
TRUELINE=$(realpath "${TRUELINE:-$here/../../../../target/release/trueline}")
seconds=${1:-3600}
work=$(mktemp -d)
trap 'kill $(jobs -p) 2>/dev/null || true; umount "$work/disk" 2>/dev/null || true; rm -rf "$work"' EXIT
cd "$work"
failed=0
verdict() { if [ "$2" = yes ]; then echo "PASS $1"; else echo "FAIL $1"; failed=1; fi; }
holds() { awk "BEGIN { print ($1) ? \"yes\" : \"no\" }"; }

"$TRUELINE" plan --example --out plan --tries 300 --quiet > /dev/null
# A camera of a quarter of the resolution: an hour of its pictures is a gigabyte.
awk '$1 == "width" { $3 = 612 } $1 == "height" { $3 = 500 } $1 ~ /^[fc][xy]$/ { $3 /= 4 } { print }' plan/sensor.toml > small.toml
mv small.toml plan/sensor.toml
# There and back along the plan, which begins and ends at rest.
awk -F, -v seconds="$seconds" -v OFS=, '
    NR == 1 { print; next }
    (NR - 2) % 5 == 0 { count++; pose[count] = $2 OFS $3 OFS $4 OFS $5 OFS $6 OFS $7 OFS $8 }
    END {
        for (k = 0; k * 0.02 < seconds; k++) {
            at = k % (2 * count - 2)
            printf "%.3f,%s\n", k * 0.02, pose[(at < count ? at : 2 * count - 2 - at) + 1]
        }
    }' plan/path.csv > path.csv

cell() { # cell SECONDS OUT: the robot and the camera, and `record` at once; sets code
    local out=$2 log=${2##*/} port=$((20000 + RANDOM % 20000)) truth=$((20000 + RANDOM % 20000))
    "$TRUELINE" robot-sim --pc "127.0.0.1:$port" --path path.csv --rest-s 0.1 --for-s "$1" --truth-to "127.0.0.1:$truth" --loss 0.01 --burst 3 \
        2> "$log.robot" & robot=$!
    (
        camera=
        trap 'kill $camera 2>/dev/null; exit' TERM
        while kill -0 "$robot" 2> /dev/null; do
            "$TRUELINE" camera-sim plan --robot-truth "127.0.0.1:$truth" --fps 5 --latency-ms 150 --truth "$log.truth" --for-s 115 \
                --quiet 2>> "$log.camera" & camera=$!
            wait "$camera" || true
            sleep 5
        done
    ) & cameras=$!
    sleep 1
    "$TRUELINE" record --bind "127.0.0.1:$port" --camera 127.0.0.1 --sensor plan/sensor.toml --serve 0 --for-s "$(($1 - 3))" --out "$out" \
        > "$log.txt" 2> "$log.err" & record=$!
}
memory_kib() { awk '/^VmRSS/ { print $2 }' "/proc/$record/status" 2> /dev/null || true; }

# ---- the long recording --------------------------------------------------------------------------------------------
cell "$seconds" long
begun=$SECONDS early=
while kill -0 "$record" 2> /dev/null; do
    sleep 5
    now=$(memory_kib)
    [ -n "$now" ] || break
    late=$now
    [ -n "$early" ] || [ $((SECONDS - begun)) -lt $((seconds / 5)) ] || early=$now
    if [ "${CLOCK:-}" = step ] && [ $(((SECONDS - begun) % 600)) -ge 595 ]; then
        date -s "@$(awk -v t="$(date +%s.%N)" 'BEGIN { printf "%.6f", t + 0.5 }')" > /dev/null
        sleep 5
        date -s "@$(awk -v t="$(date +%s.%N)" 'BEGIN { printf "%.6f", t - 0.5 }')" > /dev/null
    fi
done
code=0; wait "$record" || code=$?
kill "$cameras" 2> /dev/null || true
kill "$robot" 2> /dev/null || true
wait "$robot" "$cameras" 2> /dev/null || true
cat long.txt long.err long.robot
echo "$(stat -c %s long/recording.mcap) bytes in $seconds s"
verdict "record ended with code $code" "$(holds "$code <= 1")"
# The live estimate looks back ten minutes; until then it grows.
if [ "$seconds" -ge 3300 ]; then
    verdict "memory ${early:-none} KiB after a fifth, $late KiB at the end" "$(holds "$late - ${early:-0} <= 8192")"
else
    echo "SKIP memory: less than 3300 s; $late KiB at the end"
fi
code=0; "$TRUELINE" import mcap long --out folder > import.txt 2>&1 || code=$?
tail -n 20 import.txt
verdict "import ended with code $code" "$(holds "$code == 0")"
code=0; "$TRUELINE" calibrate folder --json long.json > calibrate.txt 2>&1 || code=$?
cat calibrate.txt long.truth
heard=$(sed -nE 's/^ +frames +([0-9]+),.*/\1/p' long.txt)
seen=$(cat long.txt long.err | sed -nE 's/^camera: ([0-9]+) pictures.*/\1/p')
verdict "$heard frames heard, and as many poses read back" "$(holds "$heard == $(($(grep -vc '^#' folder/robot.csv) - 1))")"
# An incomplete picture is recorded as a frame without a picture.
broken=$(cat long.txt long.err | sed -nE 's/^camera: .* ([0-9]+) incomplete.*/\1/p')
verdict "$seen pictures received, $broken of them incomplete, and the others read back" \
    "$(holds "$seen - $broken == $(find folder -name '*.png' | wc -l)")"
verdict "calibrate ended with code $code" "$(holds "$code == 0")"

# ---- a full disk ---------------------------------------------------------------------------------------------------
mkdir disk
if mount -t tmpfs -o size=3m tmpfs disk 2> /dev/null; then
    cell 60 disk/full
    code=0; wait "$record" || code=$?
    kill "$cameras" "$robot" 2> /dev/null || true
    wait "$robot" "$cameras" 2> /dev/null || true
    cat full.txt full.err
    verdict "record onto a full disk ended with code $code" "$(holds "$code == 1 || $code == 2")"
    cp -r disk/full rescued
    code=0; "$TRUELINE" import mcap rescued --out rescued-folder > import.txt 2>&1 || code=$?
    cat import.txt
    verdict "what was written before is read: $(wc -l < rescued-folder/robot.csv) lines" "$(holds "$code == 0")"
else
    echo "SKIP a full disk: no tmpfs may be mounted"
fi
exit $failed
