#!/bin/sh
# SPDX-License-Identifier: BSD-3-Clause
# Installs the Debian packages that the build, the tests and the demo need and that are not there
# yet. Needs root or sudo only if something is missing.
set -eu

packages='
    build-essential cmake ninja-build
    zlib1g-dev libccd-dev
    libgsl-dev libfftw3-dev libsuitesparse-dev libassimp-dev
    liblcm-dev liblcm-bin libfyaml-dev
    default-jdk-headless liblcm-java
    libcmocka-dev python3 python3-venv pkg-config
    doxygen groff-base
    gnuplot-nox valgrind
    iproute2 util-linux strace
'
# zlib: body files; libccd: culling of tools, and an oracle of tests; GSL to Assimp: libshcd-fit;
# LCM, libfyaml: the daemon and its clients; JDK, liblcm-java: the client in Java; cmocka, Python,
# pkg-config: tests; doxygen, groff: checks of the reference and the man pages; gnuplot: plots;
# valgrind: test.sh --sanitizers, instruction counts of the benchmark; iproute2, util-linux: private
# network namespaces; strace: a proof about the loop thread. Without those for Java and for the
# checks, ctest lists tests as skipped.

if ! command -v dpkg-query >/dev/null; then
    echo "install-deps.sh: not a Debian system, nothing installed; needed is what Debian calls:"
    echo "   " $packages
    exit 0
fi

missing=
for package in $packages; do
    if [ "$package" = gnuplot-nox ] && command -v gnuplot >/dev/null; then
        continue # any flavour of gnuplot will do
    fi
    if [ "$package" = default-jdk-headless ] && command -v javac >/dev/null; then
        continue # likewise
    fi
    status=$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null || true)
    if [ "$status" != installed ]; then
        missing="$missing $package"
    fi
done
if [ -z "$missing" ]; then
    echo "install-deps.sh: all packages are there"
    exit 0
fi

echo "install-deps.sh: to be installed:$missing"
if [ "$(id -u)" = 0 ]; then
    as_root=
elif command -v sudo >/dev/null; then
    as_root=sudo
else
    echo "install-deps.sh: neither root nor sudo; have somebody run as root:" >&2
    echo "    apt-get update && apt-get install --no-install-recommends$missing" >&2
    exit 1
fi
$as_root apt-get update
# shellcheck disable=SC2086 # a list of words
$as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends $missing
