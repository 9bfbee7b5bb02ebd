#!/bin/sh
# SPDX-License-Identifier: BSD-3-Clause
# The command's whole round, mesh to answer, and its refusals: valgrind_command.sh SHCD SOURCE.
# VALGRIND holds valgrind and its options; its own exit status is 99.
set -eu
shcd=$1
source=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"

expect() { # STATUS ARGUMENT...
    wanted=$1
    shift
    status=0
    # shellcheck disable=SC2086 # a list of words
    $VALGRIND "$shcd" "$@" <points.csv >out.txt 2>err.txt || status=$?
    if [ "$status" -ne "$wanted" ]; then
        echo "shcd $*: exit status $status, expected $wanted" >&2
        cat out.txt err.txt >&2
        exit 1
    fi
    echo "shcd $*: exit status $status"
}

echo 0.01,0.02,0.06 >points.csv
expect 0 fit "$source/scenes/organ.obj" -o body.shcd --degree 4 --quiet
expect 0 info body.shcd --json
expect 0 query body.shcd
expect 0 query body.shcd --tier map
expect 0 surface body.shcd -o surface.ply
expect 1 fit "$source/tests/fit/meshes/open.obj" -o none.shcd
head -c 300 body.shcd >cut.shcd
expect 1 info cut.shcd
echo 0.01,0.02 >points.csv
expect 1 query body.shcd
expect 2 query
