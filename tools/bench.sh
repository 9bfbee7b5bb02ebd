#!/bin/sh
# SPDX-License-Identifier: BSD-3-Clause
# What queries cost, in one command: builds plain (-O2) and native (-O3 -march=native) into folders
# of its own below build/bench/, fits the bodies, measures both, and the plain one with the portable
# evaluation besides, then what the stages of detection save, counts instructions, and ends with the
# goals that are met and missed.
#
#   bench.sh [OPTION...]
#     --peers      Embree and CGAL in the same runs (GPL binary, stays in build/bench/)
#     --quick      few points: minutes become seconds, and p99 means little
#     --json FILE  everything for programs
#     --docs       writes the figures into docs/performance.md (implies --peers)
#     --profile [METHOD]  only this: where callgrind sees the instructions of METHOD (exact) go,
#                  random points on the project's organ
#
# SHCD_MESHES names the folder of real meshes; without it only the project's own organ is measured.
# How time is taken: tests/bench/run.c. The exit status does not depend on any time.
set -eu
meshes=
if [ -n "${SHCD_MESHES:-}" ]; then
    meshes=$(cd "$SHCD_MESHES" && pwd) || exit 1 # before the cd: it may be relative
fi
started=$PWD
root=$(cd "$(dirname "$0")/.." && pwd)
out=$root/build/bench
peers=OFF
docs=
json=
profile=
sizes=
n_counted=200

usage() {
    sed -n 's/^#   //p' "$0" >&2
    exit 2
}
fail() {
    echo "bench.sh: $*" >&2
    exit 1
}

while [ $# -gt 0 ]; do
    case $1 in
    --peers) peers=ON ;;
    --quick)
        sizes='--points 250 --cold 25 --checked 20 --repetitions 3 --updates 11'
        n_counted=25
        ;;
    --docs)
        peers=ON
        docs=$root/docs/performance.md
        ;;
    --json)
        [ $# -ge 2 ] || usage
        shift
        json=$1
        case $json in /*) ;; *) json=$started/$json ;; esac
        ;;
    --profile)
        profile=exact
        case ${2:--} in
        -*) ;;
        *)
            shift
            profile=$1
            ;;
        esac
        ;;
    *) usage ;;
    esac
    shift
done

if [ $peers = ON ]; then
    for header in embree3/rtcore.h CGAL/AABB_tree.h; do
        echo "#include <$header>" | c++ -std=c++17 -fsyntax-only -x c++ - 2>/dev/null ||
            fail "--peers needs $header; on Debian: apt-get install libembree-dev libcgal-dev"
    done
fi
for tool in cmake ninja valgrind callgrind_annotate; do
    command -v $tool >/dev/null || fail "$tool is missing; on Debian: cmake, ninja-build, valgrind"
done

# build NAME FLAGS: the programs with these optimisation flags
build() {
    folder=$out/$1
    mkdir -p "$folder"
    if ! {
        cmake -G Ninja -S "$root" -B "$folder" -DCMAKE_BUILD_TYPE=Release \
            -DCMAKE_C_FLAGS_RELEASE="$2 -DNDEBUG" -DCMAKE_CXX_FLAGS_RELEASE="$2 -DNDEBUG" \
            -DSHCD_BUILD_DAEMON=OFF -DSHCD_BENCH_PEERS=$peers -DSHCD_MESHES="$meshes" \
            -DSHCD_MESHES_OPTIONAL=ON &&
            cmake --build "$folder" --target shcd_command bench_query bench_evaluation bench_stages
    } >"$folder/build.txt" 2>&1; then
        tail -n 20 "$folder/build.txt" >&2
        fail "cannot build $1; all of it: $folder/build.txt"
    fi
}

# fit: every body once, by the plain build
fit() {
    mkdir -p "$out/bodies"
    bodies=
    set -- "$root/scenes/organ.obj"
    if [ -n "$meshes" ] && [ -z "$profile" ]; then
        set -- "$@" "$meshes/liver-smooth.obj" "$meshes/liver.obj" \
            "$meshes/Armadillo_verysimplified.obj"
    fi
    for mesh in "$@"; do
        name=$(basename "$mesh" .obj)
        "$out/plain/tools/shcd" fit "$mesh" --degree 15 -o "$out/bodies/$name.shcd" \
            >"$out/bodies/$name.txt" 2>&1 || fail "cannot fit $mesh: $(cat "$out/bodies/$name.txt")"
        bodies="$bodies $name.shcd"
    done
}

machine() {
    echo "processor   $(sed -n 's/^model name[^:]*: //p' /proc/cpuinfo 2>/dev/null | head -n 1)," \
        "$(getconf _NPROCESSORS_ONLN) of them"
    echo "caches      $(lscpu 2>/dev/null | sed -n 's/^\(L1d\|L2\|L3\)[^:]*: */\1 /p' |
        tr '\n' ';' | sed 's/;$//; s/;/, /g')"
    echo "vectors     $(sed -n 's/^flags[^:]*: //p' /proc/cpuinfo 2>/dev/null | head -n 1 |
        tr ' ' '\n' | grep -E '^(sse2|avx|avx2|fma|avx512f)$' | tr '\n' ' ')"
    echo "system      $(uname -srm)"
    echo "compiler    $(cc --version | head -n 1)"
    echo "load        $(cut -d ' ' -f 1-3 /proc/loadavg 2>/dev/null) (1, 5, 15 min)"
}

