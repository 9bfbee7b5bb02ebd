#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""How much the space of a body's harmonics raises the eigenvalues of its modes: the same surface is
given zero coefficients up to a higher degree, and its modes are computed in that larger space.

    tools/modes_truncation.py BODY.shcd [--degree 30] [--modes 64] [--shcd build/tools/shcd]
"""
import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path


def eigenvalues(arguments, body, folder):
    copy = str(Path(folder, "modes.shcd"))
    line = subprocess.run([arguments.shcd, "modes", body, "-o", copy, "--modes",
                           str(arguments.modes)], check=True, stdout=subprocess.PIPE,
                          text=True).stdout
    info = subprocess.run([arguments.shcd, "info", copy, "--json"], check=True,
                          stdout=subprocess.PIPE, text=True).stdout
    info = json.loads(info)
    print(f"degree {info['degree']:2d}: {line}", end="")
    return info["degree"], info["modes"]["eigenvalues_per_m2"]


def pad(arguments, body, degree, folder):
    table, padded = Path(folder, "padded.csv"), str(Path(folder, "padded.shcd"))
    subprocess.run([arguments.shcd, "coefficients", body, "-o", str(table)], check=True)
    with table.open("a", encoding="ascii") as file:
        for l in range(degree + 1, arguments.degree + 1):
            file.writelines(f"{l},{m},0,0,0\n" for m in range(-l, l + 1))
    subprocess.run([arguments.shcd, "create", str(table), "-o", padded], check=True)
    return padded


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("body")
    parser.add_argument("--degree", type=int, default=30)
    parser.add_argument("--modes", type=int, default=64)
    parser.add_argument("--shcd", default="build/tools/shcd")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        degree, own = eigenvalues(arguments, arguments.body, folder)
        if arguments.degree <= degree:
            sys.exit(f"--degree {arguments.degree}: must be above the body's, {degree}")
        _, larger = eigenvalues(arguments, pad(arguments, arguments.body, degree, folder), folder)
    # the first may be zero, exactly
    excess = [a / b - 1.0 for a, b in zip(own[1:], larger[1:])]
    print("raised by the body's own space, largest up to a mode:")
    for k in sorted({n for n in (4, 16, 36, 64, len(own)) if 1 < n <= len(own)}):
        print(f"  {k:4d} modes  {max(excess[:k - 1]):.2g}")


if __name__ == "__main__":
    main()
