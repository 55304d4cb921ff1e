#!/usr/bin/env bash
# The same problem, the same start, the same optimum: trueline against Ceres, scipy and a Rust factor-graph library.
#
#   benches/peers/run.sh [DATASET ...]     writes the first part of BENCHMARKS.md
#
# Needs libceres-dev, cmake and a C++ compiler (Debian: apt install libceres-dev cmake g++), and Python with numpy and
# scipy (PYTHON=...). Every DATASET is a dataset folder; a simulated scan always comes first.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
build=${BUILD_DIR:-$here/target}
python=${PYTHON:-python3}
mkdir -p "$build/ceres"
CARGO_TARGET_DIR=$build cargo build --release --quiet --manifest-path "$here/rust/Cargo.toml"
cmake -S "$here/ceres" -B "$build/ceres" -DCMAKE_BUILD_TYPE=Release > "$build/cmake.log"
cmake --build "$build/ceres" >> "$build/cmake.log"
report=$build/BENCHMARKS.md
old=$here/../../BENCHMARKS.md
# Without real-time scheduling, the fastest of several runs counts.
alone=$(chrt -f 10 true 2> /dev/null && echo "chrt -f 10" || true)
{
    # The introduction up to the sentence on this measurement stays.
    sed '/^Measured on /,$d' "$old"
    echo "Measured on $(date -I), commit $(git -C "$here" rev-parse --short=8 HEAD)."
    echo
    echo "- $(grep -m1 'model name' /proc/cpuinfo | sed 's/.*: //'), $(nproc) processors, $(uname -sr)"
    echo "- $(rustc --version); $(c++ --version | head -1), -O3 -march=native"
    echo
} > "$report"
for dataset in "" "$@"; do
    name=${dataset:+Dataset $(basename "$dataset")}
    RAYON_NUM_THREADS=1 $alone "$build/release/peers" "$build/problem.bin" ${dataset:+"$dataset"} > "$build/rust.json"
    $alone "$build/ceres/peer_ceres" "$build/problem.bin" > "$build/ceres.json"
    OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $alone "$python" "$here/scipy_peer.py" "$build/problem.bin" > "$build/scipy.json"
    "$python" "$here/table.py" "${name:-Simulated: two lines, 140 s}" "$build"/{rust,ceres,scipy}.json | tee -a "$report"
done
{
    echo "### Growing scans"
    echo
    CARGO_TARGET_DIR=$build/root cargo run --release --quiet --manifest-path "$here/../../Cargo.toml" -p trueline-studies -- scaling
    echo
    # Results of other programs stay.
    sed -n '/^<!-- run.sh keeps what follows -->/,$p' "$old"
} >> "$report"
cp "$report" "$old"
