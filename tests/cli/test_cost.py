# SPDX-License-Identifier: BSD-3-Clause
"""cost: the figures that scenes read, what theory says of them, the plot, refusals.

Times are looked at only where every machine must agree: they are positive, and in order.
"""
import json
import math
import os
import shutil
import struct
import unittest
import xml.etree.ElementTree

from support import CommandTest, ellipsoid_rows, table

HAS_FIT = os.environ["SHCD_HAS_FIT"] == "1"
DEGREE = 7
N_POINTS = 500

SPREADS = ("error_%s_m", "near_error_%s_m", "normal_%s_rad", "near_normal_%s_rad",
           "force_error_%s_n")
ROW = {
    "degree": int, "tier": str, "map_resolution": (int, type(None)),
    "interpolation": (str, type(None)), "ns_p50": float, "ns_p99": float, "path_ns_p50": float,
    "path_ns_p99": float, "evaluations_mean": float, "evaluations_p99": float,
    "patches_mean": float, "path_evaluations_mean": float, "bytes": int, "on_time_front": bool,
    "on_bytes_front": bool,
    **{name % kind: float for name in SPREADS for kind in ("max", "p99", "rms")},
}
MAP_ROW = {"map_bytes": int, "map_build_s": float, "map_radius_error_max_m": float,
           "map_radius_error_rms_m": float}
SURFACE = {"degree": int, "position_max_m": float, "position_p99_m": float,
           "position_rms_m": float, "enclosure_offset_m": float}


def bumpy_rows():
    """An ellipsoid with harmonics up to DEGREE that fall off, but are felt."""
    rows = ellipsoid_rows()
    for l in range(2, DEGREE + 1):
        for m in range(-l, l + 1):
            rows[l, m] = [4e-3 / l**2 * math.sin(7.0 * l + 3.0 * m + k) for k in range(3)]
    return rows


