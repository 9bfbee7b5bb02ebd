# SPDX-License-Identifier: BSD-3-Clause
"""modes: what info tells of them, that fit brings them, that a copy keeps all else."""
import json
import math
import os
import struct
import unittest

from support import AXES, CommandTest, ellipsoid_rows, table

RADIUS = 0.05


def sphere_rows(degree=3):
    rows = ellipsoid_rows((RADIUS,) * 3)
    for l in range(2, degree + 1):
        rows.update({(l, m): [0.0, 0.0, 0.0] for m in range(-l, l + 1)})
    return rows


def chunks(path):
    """{name: bytes of the payload} of a body file."""
    with open(path, "rb") as file:
        data = file.read()
    found, at = {}, 32
    while at < len(data):
        length = struct.unpack_from("<Q", data, at + 16)[0]
        found[data[at:at + 4].decode()] = data[at + 24:at + 24 + length]
        at += 24 + length + 4
    return found


class Modes(CommandTest):
    def sphere(self):
        self.write("sphere.csv", table(sphere_rows()))
        self.done("create", self.path("sphere.csv"), "-o", self.path("sphere.shcd"))
        return self.path("sphere.shcd")

    def info(self, body):
        return json.loads(self.done("info", body, "--json").stdout)

    def test_eigenvalues_of_a_sphere(self):
        body, copy = self.sphere(), self.path("copy.shcd")
        self.assertIsNone(self.info(body)["modes"])
        self.assertRegex(self.done("info", body).stdout, r"(?m)^modes +none$")
        line = self.done("modes", body, "-o", copy).stdout
        self.assertRegex(line, r"^modes +16, eigenvalues 0 to 4800 /m\^2, agreement \S+; "
                               r"area 0.0314159265 m\^2, volume 0.000523598776 m\^3\n$")
        self.assertIn(line, self.done("info", copy).stdout)
        modes = self.info(copy)["modes"]
        self.assertEqual(modes["n_modes"], 16)
        self.assertFalse(modes["is_anchored"])
        self.assertLessEqual(modes["eigenvalue_error"], 1e-8)
        expected = [l * (l + 1) / RADIUS**2 for l in range(4) for _ in range(2 * l + 1)]
        for value, truth in zip(modes["eigenvalues_per_m2"], expected):
            self.assertLessEqual(abs(value - truth), 1e-10 * truth)
        self.assertLessEqual(abs(modes["area_m2"] / (4 * math.pi * RADIUS**2) - 1), 1e-8)

    def test_body_may_be_its_own_output_and_zero_removes_them(self):
        body = self.sphere()
        before = chunks(body)
        self.assertEqual(self.done("modes", body, "-o", body, "--modes", "4", "-q").stdout, "")
        self.assertEqual(self.info(body)["modes"]["n_modes"], 4)
        self.assertRegex(self.done("modes", body, "-o", body, "--modes", "0").stdout, "none")
        self.assertEqual(chunks(body), before)

    def test_copy_keeps_everything_else(self):
        self.write("body.csv", table(sphere_rows()))
        mesh, body = self.path("mesh.obj"), self.path("body.shcd")
        self.done("surface", self.sphere(), "-n", "3", "-o", mesh)
        self.done("fit", mesh, "-d", "3", "-q", "-o", body)
        self.done("cost", body, "--quick", "--points", "100", "-o", body)
        before = chunks(body)
        self.assertEqual(sorted(before), ["COEF", "COST", "FITR", "MODE"])
        self.done("modes", body, "--modes", "9", "-o", self.path("copy.shcd"))
        after = chunks(self.path("copy.shcd"))
        self.assertNotEqual(after.pop("MODE"), before.pop("MODE"))
        self.assertEqual(after, before)

    def test_anchors(self):
        body, held = self.sphere(), self.path("held.shcd")
        free, more = self.path("free.shcd"), self.path("more.shcd")
        self.done("modes", body, "-o", free)
        self.assertIn("16 (anchored)", self.done("modes", body, "-o", held, "--anchor",
                                                 "0,0,0.05,0.04").stdout)
        self.done("modes", body, "-o", more, "--anchor", "0,0,0.05,0.04", "--anchor=-0.05,0,0,3e-2,2e4")
        values = [self.info(path)["modes"]["eigenvalues_per_m2"] for path in (free, held, more)]
        for low, high in zip(values, values[1:]):
            for a, b in zip(low, high):
                self.assertLess(a, b)
        # alpha everywhere is a shift; the default is 16/radius^2
        self.done("modes", body, "-o", held, "--anchor", "0,0,0,1e6")
        self.assertLessEqual(abs(self.info(held)["modes"]["eigenvalues_per_m2"][0] - 16e-12), 1e-3)
        self.done("modes", body, "-o", held, "--anchor", "0,0,0,1e6,250")
        self.assertLessEqual(abs(self.info(held)["modes"]["eigenvalues_per_m2"][0] - 250.0), 1e-5)
        self.fails(1, "anchor 0, .* reaches no point of the surface", "modes", body, "-o",
                   self.path("none.shcd"), "--anchor", "1,0,0,0.1")

    def test_failures_leave_nothing(self):
        body, out = self.sphere(), self.path("out.shcd")
        self.fails(1, "17 modes, not 1 .. 16", "modes", body, "-o", out, "--modes", "17")
        self.fails(1, "nobody.shcd", "modes", self.path("nobody.shcd"), "-o", out)
        self.fails(1, "cannot write to the folder", "modes", body, "-o", self.path("none/o.shcd"))
        self.fails(1, "not a regular file", "modes", body, "-o", "/dev/null")

    def fit(self, mesh, *options):
        body = self.path("fitted.shcd")
        result = self.done("fit", mesh, "-o", body, "--json", self.path("report.json"), *options)
        return body, result, json.loads(self.read("report.json"))

    def test_fit_brings_modes_and_reports_them(self):
        mesh = self.path("mesh.obj")
        self.done("surface", self.sphere(), "-n", "3", "-o", mesh)
        body, result, report = self.fit(mesh, "-d", "5")
        self.assertRegex(result.stdout, r"(?m)^modes +36, eigenvalues 0 to ")
        self.assertEqual(report["model"]["modes"], self.info(body)["modes"])
        self.assertGreater(report["fit"]["time_modes_s"], 0.0)
        self.assertNotIn("reserved0", report["fit"])
        _, _, report = self.fit(mesh, "-d", "8", "--modes", "70")
        self.assertEqual(report["model"]["modes"]["n_modes"], 70)
        _, _, report = self.fit(mesh, "-d", "8")
        self.assertEqual(report["model"]["modes"]["n_modes"], 64)
        body, result, report = self.fit(mesh, "-d", "3", "--modes", "0")
        self.assertIsNone(report["model"]["modes"])
        self.assertEqual((result.stderr, sorted(chunks(body))), ("", ["COEF", "FITR"]))
        # a tolerance finds the degree: as many modes as that gives
        _, _, report = self.fit(mesh, "--tolerance", "2mm", "--modes", "1000")
        self.assertEqual(report["model"]["modes"]["n_modes"], (report["fit"]["degree"] + 1)**2)
        os.remove(body)
        os.remove(self.path("report.json"))
        self.fails(1, "fit: 17 modes, not 0 .. 16", "fit", mesh, "-d", "3", "--modes", "17", "-o",
                   body)

    def test_flat_body_has_none_and_fit_says_why(self):
        """A disc so thin that its rim takes more nodes than there may be."""
        scale = (1.0, 1.0, 1e-4)
        mesh, flat = self.path("mesh.obj"), self.path("flat.obj")
        self.done("surface", self.sphere(), "-n", "4", "-o", mesh)
        with open(mesh) as source, open(flat, "w") as target:
            for line in source:
                words = line.split()
                if words and words[0] == "v":
                    words[1:] = ["%.17g" % (s * float(x)) for s, x in zip(scale, words[1:])]
                    line = " ".join(words) + "\n"
                target.write(line)
        body, result, report = self.fit(flat, "-d", "3", "--quiet")
        self.assertIn("the body has no modes: fit_modes: with 4096 x 8192 nodes", result.stderr)
        self.assertIsNone(report["model"]["modes"])
        os.remove(body)
        os.remove(self.path("report.json"))
        self.fails(1, "flat.obj: fit_modes: with 4096 x 8192 nodes", "fit", flat, "-d", "3", "-q",
                   "--modes", "16", "-o", body)


if __name__ == "__main__":
    unittest.main()
