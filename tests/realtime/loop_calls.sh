#!/bin/sh
# SPDX-License-Identifier: BSD-3-Clause
# loop_calls.sh TEST SHCDD: runs the test with a traced shcdd, in a network namespace. Exit status 77,
# which ctest reports as skipped, where nothing can be traced.
set -eu
here=$(cd "$(dirname "$0")" && pwd)

if ! command -v strace >/dev/null; then
    echo "loop_calls.sh: strace is not installed; tools/install-deps.sh installs it" >&2
    exit 77
fi
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
if ! strace -D -f -o "$folder/try" true 2>"$folder/error"; then
    echo "loop_calls.sh: tracing is refused here: $(head -n 1 "$folder/error")" >&2
    exit 77
fi
SHCDD=$2 SHCDD_TRACE=$folder/trace "$1" "$here/traced_shcdd.sh"
