#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The programs in the README do what it says: test_readme.py c|python SOURCE BUILD [CC].

Takes the first block of that language out of README.md, builds or runs it as the README does, and
checks what it prints. Exit status 77: no private network namespace here.
"""
import os
import re
import subprocess
import sys
import tempfile


def block(source, language):
    with open(os.path.join(source, "README.md"), encoding="utf-8") as file:
        found = re.search(r"```%s\n(.*?)```" % language, file.read(), re.S)
    if not found:
        sys.exit("README.md has no block of " + language)
    return found.group(1)


def run(command, **options):
    done = subprocess.run(command, text=True, capture_output=True, timeout=60, **options)
    if done.returncode == 77:
        print(done.stderr)
        sys.exit(77)
    if done.returncode != 0:
        sys.exit("%s\n%s%s" % (" ".join(command), done.stdout, done.stderr))
    return done.stdout


def test_c(source, build, compiler, folder):
    program, body = os.path.join(folder, "touch"), os.path.join(folder, "ball.shcd")
    with open(program + ".c", "w", encoding="utf-8") as file:
        file.write(block(source, "c"))
    run([compiler, "-std=c99", "-Wall", "-Wextra", "-Werror", program + ".c", "-I", source + "/include",
         "-L", build + "/libshcd", "-lshcd", "-lm", "-o", program])
    k = 2.0466534158929770 * 0.1  # a ball of 0.1 m: sqrt(4 pi/3) R
    rows = {(0, 0): (0, 0, 0), (1, -1): (0, k, 0), (1, 0): (0, 0, k), (1, 1): (k, 0, 0)}
    table = "l,m,x,y,z\n" + "".join("%d,%d,%.17g,%.17g,%.17g\n" % (lm + c) for lm, c in rows.items())
    csv = os.path.join(folder, "ball.csv")
    with open(csv, "w", encoding="utf-8") as file:
        file.write(table)
    run([build + "/tools/shcd", "create", csv, "-o", body])
    out = run([program, body], input="0.3,0,0\n0,0,0.05\n",
              env=dict(os.environ, LD_LIBRARY_PATH=build + "/libshcd"))
    expected = ["0.200000000 m, certainly within [0.200000000, 0.200000000]; normal 1.0000",
                "-0.050000000 m, certainly within [-0.050000000, -0.050000000]; normal"]
    for line, start in zip(out.splitlines(), expected):
        if not line.startswith(start):
            sys.exit("printed %r, expected %r" % (line, start))
    if len(out.splitlines()) != 2:
        sys.exit("printed %r" % out)


def test_python(source, build, _, folder):
    program = os.path.join(folder, "touch.py")
    with open(program, "w", encoding="utf-8") as file:
        file.write(block(source, "python"))
    out = run(["sh", source + "/tools/netns.sh", "sh", "-c",
               "%s/daemon/shcdd --quiet --duration 3 & sleep 1; %s/clients/venv/bin/python %s; wait"
               % (build, build, program)])
    # the surface is at 0.05 m and the tool goes down 0.01 mm a pose: contact from 500 on
    depths = {int(seq): float(depth) for seq, depth in
              re.findall(r"^ *(\d+): .* depth of ([0-9.]+) mm$", out, re.M)}
    if not depths or depths.get(0, 0.0) != 0.0 or not any(seq > 500 for seq in depths):
        sys.exit("printed\n" + out)
    for seq, depth in depths.items():
        if abs(depth - max(0.0, 0.01 * (seq - 500))) > 0.0051:  # printed with two digits
            sys.exit("depth of %g mm at pose %d\n%s" % (depth, seq, out))


def main():
    language, source, build = sys.argv[1:4]
    with tempfile.TemporaryDirectory() as folder:
        {"c": test_c, "python": test_python}[language](source, build, (sys.argv[4:] + ["cc"])[0], folder)


main()
