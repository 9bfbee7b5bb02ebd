#!/bin/sh
# SPDX-License-Identifier: BSD-3-Clause
# Makes the figures of docs/effects.md about `wave` anew: wave_docs.sh [BUILD]
# The contact force against the number of modes (docs/wave-modes.txt, .svg), and what each effect
# costs in a tick (docs/effects-price.txt), on the organ of this project with all its 256 modes.
set -eu
root=$(cd "$(dirname "$0")/.." && pwd)
build=$(cd "${1:-$root/build}" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
"$build/tools/shcd" fit "$root/scenes/organ.obj" --modes 256 -o "$work/organ.shcd" >"$work/fit.txt"
"$build/tests/bench/bench_modes" "$work/organ.shcd" >"$work/modes.txt"
"$build/tests/bench/bench_effects" "$work/organ.shcd" >"$work/price.txt"
gnuplot -c "$root/tools/plot_modes.gp" "$work/modes.txt" "$work/modes.svg"
cp "$work/modes.txt" "$root/docs/wave-modes.txt"
cp "$work/modes.svg" "$root/docs/wave-modes.svg"
cp "$work/price.txt" "$root/docs/effects-price.txt"
cat "$work/modes.txt" "$work/price.txt"
