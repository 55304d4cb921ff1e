#!/usr/bin/env bash
# The live view of `record` and `watch`, seen by the viewer library `@foxglove/ws-protocol` of npm. Opt-in: it downloads three packages.
#
#   crates/trueline-cli/tests/interop/foxglove.sh
#
# Needs node and npm. The exit code is that of the tests; where there is no npm it says so and ends with 0.
set -euo pipefail
cd "$(dirname "$0")/../../../.."
if ! command -v npm >/dev/null; then
    echo "SKIPPED: foxglove: npm is not installed"
    exit 0
fi
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
(cd "$folder" && npm init --yes >/dev/null && npm install --silent --no-audit --no-fund @foxglove/ws-protocol@0.8.0 ws@8 protobufjs@7)
TRUELINE_NODE_MODULES=$folder/node_modules cargo test --workspace --test foxglove