# measure NAME BUILD [OPTION...]: the interleaved run of one build
measure() {
    name=$1
    program=$out/$2/tests/bench/bench_query
    shift 2
    echo
    echo "######## $name build"
    # shellcheck disable=SC2086 # lists of words
    (cd "$out/bodies" && "$program" $sizes "$@" --json "$out/$name.json" $bodies) \
        >"$out/$name.txt" || fail "the $name run failed; see $out/$name.txt"
    cat "$out/$name.txt"
    awk '/^bars, /{on = 1} /^$/{on = 0} on {print}' "$out/$name.txt" >"$out/bars-$name.txt"
}

# count BODY METHODS: one callgrind profile for each set of queries, $out/callgrind.N
count() {
    rm -f "$out"/callgrind.*
    (cd "$out/bodies" && valgrind -q --tool=callgrind --instr-atstart=no \
        --callgrind-out-file="$out/callgrind" "$out/plain/tests/bench/bench_query" \
        --count $n_counted --points $n_counted --only "$2" "$1") >"$out/callgrind.txt" 2>&1 ||
        fail "callgrind failed; see $out/callgrind.txt"
}

# A line "METHOD WORKLOAD INSTRUCTIONS" for each set; the loop itself (harness) is taken off.
counts() {
    for set in "$out"/callgrind.[0-9]*; do
        awk -v n=$n_counted '/^desc: Trigger: Client Request: /{name = $5; workload = $6}
            /^totals: /{print name, workload, $2 / n}' "$set"
    done | awk '$1 == "harness" {loop[$2] = $3}
        {name[NR] = $1; workload[NR] = $2; value[NR] = $3}
        END {for (i = 1; i <= NR; i++) if (name[i] != "harness")
            printf "%s %s %.0f\n", name[i], workload[i], value[i] - loop[workload[i]]}' | sort
}

methods=exact,fast,next,moved-exact,moved-next,track,map,map-hermite,map-tier,point,jacobian

print_counts() {
    echo
    echo "instructions per query (callgrind, plain build, mean of $n_counted)"
    printf '  %-28s %-14s %10s %10s\n' body method random path
    for name in $bodies; do
        count "$name" "$methods"
        counts >"$out/counts-$name.txt"
        awk -v body="$name" '{value[$1, $2] = $3; if (!seen[$1]++) order[++n] = $1}
            END {for (i = 1; i <= n; i++)
                printf "  %-28s %-14s %10s %10s\n", body, order[i],
                    value[order[i], "random"], value[order[i], "path"]}' "$out/counts-$name.txt"
    done
}

