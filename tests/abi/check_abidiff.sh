#!/bin/sh
# SPDX-License-Identifier: BSD-3-Clause
# The library against the dump that its minor version's first release committed, by abidiff: what
# symbol lists and layouts do not see. check_abidiff.sh SOURCE FOLDER VERSION; `check_abidiff.sh
# --write SOURCE FOLDER VERSION` writes the dump. Exit status 77, which ctest reports as skipped,
# while there is none, and where abidiff is not installed (Debian: abigail-tools).
#
# abidiff needs debug information, which the release build lacks: the library is built again.
set -eu
write=
if [ "$1" = --write ]; then
    write=yes
    shift
fi
source=$1
folder=$2
version=$3
dump=$source/tests/abi/libshcd-${version%.*}.abi

if [ -z "$write" ] && [ ! -e "$dump" ]; then
    echo "no ${dump##*/}: the first release of ${version%.*} writes it (CONTRIBUTING.md)"
    exit 77
fi
if ! command -v abidiff >/dev/null; then
    echo "abidiff is not installed (Debian: abigail-tools)"
    [ -z "$write" ] || exit 1
    exit 77
fi
cmake -S "$source" -B "$folder" -DCMAKE_BUILD_TYPE=RelWithDebInfo -DSHCD_BUILD_FIT=OFF \
    -DSHCD_BUILD_DAEMON=OFF -DSHCD_BUILD_TESTS=OFF "-DCMAKE_C_FLAGS=-ffile-prefix-map=$source=."
cmake --build "$folder" --target shcd
library=$folder/libshcd/libshcd.so
if [ -n "$write" ]; then
    exec abidw --headers-dir "$source/include" --no-corpus-path --no-comp-dir-path \
        --out-file "$dump" "$library"
fi
# What may grow by the table in CONTRIBUTING.md is told by abidiff.suppr; any other change fails.
exec abidiff --no-added-syms --headers-dir2 "$source/include" \
    --suppressions "$source/tests/abi/abidiff.suppr" "$dump" "$library"
