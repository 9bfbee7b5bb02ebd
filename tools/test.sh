#!/bin/sh
# SPDX-License-Identifier: BSD-3-Clause
# Installs what is missing, builds into build/ and runs all tests; ends with ctest's own summary.
#
#   --sanitizers     first argument: also the tests of label `sanitizer`, builds of their own under
#                    gcc's sanitizers and programs under valgrind; some ten minutes more.
#   SHCD_MESHES      folder of the real test meshes. Unset: tests that need them are skipped, and
#                    ctest lists them as skipped.
#   SHCD_TEST_SCALE  share of the random cases, 1 by default; 0.1 runs a tenth of them.
# Other arguments go to ctest: sh tools/test.sh -L unit
set -eu
meshes=
optional=OFF
sanitizers=OFF
if [ "${1:-}" = --sanitizers ]; then
    sanitizers=ON
    shift
fi
if [ -n "${SHCD_MESHES:-}" ]; then
    meshes=$(cd "$SHCD_MESHES" && pwd) || exit 1 # before the cd: it may be relative
fi
cd "$(dirname "$0")/.."

sh tools/install-deps.sh

if [ -z "$meshes" ]; then
    optional=ON
    echo "test.sh: SHCD_MESHES is not set; tests that need real meshes will be skipped"
fi
# All are set on every run, since the cache would remember those of the last one.
cmake --preset release -DSHCD_MESHES="$meshes" -DSHCD_MESHES_OPTIONAL="$optional" \
    -DSHCD_SANITIZER_TESTS="$sanitizers"
cmake --build build
exec ctest --test-dir build --output-on-failure -j "$(nproc)" "$@"
