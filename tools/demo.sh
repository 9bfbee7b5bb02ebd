#!/bin/sh
# SPDX-License-Identifier: BSD-3-Clause
# The whole way in one go: a mesh becomes a body, a daemon serves its forces at 1 kHz, a client
# presses a tool into it, slides, holds and leaves. Then the same body as soft tissue: it gives way
# under the tool, rings when that has gone, and settles. Says what happened and plots it.
#
#   demo.sh             installs what is missing, builds into build/, writes into build/demo/
#   demo.sh --use DIR   uses the programs of the build folder DIR, writes into DIR/demo/
set -eu
root=$(cd "$(dirname "$0")/.." && pwd)
case $#:${1:-} in
0:)
    build=$root/build
    ;;
2:--use)
    build=$(cd "$2" && pwd) || exit 1
    ;;
*)
    echo "usage: demo.sh [--use DIR]" >&2
    exit 2
    ;;
esac
out=$build/demo
mkdir -p "$out"

child=
stop() {
    if [ -n "$child" ]; then
        kill "$child" 2>/dev/null || true
        wait "$child" || true
    fi
}
trap stop EXIT
trap 'exit 129' HUP
trap 'exit 130' INT
trap 'exit 143' TERM

build_programs() {
    cmake --preset release && cmake --build "$build" --target shcd_command shcdd shcd_press
}

if [ $# -eq 0 ]; then
    sh "$root/tools/install-deps.sh"
    echo "building into $build"
    cd "$root"
    if ! build_programs >"$out/build.txt" 2>&1; then
        tail -n 20 "$out/build.txt" >&2
        exit 1
    fi
fi

echo "fitting scenes/organ.obj"
cd "$out"
"$build/tools/shcd" fit "$root/scenes/organ.obj" -o organ.shcd >fit.txt
cp "$root/scenes/organ.yaml" organ.yaml

# press SCENE NAME OPTION...: the daemon serves the scene, the client leaves NAME.csv and NAME.txt.
press() {
    scene=$1
    name=$2
    shift 2
    sh "$root/tools/netns.sh" sh "$root/tools/with-shcdd.sh" "$build/daemon/shcdd" "$scene" \
        shcdd.txt "$build/clients/press" --tool 0 --radius 0.003 "$@" --csv "$name.csv" \
        >"$name.txt" &
    child=$! # a shell that waited in the foreground would not see signals
    result=0
    wait "$child" || result=$?
    child=
    if [ "$result" -ne 0 ]; then
        exit "$result" # its last words are on standard error
    fi
}

# Two points about 1 cm above the upper side of the organ; the straight way between the pressed ends
# goes deeper in the middle, since the organ bulges there.
echo "pressing tool 0, a ball of 3 mm, into the organ: approach, slide, hold for 1 s, leave"
press organ.yaml press --from -0.02,0,0.06 --to 0.02,0,0.06 --depth 0.003 --speed 0.01 --hold 1
gnuplot -c "$root/tools/plot_force.gp" press.csv press.svg press.png

cp "$root/scenes/soft.yaml" soft.yaml
echo "pressing it 8 mm into the organ as soft tissue: a dent, and how it settles"
press soft.yaml soft --from -0.02,0,0.06 --to 0.02,0,0.06 --depth 0.008 --speed 0.1 --hold 0.6 \
    --stay 0.6
gnuplot -c "$root/tools/plot_soft.gp" soft.csv soft.svg soft.png

echo
sed 's/^/  /' press.txt
echo
echo "as soft tissue"
echo
sed 's/^/  /' soft.txt
echo
echo "plots:  $out/press.svg, soft.svg, and the same as .png"
echo "data:   $out/press.csv, soft.csv (forces), fit.txt (the fit), shcdd.txt (the daemon)"
