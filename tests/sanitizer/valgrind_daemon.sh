#!/bin/sh
# SPDX-License-Identifier: BSD-3-Clause
# A session over LCM, daemon and client under valgrind: valgrind_daemon.sh SHCDD PRESS SOURCE.
# VALGRIND holds valgrind and its options. In a network namespace; exit status 77: none to be had.
set -eu
shcdd=$1
press=$2
source=$3
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
status=0
# shellcheck disable=SC2086 # lists of words
sh "$source/tools/netns.sh" sh "$source/tools/with-shcdd.sh" "$VALGRIND $shcdd" \
    "$source/scenes/ellipsoid.yaml" "$work/shcdd.txt" \
    $VALGRIND "$press" --from -0.03,0,0.12 --to 0.03,0,0.12 --csv "$work/press.csv" || status=$?
[ "$status" -ne 77 ] || exit 77
cat "$work/shcdd.txt" # all of it: valgrind writes there
exit "$status"
