#!/bin/sh
# SPDX-License-Identifier: BSD-3-Clause
# Clients at once against the real daemon, on a body fitted to a mesh:
#     test_clients.sh MESH UNIT CLIENT...
# Each of `c`, `java` and `python` moves a tool of its own on another side of the body, which is
# moved and turned in this scene. Their tables are checked; the force on the held tool is compared
# with stiffness x penetration, computed from `shcd query` at the tool's place in the frame of the
# body (the Python client does this by itself, too). `junk` besides sends messages that are no forces
# on the channel of forces. ctest sets SHCD, SHCD_FITTER (the `shcd` that fits, maybe of another
# build), SHCDD, PRESS, PRESS_JAR, JAVA, PYTHON (programs), SOURCE (root of the sources), RATE_MIN, CALM_MIN,
# SHCD_MESHES_OPTIONAL.
set -eu

k=300
pose=0.1,-0.05,0.02,0.8,0,0.36,0.48
speed=0.02

run_client() { # NAME; its path is in path_NAME.txt
    read -r from to <"path_$1.txt"
    case $1 in
    c)
        "$PRESS" --tool 9 --from "$from" --to "$to" --speed $speed --csv c.csv
        ;;
    java)
        "$JAVA" -jar "$PRESS_JAR" --tool 5 --radius 0.002 --from "$from" --to "$to" \
            --speed $speed --csv java.csv
        ;;
    python)
        "$PYTHON" "$SOURCE/clients/python/press.py" --tool 3 --radius 0.004 --from="$from" \
            --to="$to" --speed $speed --hold 1 --csv python.csv --check body.shcd --stiffness $k \
            --pose=$pose --shcd "$SHCD"
        ;;
    esac
}

if [ "$1" = --inside ]; then # within the namespace, with a daemon running
    shift
    junk=
    running=
    for client in "$@"; do
        if [ "$client" = junk ]; then
            "$PYTHON" "$SOURCE/tests/daemon/press_check.py" junk &
            junk=$!
        else
            run_client "$client" >"$client.txt" &
            running="$running $!"
        fi
    done
    status=0
    for process in $running; do
        wait "$process" || status=1
    done
    [ -z "$junk" ] || kill "$junk" # it fails if the sender is gone
    exit $status
fi

mesh=$1
unit=$2
shift 2
if [ ! -r "$mesh" ]; then
    echo "no mesh '$mesh'; SHCD_MESHES, when the build is configured, names the folder" >&2
    [ "$SHCD_MESHES_OPTIONAL" = 0 ] || exit 77
    exit 1
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
"$SHCD_FITTER" fit "$mesh" --unit "$unit" -o body.shcd --quiet
check="$PYTHON $SOURCE/tests/daemon/press_check.py"
$check path "$SHCD" body.shcd x- $pose >path_c.txt
$check path "$SHCD" body.shcd y+ $pose >path_java.txt
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
  - {id: 5, name: bead, shape: {sphere: {radius_m: 0.002}}}
  - {id: 9, name: needle, shape: point}
END

status=0
sh "$SOURCE/tools/netns.sh" sh "$SOURCE/tools/with-shcdd.sh" "$SHCDD" scene.yaml shcdd.txt \
    sh "$SOURCE/tests/daemon/test_clients.sh" --inside "$@" 2>clients.txt || status=$?
cat clients.txt >&2
[ "$status" -ne 77 ] || exit 77
for client in "$@"; do
    echo "--- $client"
    [ "$client" = junk ] || cat "$client.txt" || true
done
echo "--- shcdd"
cat shcdd.txt
[ "$status" -eq 0 ] || exit 1
for client in "$@"; do
    case $client in
    c) radius=0 ;;
    java) radius=0.002 ;;
    python) radius=0.004 ;;
    junk) # the Java client counts it and goes on
        if ! grep -E '^press: [0-9]+ messages on SHCD_FORCE were no forces$' clients.txt; then
            echo "the Java client did not count what was no force" >&2
            exit 1
        fi
        continue
        ;;
    esac
    $check report "$client.txt" --rate-min "$RATE_MIN"
    $check table "$client.csv" --stiffness $k --ratio 0.3 --reference-speed 0.1 --speed $speed \
        --slew 500 --calm-min "$CALM_MIN"
    $check held "$SHCD" body.shcd $pose "$client.csv" --radius $radius --stiffness $k
done
