# SPDX-License-Identifier: BSD-3-Clause
"""fit: reports, units, refusals, and that a failure leaves nothing behind."""
import json
import math
import os
import pty
import subprocess
import unittest

from support import AXES, SHCD, CommandTest

# faces of an octahedron, counter-clockwise seen from outside
OCTAHEDRON = [(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5),
              (0, 3, 5)]


def ellipsoid_mesh(level=3, scale=1.0):
    points = [(1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, -1.0, 0.0),
              (0.0, 0.0, 1.0), (0.0, 0.0, -1.0)]
    faces = list(OCTAHEDRON)
    for _ in range(level):
        middles, split = {}, []
        for face in faces:
            m = []
            for k in range(3):
                edge = tuple(sorted((face[k], face[(k + 1) % 3])))
                if edge not in middles:
                    p = [x + y for x, y in zip(points[edge[0]], points[edge[1]])]
                    middles[edge] = len(points)
                    points.append(tuple(x / math.hypot(*p) for x in p))
                m.append(middles[edge])
            split += [(face[0], m[0], m[2]), (face[1], m[1], m[0]), (face[2], m[2], m[1]),
                      (m[0], m[1], m[2])]
        faces = split
    return [[scale * a * x for a, x in zip(AXES, p)] for p in points], faces


def obj(vertices, faces):
    text = "".join("v %.9g %.9g %.9g\n" % tuple(v) for v in vertices)
    return text + "".join("f %d %d %d\n" % tuple(i + 1 for i in f) for f in faces)


