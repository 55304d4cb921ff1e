#!/usr/bin/env bash
# The same problem, the same start, the same optimum: trueline against Ceres, scipy and a Rust factor-graph library.
#
#   benches/peers/run.sh [DATASET ...]     writes BENCHMARKS.md
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
{
    echo "# Benchmarks"
    echo
    echo "Written by \`benches/peers/run.sh\`. Start: no time offset, 3.7 mm and 1.7° off. Every side computes the same whitened"
    echo "residuals, without a robust loss, and ends with the first step that is shorter than 1e-6 of a standard deviation; the fastest of"
    echo "several runs counts. Segments of the robot's path are searched outside of what is timed, as trueline keeps them from step to step."
    echo "Absolute times are of one machine, the ratios are what matters; what shares the machine is held off by real-time scheduling (\`chrt -f 10\`)."
    echo "Words like \`shop_cells 100\` are studies: \`cargo run --release -p trueline-studies -- shop_cells 100\`."
    echo
    echo "- $(grep -m1 'model name' /proc/cpuinfo | sed 's/.*: //'), $(nproc) processors, $(uname -sr)"
    echo "- $(rustc --version); $(c++ --version | head -1), -O3 -march=native"
    echo
} > "$report"
# Where that is not allowed the fastest of several runs has to do.
alone=$(chrt -f 10 true 2> /dev/null && echo "chrt -f 10" || true)
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
    cat "$here/limits.md" "$here/vision.md"
} >> "$report"
# What the studies measured stays.
sed -n '/^### The whole command/,$p' "$here/../../BENCHMARKS.md" >> "$report"
cp "$report" "$here/../../BENCHMARKS.md"
