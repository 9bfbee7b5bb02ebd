#!/bin/sh
# SPDX-License-Identifier: BSD-3-Clause
# Both clients at once against the real daemon, on a body fitted to a mesh:
#     test_clients.sh MESH UNIT
# The Python client, with a sphere, compares the force on the held tool with stiffness x
# penetration, which it computes from `shcd query` at the tool's place in the frame of the body,
# moved and turned in this scene. The C client moves a point on another side. ctest sets SHCD,
# SHCDD, PRESS, PYTHON (programs), SOURCE (root of the sources), RATE_MIN, SHCD_MESHES_OPTIONAL.
set -eu

k=300
pose=0.1,-0.05,0.02,0.8,0,0.36,0.48
speed=0.02

if [ "$1" = --inside ]; then # within the namespace, with a daemon running
    shift
    read -r from_c to_c <path_c.txt
    read -r from_python to_python <path_python.txt
    "$PRESS" --tool 9 --from "$from_c" --to "$to_c" --speed $speed --csv c.csv >c.txt &
    "$PYTHON" "$SOURCE/clients/python/press.py" --tool 3 --radius 0.004 --from="$from_python" \
        --to="$to_python" --speed $speed --hold 1 --csv python.csv --check body.shcd \
        --stiffness $k --pose=$pose --shcd "$SHCD" >python.txt
    wait $!
    exit
fi

mesh=$1
unit=$2
if [ ! -r "$mesh" ]; then
    echo "no mesh '$mesh'; SHCD_MESHES, when the build is configured, names the folder" >&2
    [ "$SHCD_MESHES_OPTIONAL" = 0 ] || exit 77
    exit 1
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
"$SHCD" fit "$mesh" --unit "$unit" -o body.shcd --quiet
check="$PYTHON $SOURCE/tests/daemon/press_check.py"
$check path "$SHCD" body.shcd x- $pose >path_c.txt
$check path "$SHCD" body.shcd z+ $pose >path_python.txt
cat >scene.yaml <<END
rate_hz: 1000
device: generic
bodies:
  - name: body
    model: body.shcd
    pose: {position_m: [0.1, -0.05, 0.02], orientation_wxyz: [0.8, 0, 0.36, 0.48]}
    effects:
      stiffness: {k_n_per_m: $k}
      damping: {ratio: 0.3, reference_speed_m_per_s: 0.1}
tools:
  - {id: 3, name: ball, shape: {sphere: {radius_m: 0.004}}}
  - {id: 9, name: needle, shape: point}
END

status=0
sh "$SOURCE/tools/netns.sh" sh "$SOURCE/tools/with-shcdd.sh" "$SHCDD" scene.yaml shcdd.txt \
    sh "$SOURCE/tests/daemon/test_clients.sh" --inside || status=$?
[ "$status" -ne 77 ] || exit 77
for client in c python; do
    echo "--- $client"
    cat "$client.txt" || true
done
echo "--- shcdd"
cat shcdd.txt
[ "$status" -eq 0 ] || exit 1
for client in c python; do
    $check report "$client.txt" --rate-min "$RATE_MIN"
    $check table "$client.csv" --stiffness $k --ratio 0.3 --reference-speed 0.1 --speed $speed \
        --slew 500
done
