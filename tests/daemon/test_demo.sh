#!/bin/sh
# SPDX-License-Identifier: BSD-3-Clause
# tools/demo.sh on the programs of this build: its table, its plots, and that it leaves nothing
# running, also when it is interrupted. ctest sets SOURCE, BUILD, PYTHON and RATE_MIN.
set -eu
out=$BUILD/demo
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

# All that the demo starts works in its output folder.
leftovers() {
    for link in /proc/[0-9]*/cwd; do
        if [ "$(readlink "$link" || true)" = "$out" ]; then
            tr '\0' ' ' <"${link%cwd}cmdline" || true
            echo
        fi
    done 2>/dev/null
}

status=0
sh "$SOURCE/tools/demo.sh" --use "$BUILD" >"$work/demo.txt" 2>&1 || status=$?
cat "$work/demo.txt"
[ "$status" -ne 77 ] || exit 77
[ "$status" -eq 0 ] || exit 1

# stiffness, damping, slew and speed as in scenes/organ.yaml, device `generic` and the demo
check="$PYTHON $SOURCE/tests/daemon/press_check.py"
$check report "$out/press.txt" --rate-min "$RATE_MIN"
$check table "$out/press.csv" --stiffness 400 --ratio 0.3 --reference-speed 0.1 --speed 0.01 \
    --slew 500
"$PYTHON" - "$out" <<'END'
import pathlib
import sys
import xml.etree.ElementTree

out = pathlib.Path(sys.argv[1])
svg = xml.etree.ElementTree.parse(out / "press.svg").getroot()
assert svg.tag == "{http://www.w3.org/2000/svg}svg", svg.tag
text = "".join(svg.itertext())
for words in ("force on the tool [N]", "penetration [mm]", "time [s]"):
    assert words in text, words
assert (out / "press.png").read_bytes().startswith(b"\x89PNG\r\n\x1a\n")
END

# The soft organ: its plot, and its shape as a file, from the messages.
$check report "$out/soft.txt" --rate-min "$RATE_MIN"
sh "$SOURCE/tools/netns.sh" sh "$SOURCE/tools/with-shcdd.sh" "$BUILD/daemon/shcdd" \
    "$out/soft.yaml" "$work/ply.txt" "$PYTHON" "$SOURCE/clients/python/deform_ply.py" --subdivide 2 \
    --out "$work/body.ply"
# A program that starts while the body is pressed has no rest shape: it says so, or measures from there.
cat >"$work/pressed.sh" <<'END'
"$1/clients/press" --tool 0 --radius 0.003 --from -0.02,0,0.06 --to 0.02,0,0.06 --depth 0.008 \
    --speed 0.1 --hold 6 --stay 0.1 >"$4/pressing.txt" 2>&1 &
pressing=$!
sleep 2
"$2" "$3" --subdivide 1 --wait 1 --out "$4/none.ply" 2>"$4/pressed.txt" && exit 1
grep -q "no rest shape of body 0" "$4/pressed.txt" || exit 1
[ ! -e "$4/none.ply" ] || exit 1
"$2" "$3" --subdivide 1 --first --out "$4/first.ply" || exit 1
wait "$pressing"
END
sh "$SOURCE/tools/netns.sh" sh "$SOURCE/tools/with-shcdd.sh" "$BUILD/daemon/shcdd" \
    "$out/soft.yaml" "$work/pressed_daemon.txt" sh "$work/pressed.sh" "$BUILD" "$PYTHON" \
    "$SOURCE/clients/python/deform_ply.py" "$work"
"$PYTHON" - "$out" "$work" <<'END'
import pathlib
import struct
import sys
import xml.etree.ElementTree

out, work = (pathlib.Path(path) for path in sys.argv[1:])
text = "".join(xml.etree.ElementTree.parse(out / "soft.svg").getroot().itertext())
for words in ("force on the tool [N]", "penetration [mm]", "surface displacement [mm]",
              "energy [mJ]"):
    assert words in text, words
head, body = (work / "body.ply").read_bytes().split(b"end_header\n")
assert b"element vertex 162" in head and b"element face 320" in head, head
assert len(body) == 162 * 16 + 320 * 13, len(body)
vertices = [struct.unpack_from("<4f", body, 16 * i) for i in range(162)]
spans = [max(v[k] for v in vertices) - min(v[k] for v in vertices) for k in range(3)]
# of the mesh, 207 x 118 x 105 mm, between 162 vertices
assert all(0.9 * size < span < 1.01 * size for size, span in zip((0.207, 0.118, 0.105), spans)), \
    spans
END

# Interrupted while the daemon runs: it says so in its log as soon as it does.
rm -f "$out/shcdd.txt"
sh "$SOURCE/tools/demo.sh" --use "$BUILD" >"$work/interrupted.txt" 2>&1 &
demo=$!
tries=0
until [ -s "$out/shcdd.txt" ] || [ $tries -ge 600 ]; do
    tries=$((tries + 1))
    sleep 0.1
done
kill "$demo"
status=0
wait "$demo" || status=$?
left=$(leftovers)
if [ "$status" -ne 143 ] || [ -n "$left" ]; then
    echo "interrupted: status $status, still running: $left" >&2
    cat "$work/interrupted.txt" >&2
    exit 1
fi
echo "interrupted in time, nothing left running"
