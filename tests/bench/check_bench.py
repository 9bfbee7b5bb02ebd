# SPDX-License-Identifier: BSD-3-Clause
"""The benchmark runs, its JSON says what it measured, and all its methods agree on the distances.

    check_bench.py BENCH_QUERY SHCD [MESH]

Times are not judged here. Without a mesh (a build without the fit) an ellipsoid is asked.
"""
import json
import math
import os
import subprocess
import sys
import tempfile

N = 60
SIZES = ["--points", str(N), "--cold", "5", "--checked", "20", "--repetitions", "2",
         "--updates", "4", "--level", "4"]
EVERYWHERE = {"random", "path", "cold random", "cold path"}
ON_PATHS = {"path", "cold path"}
WORKLOADS = {"exact": EVERYWHERE, "fast": EVERYWHERE, "map": EVERYWHERE, "track": ON_PATHS,
             "next": ON_PATHS, "moved-exact": EVERYWHERE, "moved-inflated": EVERYWHERE,
             "moved-next": ON_PATHS, "point": EVERYWHERE, "jacobian": EVERYWHERE}
COMPARED = set(WORKLOADS) - {"point", "jacobian"}
UPDATES = {"inflate", "inflate-exact", "refresh", "refresh-exact", "progressive", "tick"}


def run(*command):
    return subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                          timeout=250)


def make_body(shcd, mesh, path):
    if mesh is not None:
        result = run(shcd, "fit", mesh, "--degree", "6", "-o", path)
    else:  # half axes 5, 4, 3 cm: Y_1m = sqrt(3/(4 pi)) (y, z, x)
        unit = math.sqrt(4.0 * math.pi / 3.0)
        table = path + ".csv"
        with open(table, "w") as file:
            file.write("l,m,x,y,z\n0,0,0,0,0\n1,-1,0,%.17g,0\n1,0,0,0,%.17g\n1,1,%.17g,0,0\n"
                       % (0.04 * unit, 0.03 * unit, 0.05 * unit))
        result = run(shcd, "create", table, "-o", path)
    assert result.returncode == 0, result.stderr


def check_results(body):
    seen = {}
    for r in body["results"]:
        name, workload = r["method"], r["workload"]
        seen.setdefault(name, set()).add(workload)
        assert 0.0 <= r["p50_ns"] <= r["p99_ns"], r
        if name in COMPARED and workload in ("random", "path"):
            assert r["compared"] == N and r["checked"] == 20, r
            assert r["wrong"] == 0, r
            assert r["worst_m"] <= r["tolerance_m"], r
        if name == "exact" and workload == "random":
            assert r["truncated_share"] == 0 and r["off_share"] == 0, r
            assert r["evaluations_mean"] > 0 and r["patches_mean"] > 0, r
    for name, workloads in WORKLOADS.items():
        assert seen.get(name) == workloads, (name, seen.get(name))


def main():
    bench, shcd = sys.argv[1:3]
    mesh = sys.argv[3] if len(sys.argv) > 3 else None
    with tempfile.TemporaryDirectory() as folder:
        path, report = os.path.join(folder, "body.shcd"), os.path.join(folder, "report.json")
        make_body(shcd, mesh, path)
        result = run(bench, *SIZES, "--json", report, path)
        sys.stdout.write(result.stdout)
        assert result.returncode == 0, result.stderr
        with open(report) as file:
            bodies = json.load(file)["bodies"]
        assert len(bodies) == 1 and bodies[0]["body"] == path
        body = bodies[0]
        check_results(body)
        assert UPDATES <= {u["update"] for u in body["updates"]}
        assert all(0.0 < u["p50_us"] <= u["p90_us"] for u in body["updates"])
        assert len(body["bars"]) == 11
        assert all(b["met"] == (b["value"] <= b["limit"]) for b in body["bars"])
        assert 0 < body["body_bytes"] <= body["run_time_bytes"]

        result = run(bench, "--points", "zero", path)
        assert result.returncode == 2 and "--points" in result.stderr, result.stderr
        result = run(bench, path + ".missing")
        assert result.returncode == 1 and "missing" in result.stderr, result.stderr


if __name__ == "__main__":
    main()