class Fit(CommandTest):
    def mesh(self, name="mesh.obj", **options):
        return self.write(name, obj(*ellipsoid_mesh(**options)))

    def fit(self, mesh, *options):
        body = self.path("body.shcd")
        return body, self.done("fit", mesh, "-o", body, *options)

    def test_report_for_people(self):
        body, result = self.fit(self.mesh(), "--degree", "5")
        self.assertEqual(result.stderr, "")
        for text in ("512 triangles, 258 vertices", "RMS error", "Hausdorff error",
                     "% of the diagonal", "area distortion", "star-shaped", "self-intersection",
                     "time"):
            self.assertIn(text, result.stdout)
        self.assertTrue(os.path.exists(body))

    def test_report_as_json_and_the_body_agree(self):
        body, result = self.fit(self.mesh(), "--degree", "5", "--json", self.path("report.json"))
        self.assertIn("RMS error", result.stdout)
        report = json.loads(self.read("report.json"))
        info = json.loads(self.done("info", body, "--json").stdout)
        self.assertEqual(report["mesh"]["n_triangles"], 512)
        self.assertEqual(report["fit"]["degree"], 5)
        self.assertEqual(report["fit"]["n_flipped"], 0)
        self.assertEqual(report["fit"]["record"], info["fit"])
        self.assertEqual(report["unit_m"], 1.0)
        self.assertIsNone(report["tolerance_m"])
        for key, value in report["model"].items():
            if key != "run_time_bytes":
                self.assertEqual(value, info[key], key)
        record = report["fit"]["record"]
        self.assertLess(record["rms_error_percent_of_diagonal"], 1.0)
        self.assertLessEqual(record["rms_error_m"], record["hausdorff_error_m"])

    def test_json_on_standard_output_is_all_there_is(self):
        _, result = self.fit(self.mesh(), "--degree", "3", "--json", "-")
        self.assertEqual(json.loads(result.stdout)["fit"]["degree"], 3)

    def test_quiet_says_nothing(self):
        _, result = self.fit(self.mesh(), "--degree", "3", "--quiet")
        self.assertEqual((result.stdout, result.stderr), ("", ""))

    def test_units_give_the_same_body(self):
        sizes = []
        for unit, scale in (("m", 1.0), ("cm", 100.0), ("mm", 1000.0), ("0.5", 2.0)):
            _, result = self.fit(self.mesh(scale=scale), "-d", "3", "--unit", unit, "--json", "-")
            sizes.append(json.loads(result.stdout)["model"]["diagonal_m"])
        for size in sizes[1:]:
            # the file holds 9 digits and the importer stores single precision
            self.assertLessEqual(abs(size / sizes[0] - 1.0), 1e-6)

    def test_wrong_unit_brings_a_warning(self):
        _, result = self.fit(self.mesh(scale=1000.0), "-d", "3", "--quiet")
        self.assertRegex(result.stderr, "^shcd fit: warning: .*not between 1 mm and 10 m.*\n$")

    def test_tolerance_chooses_a_degree_that_meets_it(self):
        _, result = self.fit(self.mesh(), "--tolerance", "1mm", "--json", "-")
        report = json.loads(result.stdout)
        self.assertEqual(report["tolerance_m"], 1e-3)
        self.assertLessEqual(report["fit"]["record"]["hausdorff_error_m"], 1e-3)
        self.assertLess(report["fit"]["degree"], 15)

    def test_tolerance_that_cannot_be_met_is_a_failure(self):
        self.fails(1, "mesh.obj: ", "fit", self.mesh(), "-o", self.path("body.shcd"),
                   "--tolerance", "1e-6", "--degree-max", "2")

    def test_bad_meshes(self):
        vertices, faces = ellipsoid_mesh(level=1)
        text = obj(vertices, faces)
        two = obj(vertices + [[x + 1.0 for x in v] for v in vertices],
                  faces + [tuple(i + len(vertices) for i in f) for f in faces])
        for name, content in (
                ("empty.obj", ""),
                ("open.obj", obj(vertices, faces[1:])),
                ("nan.obj", text.replace("v 0.05 0 0", "v nan 0 0")),
                ("huge.obj", text.replace("v 0.05 0 0", "v 1e999 0 0")),
                ("index.obj", text + "f 1 2 1000\n"),
                ("two.obj", two),
                ("mesh.xyz", text),
                ("cut.stl", b"\0" * 80 + b"\x10\0\0\0" + b"\0" * 17)):
            mesh = self.write(name, content)
            self.fails(1, name, "fit", mesh, "-o", self.path("body.shcd"), "--json",
                       self.path("report.json"))
        self.fails(1, "none.obj", "fit", self.path("none.obj"), "-o", self.path("body.shcd"))
        self.fails(1, "shcd fit", "fit", self.folder, "-o", self.path("body.shcd"))

    def test_outputs_that_cannot_be(self):
        mesh, body = self.mesh(), self.path("body.shcd")
        self.fails(1, "overwrite the input", "fit", mesh, "-o", mesh)
        os.symlink(mesh, self.path("link"))
        self.fails(1, "overwrite the input", "fit", mesh, "-o", self.path("link"))
        self.fails(1, "overwrite the input", "fit", mesh, "-o", body, "--json", mesh)
        self.fails(1, "cannot be one file", "fit", mesh, "-o", body, "--json", body)
        self.fails(1, "cannot write to the folder", "fit", mesh, "-o", self.path("none/b.shcd"))
        self.fails(1, "not a regular file", "fit", mesh, "-o", "/dev/null")
        self.fails(1, "cannot write to the folder", "fit", mesh, "-o", body, "--json",
                   self.path("none/r.json"))
        self.assertEqual(self.read("mesh.obj"), obj(*ellipsoid_mesh()))

    def test_a_report_that_cannot_be_printed_is_a_failure(self):
        mesh, body = self.mesh(), self.path("body.shcd")
        with open("/dev/full", "w") as full:
            result = subprocess.run([SHCD, "fit", mesh, "-o", body, "-d", "3"], stdout=full,
                                    stderr=subprocess.PIPE, text=True)
        self.assertEqual(result.returncode, 1)
        self.assertEqual(result.stderr.count("\n"), 1)
        self.assertEqual(os.listdir(self.folder), ["mesh.obj"])

    def test_bad_usage(self):
        mesh, body = self.mesh(), self.path("body.shcd")
        self.fails(2, "MESH is missing", "fit")
        self.fails(2, "-o BODY.shcd is missing", "fit", mesh)
        self.fails(2, "exclude each other", "fit", mesh, "-o", body, "--degree", "3",
                   "--tolerance", "1mm")
        self.fails(2, "--degree-max needs --tolerance", "fit", mesh, "-o", body, "--degree-max",
                   "9")
        self.fails(2, "--degree 0: must be 1 to 150", "fit", mesh, "-o", body, "--degree", "0")
        self.fails(2, "--degree-max 151", "fit", mesh, "-o", body, "--degree-max", "151")
        self.fails(2, "--unit furlong", "fit", mesh, "-o", body, "--unit", "furlong")
        self.fails(2, "--area-weight -1", "fit", mesh, "-o", body, "--area-weight", "-1")

    def test_progress_on_a_terminal_ends_with_an_empty_line(self):
        leader, follower = pty.openpty()
        process = subprocess.Popen([SHCD, "fit", self.mesh(), "-o", self.path("body.shcd"), "-d",
                                    "3"], stdout=subprocess.DEVNULL, stderr=follower)
        os.close(follower)
        shown = b""
        try:
            while True:
                piece = os.read(leader, 4096)
                if not piece:
                    break
                shown += piece
        except OSError:  # Linux: the other end has been closed
            pass
        os.close(leader)
        self.assertEqual(process.wait(timeout=60), 0)
        self.assertIn(b"%", shown)
        self.assertNotIn(b"\n", shown)
        self.assertTrue(shown.endswith(b" \r"))


if __name__ == "__main__":
    unittest.main()
