#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The benchmark of the stages runs, its ways of asking agree, and its table adds up.

    check_stages.py BENCH_STAGES SHCD [MESH]

Times are not judged here. Without a mesh (a build without the fit) an ellipsoid is asked.
"""
import os
import re
import subprocess
import sys
import tempfile

from check_bench import make_body

WAYS = ["search", "ball, search", "ball, degree 1, search", "ball, degree 1, seed, search",
        "search with certificates", "all stages, and certificates"]


def run(*command):
    return subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                          timeout=250)


def shares(line):
    """Of ball, degree 1, seed, search [%]; a stage that ended nowhere is a pair of dashes."""
    fields = re.findall(r"([\d.]+) % +\d+|(-) +-", line[34:])
    return [float(number or 0.0) for number, _ in fields]


def check_table(lines):
    found = {}
    for way in WAYS:
        line, = [line for line in lines if line[:34].rstrip() == way]
        found[way] = shares(line)
        assert len(found[way]) == 4, line
        # four shares, rounded to 0.1 each
        assert abs(sum(found[way]) - 100.0) <= 0.2 + 1e-9, line
    assert found["search"] == [0.0, 0.0, 0.0, 100.0]
    assert found["search with certificates"] == [0.0, 0.0, 0.0, 100.0]
    ball, degree_1, seed = (found[way] for way in WAYS[1:4])
    # the ball is far off on part of the way, and what one stage has ended no later one sees
    assert ball[0] > 10.0 and ball[1:3] == [0.0, 0.0]
    assert degree_1[0] == ball[0] == seed[0] and degree_1[1] == seed[1]
    assert degree_1[3] <= ball[3] and seed[3] <= degree_1[3]
    # pressed in, the last foot alone proves it
    assert seed[2] > 10.0
    assert found[WAYS[5]][:2] == seed[:2]


def main():
    bench, shcd = sys.argv[1:3]
    mesh = sys.argv[3] if len(sys.argv) > 3 else None
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "body.shcd")
        make_body(shcd, mesh, path)
        result = run(bench, "--quick", path)
        sys.stdout.write(result.stdout)
        assert result.returncode == 0, result.stderr
        check_table(result.stdout.splitlines())
        assert run(bench, "--quick").returncode == 2
        result = run(bench, path + ".missing")
        assert result.returncode == 1 and "missing" in result.stderr, result.stderr


if __name__ == "__main__":
    main()