# write_json: both runs and the counts
write_json() {
    {
        comma='{'
        for name in $runs; do
            printf '%s"%s": ' "$comma" "$name"
            cat "$out/$name.json"
            comma=', '
        done
        printf ', "instructions": {'
        comma=
        for name in $bodies; do
            printf '%s"%s": [' "$comma" "$name"
            awk '{printf "%s{\"method\": \"%s\", \"workload\": \"%s\", \"per_query\": %s}",
                (NR > 1 ? ", " : ""), $1, $2, $3}' "$out/counts-$name.txt"
            printf ']'
            comma=', '
        done
        printf '}}\n'
    } >"$json"
}

# put MARK FILE: FILE becomes the block of docs/performance.md between its two marks
put() {
    awk -v begin="<!-- begin $1 -->" -v end="<!-- end $1 -->" -v file="$2" '
        $0 == end {skip = 0}
        !skip {print}
        $0 == begin {
            skip = 1
            print "```"
            while ((getline line < file) > 0) print line
            print "```"
        }' "$docs" >"$out/performance.md"
    cat "$out/performance.md" >"$docs" # keeps its mode
}

flags='-O2'
build plain "$flags"
fit
if [ -n "$profile" ]; then
    count organ.shcd "$profile"
    for set in "$out"/callgrind.[0-9]*; do
        if grep -q "Client Request: $profile random" "$set"; then
            callgrind_annotate --threshold=95 --auto=no "$set" | sed -n '/^Ir/,$p' | head -n 50
            exit 0
        fi
    done
    fail "no method $profile"
fi
flags='-O3 -march=native -ffp-contract=off'
build native "$flags"

machine >"$out/machine.txt"
cat "$out/machine.txt"
[ -n "$meshes" ] || echo "bench.sh: SHCD_MESHES is not set: only the project's own organ"
runs='plain portable native'
measure plain plain
measure portable plain --simd portable
measure native native
rounds=
[ -z "$sizes" ] || rounds=11
for name in plain native; do
    echo
    echo "######## evaluation of a surface, $name build"
    # shellcheck disable=SC2086 # none or one
    "$out/$name/tests/bench/bench_evaluation" $rounds >"$out/evaluation-$name.txt" ||
        fail "the evaluation's run failed; see $out/evaluation-$name.txt"
    cat "$out/evaluation-$name.txt"
done
quick=
[ -z "$sizes" ] || quick=--quick
echo
echo "######## stages of detection, native build"
# shellcheck disable=SC2086 # none or one; a list of words
(cd "$out/bodies" && "$out/native/tests/bench/bench_stages" $quick $bodies) >"$out/stages-all.txt" ||
    fail "the stages' run failed; see $out/stages-all.txt"
cat "$out/stages-all.txt"
print_counts >"$out/counts.txt"
cat "$out/counts.txt"
for name in $runs; do
    echo
    echo "######## bars, $name build"
    cat "$out/bars-$name.txt"
done
[ -z "$json" ] || write_json
if [ -n "$docs" ]; then
    shown=organ.shcd
    [ -z "$meshes" ] || shown=liver-smooth.shcd
    awk -v body="== $shown:" '/^== /{on = index($0, body) == 1} /^bars, /{on = 0} on' \
        "$out/native.txt" >"$out/table.txt"
    awk -v body="$shown:" '/: degree /{on = index($0, body) == 1} on' "$out/stages-all.txt" |
        sed -e :a -e '/^\n*$/{$d;N;ba' -e '}' >"$out/stages.txt"
    for name in machine table stages counts evaluation-native bars-plain bars-portable \
        bars-native; do
        put "$name" "$out/$name.txt"
    done
    echo "bench.sh: wrote $docs"
fi