class Cost(CommandTest):
    @classmethod
    def setUpClass(cls):
        """One measurement that all tests look at."""
        case = cls("setUp")
        case.setUp()
        cls.addClassCleanup(case.doCleanups)
        cls.source = case.write("body.csv", table(bumpy_rows()))
        cls.body = case.path("body.shcd")
        case.done("create", cls.source, "-o", cls.body)
        case.done("surface", cls.body, "-n", "4", "-o", case.path("mesh.obj"))
        options = ["--mesh", case.path("mesh.obj")] if HAS_FIT else []
        cls.text = case.done("cost", cls.body, "--quick", "--points", str(N_POINTS), "--json",
                             case.path("cost.json"), "--plot", case.path("cost.svg"), "-o",
                             case.path("copy.shcd"), *options).stdout
        cls.cost = json.loads(case.read("cost.json"))
        cls.plot = case.read("cost.svg")
        with open(cls.body, "rb") as body, open(case.path("copy.shcd"), "rb") as copy:
            cls.body_bytes, cls.copy_bytes = body.read(), copy.read()

    def rows(self, **wanted):
        found = [row for row in self.cost["rows"]
                 if all(row[key] == value for key, value in wanted.items())]
        self.assertTrue(found, wanted)
        return found

    def assert_members(self, item, members):
        for name, kind in members.items():
            self.assertIn(name, item)
            value = item[name]
            if kind is float:
                self.assertIsInstance(value, (int, float), name)
                self.assertTrue(math.isfinite(value) and value >= 0.0, (name, value))
            else:
                self.assertIsInstance(value, kind, name)

    def test_rows_have_their_stable_names(self):
        for row in self.cost["rows"]:
            self.assert_members(row, ROW)
            self.assertIn(row["tier"], ("exact", "fast", "track", "map"))
            if row["tier"] == "map":
                self.assert_members(row, MAP_ROW)
                self.assertIn(row["interpolation"], ("linear", "hermite"))
            else:
                self.assertIsNone(row["map_resolution"])
        for surface in self.cost["surfaces"]:
            self.assert_members(surface, SURFACE)

    def test_head_tells_the_circumstances(self):
        cost = self.cost
        self.assertEqual(cost["schema"], 1)
        self.assertEqual(cost["model"]["degree"], DEGREE)
        self.assertEqual(cost["settings"]["n_random_points"], N_POINTS)
        self.assertEqual(cost["settings"]["stiffness_n_per_m"], 500.0)
        for name in ("cpu", "clock", "library_version"):
            self.assertTrue(cost["machine"][name], name)
        self.assertGreater(cost["machine"]["clock_resolution_ns"], 0.0)

    def test_every_degree_has_its_tiers(self):
        for degree in (3, 5, DEGREE):
            for tier in ("exact", "fast", "track"):
                self.assertEqual(len(self.rows(degree=degree, tier=tier)), 1)
        self.assertEqual([s["degree"] for s in self.cost["surfaces"]], [3, 5, DEGREE])

    def test_spreads_and_times_are_in_order(self):
        for row in self.cost["rows"] + self.cost["fields"]:
            for name in SPREADS:
                largest, p99, rms = (row[name % kind] for kind in ("max", "p99", "rms"))
                self.assertLessEqual(p99, largest)
                # the mean square is no more than the largest square; one rounding per point
                self.assertLessEqual(rms, largest * (1.0 + 1e-12))
            for name in ("ns", "path_ns"):
                self.assertGreater(row[name + "_p50"], 0.0)
                self.assertLessEqual(row[name + "_p50"], row[name + "_p99"])

    def test_contact_band_is_part_of_the_near_band(self):
        for row in self.cost["rows"] + self.cost["fields"]:
            self.assertLessEqual(row["error_max_m"], row["near_error_max_m"])
            self.assertLessEqual(row["normal_max_rad"], row["near_normal_max_rad"])

    def test_exact_tier_of_the_whole_series_is_within_its_tolerance(self):
        tolerance_m = self.cost["settings"]["truth_tolerance_m"]
        self.assertAlmostEqual(tolerance_m, 1e-9 * self.cost["model"]["diagonal_m"])
        row, = self.rows(degree=DEGREE, tier="exact")
        # the answer and the truth lie in intervals of that width about the same number
        self.assertLessEqual(row["near_error_max_m"], 2.0 * tolerance_m)

    def test_force_error_is_stiffness_times_depth_error(self):
        for row in self.cost["rows"]:
            # max(0, -d) changes by no more than d
            self.assertLessEqual(row["force_error_max_n"],
                                 500.0 * row["error_max_m"] * (1.0 + 1e-12))

    def test_surfaces_lie_within_the_certified_offset(self):
        tolerance_m = self.cost["settings"]["truth_tolerance_m"]
        for surface in self.cost["surfaces"]:
            self.assertLessEqual(surface["position_max_m"],
                                 surface["enclosure_offset_m"] + tolerance_m)
        offsets = [surface["enclosure_offset_m"] for surface in self.cost["surfaces"]]
        self.assertGreater(offsets[0], 0.0)
        self.assertEqual(offsets[-1], 0.0)

    def test_exact_distances_differ_by_no_more_than_the_surfaces(self):
        """Let every point of A move straight to its partner in B, no farther than the offset. Where
        the signs of d(p, A) and d(p, B) agree, the distances differ by no more than it; where they
        do not, the surface passes p on its way, so both distances are within it."""
        tolerance_m = self.cost["settings"]["truth_tolerance_m"]
        for surface in self.cost["surfaces"]:
            row, = self.rows(degree=surface["degree"], tier="exact")
            self.assertLessEqual(row["near_error_max_m"],
                                 2.0 * surface["enclosure_offset_m"] + 2.0 * tolerance_m)

    def test_memory_of_maps_grows_with_their_resolution(self):
        maps = sorted(self.rows(tier="map", interpolation="linear"),
                      key=lambda row: row["map_resolution"])
        self.assertGreaterEqual(len(maps), 2)
        for a, b in zip(maps, maps[1:]):
            self.assertLess(a["map_resolution"], b["map_resolution"])
            self.assertLess(a["map_bytes"], b["map_bytes"])
            self.assertLess(a["bytes"], b["bytes"])
        own, = [row for row in maps
                if row["map_resolution"] == self.cost["model"]["map_resolution"]]
        self.assertEqual(own["bytes"], self.cost["model"]["run_time_bytes"])

    def test_front_holds_what_nothing_beats(self):
        floor_m = self.cost["settings"]["truth_tolerance_m"]
        for mark, price in (("on_time_front", "path_ns_p50"), ("on_bytes_front", "bytes")):
            for row in self.cost["rows"]:
                beaten = any(other["error_max_m"] < row["error_max_m"] - floor_m and
                             other[price] < row[price] for other in self.cost["rows"])
                if beaten:
                    self.assertFalse(row[mark], row)
            self.assertTrue(any(row[mark] for row in self.cost["rows"]))
            # nothing is nearer to the truth than the truth: the cheapest of these is on the front
            exact = [row for row in self.cost["rows"] if row["error_max_m"] <= floor_m]
            self.assertTrue(any(row[mark] for row in exact))

    def test_fields_are_asked_without_the_series(self):
        """A linear interpolant between exact corners is off by at most twice the diagonal of a
        cell: distance changes by no more than the way, to a corner and back."""
        for field in self.cost["fields"]:
            if field["field"] == "grid":
                box = self.cost["model"]
                longest = max(b - a for a, b in zip(box["box_min_m"], box["box_max_m"]))
                cell = (longest + 0.11 * box["diagonal_m"]) / field["cells"]
                self.assertLessEqual(field["near_error_max_m"], 2.0 * math.sqrt(3.0) * cell)
        self.assertEqual(len(self.cost["fields"]) > 0 or len(self.cost["left_out"]) > 0, True)

    @unittest.skipUnless(HAS_FIT, "meshes need libshcd-fit")
    def test_mesh_of_the_surface_itself_adds_only_its_facets(self):
        """A facet over a spherical triangle of circumradius R is within eps of the surface:
        eps = R^2 (M2/c^2 + 2 M1 sin R/c^3)/2, c = cos R, M1 and M2 the bounds of |S'| and |S''|.
        The icosahedron's edges (1.11 rad) come to at most 0.09 rad in four halvings (their middles
        are not the arcs' alone: factor 1.25), R <= 0.09/sqrt(3). Distances differ by eps where
        signs agree and by twice that where they do not; the file is read in single precision."""
        model = self.cost["model"]
        radius = 0.09 / math.sqrt(3.0)
        c = math.cos(radius)
        eps = 0.5 * radius**2 * (model["max_second_derivative_m"] / c**2 +
                                 2.0 * model["max_first_derivative_m"] * math.sin(radius) / c**3)
        eps += 4.0 * 2.0**-24 * model["diagonal_m"]
        surface = self.cost["surfaces"][-1]
        self.assertEqual(surface["degree"], DEGREE)
        self.assertGreater(surface["mesh_position_max_m"], 0.0)
        self.assertLessEqual(surface["mesh_position_max_m"], eps)
        row, = self.rows(degree=DEGREE, tier="exact")
        self.assertGreater(row["mesh_error_max_m"], 0.0)
        self.assertLessEqual(row["mesh_error_max_m"], 2.0 * eps)
        self.assertLess(eps, 0.05 * model["diagonal_m"]) # else nothing was tested

    def test_text_names_units_and_marks_the_front(self):
        for word in ("[mm]", "[ns]", "[KB]", "[deg]", "[N]", "front", "certified"):
            self.assertIn(word, self.text)
        for row in self.text.splitlines():
            self.assertLessEqual(len(row), 120, row)
        self.assertRegex(self.text, r"(?m)^ +%d  exact .*B$" % DEGREE)

    def test_plot_is_a_picture_with_its_units(self):
        root = xml.etree.ElementTree.fromstring(self.plot)
        self.assertTrue(root.tag.endswith("svg"))
        text = " ".join(root.itertext())
        for word in ("[ns]", "[KB]", "[mm]", "exact", "map", "body.shcd"):
            self.assertIn(word, text)

    def test_copy_carries_the_rows(self):
        """Chunk COST: 24 bytes of head, then row count u32, row size u32, the machine's name in 96
        bytes, rows of four integers, twelve numbers and the bytes."""
        at = self.copy_bytes.index(b"COST") + 24
        n, size = struct.unpack_from("<II", self.copy_bytes, at)
        self.assertEqual((n, size), (len(self.cost["rows"]), 160))
        machine = self.copy_bytes[at + 8:at + 104].rstrip(b"\0").decode("ascii")
        self.assertTrue(self.cost["machine"]["cpu"].startswith(machine[:40]))
        tiers = {"exact": 0, "fast": 1, "map": 2, "track": 3}
        floor_m = self.cost["settings"]["truth_tolerance_m"]
        for i, row in enumerate(self.cost["rows"]):
            values = struct.unpack_from("<4i12dQ", self.copy_bytes, at + 104 + size * i)
            self.assertEqual(values[0], row["degree"])
            self.assertEqual(values[1], tiers[row["tier"]])
            self.assertEqual(values[2], row["map_resolution"] or 0)
            self.assertEqual(values[3], int(row["interpolation"] == "hermite"))
            self.assertEqual(values[4], max(row["error_max_m"], floor_m))
            self.assertEqual(values[8:12], (row["ns_p50"], row["ns_p99"], row["path_ns_p50"],
                                            row["path_ns_p99"]))
            self.assertEqual(values[16], row["bytes"])
        self.assertNotIn(b"COST", self.body_bytes)

    def test_same_seed_gives_same_errors(self):
        def errors(seed):
            result = self.done("cost", self.body, "--quick", "--points", "100", "--seed", seed,
                               "--stiffness", "250", "--json", "-")
            cost = json.loads(result.stdout)
            self.assertEqual(cost["settings"]["stiffness_n_per_m"], 250.0)
            return [[row[name] for name in row if "_ns" not in name and "ns_" not in name and
                     "front" not in name and "build" not in name] for row in cost["rows"]]
        self.assertEqual(errors("3"), errors("3"))
        self.assertNotEqual(errors("3"), errors("4"))

    def test_png(self):
        self.done("cost", self.body, "--quick", "--points", "100", "--plot", self.path("c.png"))
        with open(self.path("c.png"), "rb") as file:
            self.assertEqual(file.read(8), b"\x89PNG\r\n\x1a\n")


