#!/usr/bin/env bash
# Cameras of Video4Linux against a stand-in for the kernel's side, in C by the kernel's own header: no device, no module, no root.
# Needs a C compiler and the kernel's headers (linux/videodev2.h).
set -euo pipefail
cd "$(dirname "$0")/../.."
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

cc -Wall -Wextra -shared -fPIC -o "$work/device.so" tests/interop/video_device.c -ldl
cargo build --quiet --features v4l2 --example v4l2_client
client=$(cargo metadata --format-version 1 --no-deps | sed -n 's/.*"target_directory":"\([^"]*\)".*/\1/p')/debug/examples/v4l2_client

failed=0
check() { # what, and whether
    if [ "$2" = yes ]; then echo "PASS  $1"; else echo "FAIL  $1"; failed=1; fi
}
has() { if grep -q -- "$2" "$1"; then echo yes; else echo no; fi; }

# run NAME ENVIRONMENT… -- ARGUMENTS…: what the client says and what the device saw.
run() {
    local name=$1 settings=()
    shift
    while [ "$1" != -- ]; do settings+=("$1"); shift; done
    shift
    env "${settings[@]}" VIDEO_LOG="$work/$name.log" LD_PRELOAD="$work/device.so" "$client" /dev/video-stand-in "$@" \
        > "$work/$name.txt" 2>&1 || echo "exit $?" >> "$work/$name.txt"
}
frames() { grep -c '^frame=' "$work/$1.txt" || true; }
# The sum of all levels of a frame, by the pattern of the device: x + 3 y + n, modulo.
sums() { # name, modulo, factor
    awk -v modulo="$2" -v factor="$3" '/^frame=.*Complete/ {
        split($1, part, "="); n = part[2]; sum = 0
        for (y = 0; y < 48; y++) for (x = 0; x < 64; x++) sum += (x + 3 * y + n) % modulo * factor
        for (k = 2; k <= NF; k++) if ($k ~ /^sum=/) { split($k, told, "="); if (told[2] != sum) wrong++ }
        seen++
    } END { print (seen > 0 && !wrong) ? "yes" : "no" }' "$work/$1.txt"
}
untouched() { has "$work/$1.log" '^violations=0 buffers=0 streaming=0 '; }

run gray VIDEO_STAMP=soe -- 12
check "gray levels: twelve pictures, every pixel, lines that are filled up" "$([ "$(frames gray)" = 12 ] && sums gray 256 1)"
check "stamps of the beginning: kept as the camera's and as the first, 30 ms old" "$(awk '/^frame=/ {
    for (k = 1; k <= NF; k++) if ($k ~ /^begin_ms=/) { gsub(/[^0-9.]/, "", $k); if ($k + 0 < 30 || $k + 0 > 130) wrong++; else seen++ }
    if ($0 !~ /device=true/) wrong++ } END { print (seen > 0 && !wrong) ? "yes" : "no" }' "$work/gray.txt")"
check "its clock can be asked" "$(has "$work/gray.txt" '^latch=true')"
check "nothing that the kernel's documentation forbids; all is given back" "$(untouched gray)"
check "automatic exposure is turned off" "$(has "$work/gray.log" 'automatic=1 ')"

run end VIDEO_STAMP=eof -- 4
check "stamps of the end: none of an exposure, no clock" "$([ "$(frames end)" = 4 ] && [ "$(grep -c device=false "$work/end.txt")" = 4 ] && has "$work/end.txt" '^latch=false')"
run copy VIDEO_STAMP=copy -- 4
check "stamps by no known clock are not used" "$([ "$(grep -c device=false "$work/copy.txt")" = 4 ] && has "$work/copy.txt" 'stamps by no known clock')"

run ten VIDEO_FORMAT=Y10 -- 4
check "ten bits in two bytes" "$([ "$(frames ten)" = 4 ] && sums ten 1024 64)"
run yuyv VIDEO_FORMAT=YUYV -- 4
check "the gray levels of YUYV" "$([ "$(frames yuyv)" = 4 ] && sums yuyv 256 1)"
run mosaic VIDEO_FORMAT=GREY -- 3 BayerRG8
check "a mosaic is set, and red is taken" "$([ "$(frames mosaic)" = 3 ] && untouched mosaic)"

run exposed -- 3 Mono8 2000 50
check "exposure and rate are set" "$(has "$work/exposed.log" 'exposure=20 period_ms=20')"
run slow -- 3 Mono8 2000 10
check "a rate that it does not have is refused" "$(has "$work/slow.txt" '10 Hz were requested, but it gives 25.000 Hz')"
run none -- 3 Mono16
check "a format that it does not have is refused with what it has" "$(has "$work/none.txt" 'pictures are required as Y16 , the camera offers GREY, Y10 , YUYV, RGGB')"
run unknown VIDEO_FORMAT=NV12 -- 3
check "a format that is not understood is refused" "$(has "$work/unknown.txt" 'pictures are required as GREY, Y10')"

run short VIDEO_SHORT_AT=2 VIDEO_ERROR_AT=4 -- 8
check "pictures that are cut off or broken have no pixels" "$([ "$(grep -c 'Incomplete.*pixels=0' "$work/short.txt")" = 2 ] && sums short 256 1)"
run gone VIDEO_GONE_AFTER=5 -- 20
check "a device that is pulled out is told, after what came" "$([ "$(frames gone)" = 5 ] && has "$work/gone.txt" 'no longer answers')"

exit $failed
