# SPDX-License-Identifier: BSD-3-Clause
"""query: the table it writes, the lines it refuses, and closed forms on an ellipsoid."""
import csv
import io
import math
import os
import subprocess
import unittest

from support import AXES, DIAGONAL, SHCD, CommandTest

HEADER = "x,y,z,distance,lower,upper,cx,cy,cz,nx,ny,nz,flags"
FLAGS = {"truncated", "sign_unsure", "not_stationary", "map_edge", "radial"}

# Contract of the exact tier: upper - lower <= 1e-9 max(diagonal, |d|)
TOLERANCE = 1e-9


class Query(CommandTest):
    def setUp(self):
        super().setUp()
        self.body = self.make_ellipsoid()

    def rows(self, points, *options):
        text = "".join("%.17g,%.17g,%.17g\n" % tuple(p) for p in points)
        out = self.done("query", self.body, *options, stdin=text).stdout
        self.assertEqual(out.splitlines()[0], HEADER)
        table = list(csv.DictReader(io.StringIO(out)))
        self.assertEqual(len(table), len(points))
        for row, p in zip(table, points):
            self.assertEqual([float(row[k]) for k in "xyz"], list(p))
            self.assertLessEqual(set(filter(None, row["flags"].split("|"))), FLAGS)
        return table

    def assert_distance(self, row, expected):
        width = TOLERANCE * max(DIAGONAL, abs(expected))
        rounding = 1e-15
        self.assertEqual(row["flags"], "")
        self.assertLessEqual(abs(float(row["distance"]) - expected), width)
        self.assertLessEqual(float(row["lower"]), expected + rounding)
        self.assertGreaterEqual(float(row["upper"]), expected - rounding)
        self.assertLessEqual(float(row["upper"]) - float(row["lower"]), width * (1 + 1e-12))

    def test_outside_on_the_axes(self):
        for k in range(3):
            for sign in (1.0, -1.0):
                for gap in (1e-6, 1e-3, 0.1, 5.0):
                    p = [0.0, 0.0, 0.0]
                    p[k] = sign * (AXES[k] + gap)
                    row = self.rows([p])[0]
                    self.assert_distance(row, abs(p[k]) - AXES[k])
                    # the foot is a minimum: its error is of the order of the root of the
                    # distance's, the distance grows as its square
                    foot = [float(row["c" + c]) for c in "xyz"]
                    normal = [float(row["n" + c]) for c in "xyz"]
                    self.assertLessEqual(abs(foot[k] - sign * AXES[k]), TOLERANCE * DIAGONAL)
                    self.assertLessEqual(abs(math.hypot(*normal) - 1.0), 1e-12)
                    self.assertGreater(normal[k] * sign, 0.99)

    def test_inside_on_the_shortest_axis(self):
        points = [(0.0, 0.0, t * AXES[2]) for t in (-0.9, -0.5, 0.5, 0.9)]
        for row, p in zip(self.rows(points), points):
            self.assert_distance(row, abs(p[2]) - AXES[2])

    def test_inside_on_the_longest_axis_the_foot_leaves_the_axis(self):
        a, c = AXES[0], AXES[2]
        points = [(t * (a * a - c * c) / a, 0.0, 0.0) for t in (0.25, 0.5, 0.75)]
        for row, p in zip(self.rows(points), points):
            self.assert_distance(row, -c * math.sqrt(1.0 - p[0] ** 2 / (a * a - c * c)))

    def test_tolerance_in_metres_bounds_the_interval_near_and_far(self):
        points = [(0.06, 0.01, 0.0), (0.01, 0.02, 0.005), (3.0, -4.0, 1.0), (200.0, 1.0, 2.0)]
        for text, metres in (("1e-5", 1e-5), ("0.001mm", 1e-6), ("1", 1.0)):
            for row in self.rows(points, "--tolerance", text):
                self.assertNotIn("truncated", row["flags"])
                # an unknown side doubles the interval: it covers the distance and its negative
                allowed = 2.0 * metres if "sign_unsure" in row["flags"] else metres
                self.assertLessEqual(float(row["upper"]) - float(row["lower"]), allowed)

    def test_fast_tier_encloses_the_exact_distance(self):
        points = [(0.06, 0.01, 0.0), (0.01, 0.02, 0.005), (0.0, 0.05, 0.02), (-0.2, 0.1, 0.3)]
        exact = self.rows(points)
        for fast, row in zip(self.rows(points, "--tier", "fast"), exact):
            self.assertLessEqual(float(fast["lower"]), float(row["upper"]))
            self.assertGreaterEqual(float(fast["upper"]), float(row["lower"]))

    def test_map_tier_says_that_it_is_radial(self):
        for row in self.rows([(0.06, 0.01, 0.0), (0.01, 0.0, 0.005)], "--tier", "map"):
            self.assertIn("radial", row["flags"].split("|"))

    def test_map_options_choose_grid_resolution_and_interpolation(self):
        # centre and directions of the axes are nodes of every grid: the depth is exact there but
        # for the float that a node stores (6e-8 of the radius)
        points = [(2.0 * AXES[0], 0.0, 0.0), (0.0, 0.0, -2.0 * AXES[2])]
        for options in ([], ["--interpolation", "hermite"], ["--resolution", "6"],
                        ["--grid", "octahedral", "--resolution", "5"],
                        ["--grid", "latlong", "--resolution", "8", "--interpolation", "linear"]):
            for row, axis in zip(self.rows(points, "--tier", "map", *options), (0, 2)):
                self.assertAlmostEqual(float(row["distance"]), AXES[axis], delta=1e-6 * AXES[axis])
        # off the nodes a finer grid is better, and the cubic better than the linear look-up
        p = (0.9 * AXES[0], 0.7 * AXES[1], 0.5 * AXES[2])
        level = math.sqrt(sum((x / a) ** 2 for x, a in zip(p, AXES)))
        truth = math.hypot(*p) * (1.0 - 1.0 / level)

        def error(*options):
            (row,) = self.rows([p], "--tier", "map", *options)
            return abs(float(row["distance"]) - truth)

        coarse = error("--resolution", "5")
        self.assertLess(error("--resolution", "80"), 0.1 * coarse)
        self.assertLess(error("--resolution", "5", "--interpolation", "hermite"), 0.5 * coarse)
        self.assertLess(error("--grid", "latlong", "--resolution", "160"), 0.1 * coarse)

    def test_header_comments_blank_lines_and_line_ends(self):
        text = "\ufeff# points\r\n x , y,z\r\n\r\n 0.1 ,\t0, 0\r\n# more\n-0.1,0,+0"
        lines = self.done("query", self.body, stdin=text).stdout.splitlines()
        self.assertEqual(len(lines), 3)
        self.assertTrue(lines[1].startswith("0.10000000000000001,0,0,"))
        self.assertTrue(lines[2].startswith("-0.10000000000000001,0,0,"))

    def test_no_points_give_the_header_only(self):
        self.assertEqual(self.done("query", self.body).stdout, HEADER + "\n")

    def test_a_bad_line_is_named_and_the_rows_before_it_are_whole(self):
        for line, reason in (("1,2", "2 fields instead of x,y,z"), ("1,2,3,4", "4 fields"),
                             ("1,nan,3", "field 2, 'nan'"), ("1,2,inf", "field 3"),
                             ("1,2,1e999", "field 3"), ("1,2,3m", "field 3"),
                             ("1;2;3", "1 fields"), ("1,,3", "field 2, ''"),
                             ("x,y,z", "field 1, 'x'"), ("1,2,0x3", "field 3")):
            result = self.fails(1, "stdin:3: .*" + reason, "query", self.body,
                                stdin="# comment\n0.1,0,0\n%s\n0.2,0,0\n" % line)
            lines = result.stdout.splitlines()
            self.assertEqual(len(lines), 2)
            self.assertEqual(lines[1].count(","), HEADER.count(","))
            self.assertTrue(result.stdout.endswith("\n"))

    def test_a_point_is_answered_before_the_next_is_sent(self):
        with subprocess.Popen([SHCD, "query", self.body], stdin=subprocess.PIPE,
                              stdout=subprocess.PIPE, text=True) as process:
            self.assertEqual(process.stdout.readline(), HEADER + "\n")
            for _ in range(3):
                process.stdin.write("0.1,0,0\n")
                process.stdin.flush()
                self.assertTrue(process.stdout.readline().startswith("0.1"))
            process.stdin.close()
            self.assertEqual(process.wait(timeout=60), 0)

    def test_the_locale_changes_nothing(self):
        environment = dict(os.environ, LC_ALL="de_DE.UTF-8", LANG="de_DE.UTF-8")
        plain = self.done("query", self.body, stdin="0.1,0,0\n").stdout
        self.assertEqual(self.done("query", self.body, stdin="0.1,0,0\n", env=environment).stdout,
                         plain)


if __name__ == "__main__":
    unittest.main()
