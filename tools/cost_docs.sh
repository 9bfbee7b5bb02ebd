#!/bin/sh
# SPDX-License-Identifier: BSD-3-Clause
# Writes docs/cost-organ.json, .svg and .txt anew: fits scenes/organ.obj and measures what its
# accuracy costs on this machine. Takes about a minute; the machine should have nothing else to do.
#
#   cost_docs.sh             builds into build/ first
#   cost_docs.sh --use DIR   uses the programs of the build folder DIR
set -eu
root=$(cd "$(dirname "$0")/.." && pwd)
case $#:${1:-} in
0:)
    build=$root/build
    cd "$root"
    cmake --preset release >/dev/null
    cmake --build "$build" --target shcd_command >/dev/null
    ;;
2:--use)
    build=$(cd "$2" && pwd) || exit 1
    ;;
*)
    echo "usage: cost_docs.sh [--use DIR]" >&2
    exit 2
    ;;
esac

# In a folder of its own, so that the files name no other.
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
trap 'exit 129' HUP
trap 'exit 130' INT
trap 'exit 143' TERM
cp "$root/scenes/organ.obj" "$work"
cd "$work"
"$build/tools/shcd" fit organ.obj -o organ.shcd --quiet
"$build/tools/shcd" cost organ.shcd --mesh organ.obj --json cost-organ.json \
    --plot cost-organ.svg >cost-organ.txt
cp cost-organ.json cost-organ.svg cost-organ.txt "$root/docs"
cat cost-organ.txt
