#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Fit error against degree, as the Markdown table of the README.

usage: accuracy.py SHCD MESH[:UNIT] ...

Fits every mesh at several degrees with the given `shcd` command and prints Hausdorff and RMS error in
percent of the mesh's diagonal, and the time of the whole fit at degree 15.
"""
import json
import os
import subprocess
import sys
import tempfile

DEGREES = (5, 10, 15, 20, 30)


def fit(shcd, mesh, unit, degree, folder):
    body = os.path.join(folder, "body.shcd")
    command = [shcd, "fit", mesh, "--unit", unit, "--degree", str(degree), "-o", body,
               "--json", "-", "--quiet"]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(done.stderr.strip() or "shcd fit failed")
    return json.loads(done.stdout)


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__.strip())
    shcd = sys.argv[1]
    print("| Hausdorff / RMS, % of the diagonal | triangles | "
          + " | ".join("degree %d" % d for d in DEGREES) + " | time at 15 |")
    print("|---|---|" + "---|" * (len(DEGREES) + 1))
    with tempfile.TemporaryDirectory() as folder:
        for argument in sys.argv[2:]:
            mesh, _, unit = argument.partition(":")
            cells, triangles, time_s = [], 0, 0.0
            for degree in DEGREES:
                report = fit(shcd, mesh, unit or "m", degree, folder)
                record = report["fit"]["record"]
                triangles = record["n_triangles"]
                cells.append("%.2f / %.3f" % (record["hausdorff_error_percent_of_diagonal"],
                                              record["rms_error_percent_of_diagonal"]))
                if degree == 15:
                    time_s = report["time_s"]
            print("| %s | %d | %s | %.1f s |" % (os.path.basename(mesh), triangles,
                                                 " | ".join(cells), time_s), flush=True)


main()
