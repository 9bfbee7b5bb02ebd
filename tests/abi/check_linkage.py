#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What a binary is called and links: its soname, the libraries it names itself (readelf -d), and
those it must never load, by whatever way (ldd)."""
import argparse
import re
import subprocess
import sys


def run(*command):
    return subprocess.run(command, check=True, text=True, capture_output=True).stdout


def base(library):
    """libz.so.1 -> z"""
    return re.sub(r"^lib", "", library.split("/")[-1]).split(".so")[0]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("binary")
    parser.add_argument("--readelf", default="readelf")
    parser.add_argument("--soname")
    parser.add_argument("--only", help="the libraries it may name: z,m,c")
    parser.add_argument("--never", help="the libraries it must not load: gsl,fftw3")
    arguments = parser.parse_args()
    dynamic = run(arguments.readelf, "-d", "-W", arguments.binary)
    soname = re.findall(r"\(SONAME\).*\[(.*)\]", dynamic)
    needed = [base(name) for name in re.findall(r"\(NEEDED\).*\[(.*)\]", dynamic)]
    failures = []
    if arguments.soname and soname != [arguments.soname]:
        failures.append(f"soname {soname}, expected {arguments.soname}")
    if not needed:
        failures.append("names no library at all: not the binary that was meant")
    if arguments.only:
        # the loader is named where thread-local storage or the compiler's helpers call it
        allowed = {*arguments.only.split(","), "ld-linux-x86-64", "ld-linux-aarch64"}
        failures += [f"links {name}" for name in needed if name not in allowed]
    if arguments.never:
        loaded = {base(line.split()[0]) for line in run("ldd", arguments.binary).splitlines()
                  if ".so" in line}
        failures += [f"loads {name}" for name in arguments.never.split(",") if name in loaded]
    print("\n".join(failures + [f"links {', '.join(needed)}: {len(failures)} failures"]))
    return len(failures) > 0


if __name__ == "__main__":
    sys.exit(main())
