#!/bin/sh
# Our client against the simulated camera of the Aravis project, and Aravis' programs against ours.
#
# Needs arv-tool-0.8, arv-camera-test-0.8 and arv-fake-gv-camera-0.8 (Debian: aravis-tools, aravis-tools-cli) and
# network namespaces for users (`unshare -rn`), so that it disturbs no camera that is there. Installs nothing.
# Prints a line of PASS or FAIL for each check and fails if one of them did. Takes about a minute.
#
#     crates/trueline-camera/tests/interop/run.sh
set -u
HERE=$(cd "$(dirname "$0")" && pwd)
ROOT=$(cd "$HERE/../../../.." && pwd)

if [ "${1:-}" != inside ]; then
    for program in arv-tool-0.8 arv-camera-test-0.8 arv-fake-gv-camera-0.8; do
        command -v "$program" >/dev/null ||
            { echo "$program is missing; on Debian: aravis-tools aravis-tools-cli"; exit 2; }
    done
    unshare -rn true || { echo "network namespaces are not allowed here"; exit 2; }
    (cd "$ROOT" && cargo build -q -p trueline-camera --examples) || exit 2
    exec unshare -rn sh "$0" inside "${CARGO_TARGET_DIR:-$ROOT/target}/debug/examples"
fi

BIN=$2
OUT=$(mktemp -d)
FAILED=0
# A child that outlives its check is stopped by its number only.
DEVICE=
trap '[ -n "$DEVICE" ] && kill "$DEVICE" 2>/dev/null; rm -rf "$OUT"' EXIT
ip link set lo up

say() { # ok? what, facts
    if [ "$1" = 0 ]; then echo "PASS $2: $3"; else echo "FAIL $2: $3"; FAILED=1; fi
}
start() { "$@" >"$OUT/device" 2>&1 & DEVICE=$!; sleep 0.7; }
stop() { kill "$DEVICE" 2>/dev/null; wait "$DEVICE" 2>/dev/null; DEVICE=; }
value() { sed -n "s/^$1 *= *\([0-9]*\).*/\1/p" "$OUT/test" | tail -1; }
# Aravis as root reads loopback past the sockets and sees nothing there, hence --no-packet-socket.
aravis() {
    timeout 20 arv-camera-test-0.8 --no-packet-socket -a -i 1400 --duration=5 "$@" >"$OUT/test" 2>&1
    COMPLETED=$(value n_completed_buffers) FAILURES=$(value n_failures) MISSING=$(value n_missing_frames)
    RESENT=$(value n_resent_packets)
    FACTS="completed ${COMPLETED:-0}, failures ${FAILURES:-?}, missing ${MISSING:-?}, resent ${RESENT:-?}"
}

start arv-fake-gv-camera-0.8 -i 127.0.0.1 -s TEST
LINE=$("$BIN/gige_client" 127.0.0.1 60 1024 800 3000 2>&1); RC=$?
say $RC "our client, their camera, 60 pictures" "$LINE"
case $LINE in *latch=none*) RC=0 ;; *) RC=1 ;; esac
say $RC "a latch that never moves is seen" "$LINE"
stop

start "$BIN/gige_device" 127.0.0.2 60
LINE=$(timeout 10 arv-tool-0.8 2>&1)
case $LINE in *"SIM-1 (127.0.0.2)"*) RC=0 ;; *) RC=1 ;; esac
say $RC "their tool finds our camera" "$LINE"
LINE=$(timeout 8 arv-tool-0.8 -a 127.0.0.2 control Width=640 ExposureTime=3000 PixelFormat=Mono12 PayloadSize 2>&1 | tr '\n' ' ')
case $LINE in *"Width = 640"*"ExposureTime = 3000"*"PixelFormat = Mono12"*"PayloadSize = 1280000"*) RC=0 ;; *) RC=1 ;; esac
say $RC "their tool writes and reads our registers" "$LINE"
LINE=$(timeout 8 arv-tool-0.8 -a 127.0.0.2 control PixelFormat=Mono8 Width=1224 GevTimestampControlLatch GevTimestampValue GevTimestampControlLatch GevTimestampValue 2>&1 |
    sed -n 's/^GevTimestampValue = \([0-9]*\).*/\1/p' | tr '\n' ' ')
set -- $LINE
[ $# = 2 ] && [ "$2" -gt "$1" ]; say $? "their tool latches our clock" "$LINE"
aravis
[ "${COMPLETED:-0}" -ge 140 ] && [ "${FAILURES:-1}" = 0 ] && [ "${MISSING:-1}" = 0 ]
say $? "our camera, their client, 5 s of 1224 x 1000 at 30 Hz" "$FACTS"
LINE=$("$BIN/gige_client" 127.0.0.2 60 2>&1); RC=$?
say $RC "our client, our camera, 60 pictures" "$LINE"
timeout 10 arv-camera-test-0.8 --no-packet-socket --duration=3 >/dev/null 2>&1 & OTHER=$!
sleep 1
LINE=$("$BIN/gige_client" 127.0.0.2 5 2>&1); RC=$?
case $LINE in *Busy*) RC=0 ;; *) RC=1 ;; esac
say $RC "our camera is busy with their client" "$LINE"
wait "$OTHER"
stop

start "$BIN/gige_device" 127.0.0.2 60 1224 1000 30 0.002
aravis
[ "${COMPLETED:-0}" -ge 140 ] && [ "${FAILURES:-99}" -le 2 ] && [ "${RESENT:-0}" -gt 0 ]
say $? "the same with 0.2 % of the packets lost" "$FACTS"
stop

start "$BIN/gige_device" 127.0.0.2 60 2448 2000 10
aravis
[ "${COMPLETED:-0}" -ge 40 ] && [ "${FAILURES:-99}" -le 2 ]
say $? "our camera, their client, 5 s of 2448 x 2000 at 10 Hz" "$FACTS"
LINE=$("$BIN/gige_client" 127.0.0.2 40 2>&1); RC=$?
say $RC "our client, our camera, 40 pictures of 2448 x 2000" "$LINE"
stop
exit $FAILED