class Refusals(CommandTest):
    def setUp(self):
        super().setUp()
        self.body = self.make_ellipsoid()

    def test_bad_usage(self):
        self.fails(2, "BODY.shcd is missing", "cost")
        self.fails(2, "--points 99: must be 100", "cost", self.body, "--points", "99")
        self.fails(2, "--points many: must be", "cost", self.body, "--points", "many")
        self.fails(2, "--seed -1: must be 0", "cost", self.body, "--seed", "-1")
        self.fails(2, "--stiffness 0: must be a positive", "cost", self.body, "--stiffness", "0")
        self.fails(2, "--plot cost.pdf: the name must end in", "cost", self.body, "--plot",
                   "cost.pdf")
        self.fails(2, "--unit has a meaning with --mesh only", "cost", self.body, "--unit", "mm")
        self.fails(2, "--unit mile: must be", "cost", self.body, "--mesh", "m.obj", "--unit",
                   "mile")

    def test_missing_and_impossible_files(self):
        self.fails(1, "nobody.shcd", "cost", self.path("nobody.shcd"))
        self.fails(1, "cannot write to the folder", "cost", self.body, "--json",
                   self.path("none/cost.json"))
        self.fails(1, "overwrite an input", "cost", self.body, "--json", self.body)
        self.fails(1, "nomesh.obj", "cost", self.body, "--mesh", self.path("nomesh.obj"))
        self.fails(1, "two outputs cannot be one file", "cost", self.body, "--json",
                   self.path("x.shcd"), "-o", self.path("x.shcd"))
        self.fails(1, "two outputs cannot be one file", "cost", self.body, "--json",
                   self.path("x.svg"), "--plot", self.path("x.svg"))

    def test_without_gnuplot_a_plot_is_refused_before_the_work(self):
        self.path_before = os.environ["PATH"]
        self.addCleanup(os.environ.__setitem__, "PATH", self.path_before)
        os.environ["PATH"] = self.folder
        self.fails(1, "needs gnuplot", "cost", self.body, "--plot", self.path("cost.svg"))

    def fake_gnuplot(self, script):
        folder = self.path("bin")
        os.mkdir(folder)
        fake = os.path.join(folder, "gnuplot")
        with open(fake, "w") as file:
            file.write("#!/bin/sh\n" + script)
        os.chmod(fake, 0o755)
        self.addCleanup(os.environ.__setitem__, "PATH", os.environ["PATH"])
        os.environ["PATH"] = folder + ":" + os.environ["PATH"]

    def test_failing_gnuplot_is_one_line_and_no_file(self):
        self.fake_gnuplot("echo 'no such terminal' >&2\nexit 1\n")
        self.fails(1, "gnuplot: no such terminal", "cost", self.body, "--quick", "--points", "100",
                   "--plot", self.path("cost.svg"))

    def test_failing_gnuplot_takes_no_figures_with_it(self):
        self.fake_gnuplot("kill -SEGV $$\n")
        result = self.shcd("cost", self.body, "--quick", "--points", "100", "--json",
                           self.path("cost.json"), "-o", self.path("copy.shcd"), "--plot",
                           self.path("cost.svg"))
        self.assertEqual((result.returncode, result.stderr), (1, "shcd cost: gnuplot failed\n"))
        self.assertRegex(result.stdout, r"(?m)^ +1  exact ")
        self.assertTrue(json.loads(self.read("cost.json"))["rows"])
        with open(self.path("copy.shcd"), "rb") as copy:
            self.assertIn(b"COST", copy.read())
        self.assertFalse(os.path.exists(self.path("cost.svg")))

    def test_an_ellipsoid_is_answered_at_its_own_degree(self):
        cost = json.loads(self.done("cost", self.body, "--quick", "--points", "100", "--json",
                                    "-").stdout)
        self.assertEqual({row["degree"] for row in cost["rows"]}, {1})


if __name__ == "__main__":
    assert shutil.which("gnuplot"), "the plots need gnuplot"
    unittest.main()
