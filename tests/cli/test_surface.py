# SPDX-License-Identifier: BSD-3-Clause
"""surface: closed, outward, on the surface, in both formats."""
import math
import os
import signal
import struct
import subprocess
import time
import unittest

from support import AXES, SHCD, CommandTest, ellipsoid_rows, table


def read_obj(path):
    vertices, triangles = [], []
    with open(path) as file:
        for line in file:
            fields = line.split()
            if fields[0] == "v":
                vertices.append(tuple(float(f) for f in fields[1:]))
            elif fields[0] == "f":
                triangles.append(tuple(int(f) - 1 for f in fields[1:]))
    return vertices, triangles


def read_ply(path):
    with open(path, "rb") as file:
        content = file.read()
    end = content.index(b"end_header\n") + len(b"end_header\n")
    header = content[:end].decode("ascii").splitlines()
    assert header[0] == "ply" and header[1] == "format binary_little_endian 1.0"
    counts = [int(line.split()[2]) for line in header if line.startswith("element")]
    assert len(content) == end + 24 * counts[0] + 13 * counts[1]
    vertices = [struct.unpack_from("<3d", content, end + 24 * i) for i in range(counts[0])]
    start = end + 24 * counts[0]
    faces = [struct.unpack_from("<B3i", content, start + 13 * i) for i in range(counts[1])]
    assert all(face[0] == 3 for face in faces)
    return vertices, [face[1:] for face in faces]


def volume(vertices, triangles):
    total = 0.0
    for a, b, c in triangles:
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = vertices[a], vertices[b], vertices[c]
        total += ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
    return total / 6.0


class Surface(CommandTest):
    def surface(self, body, name, *options):
        self.done("surface", body, "-o", self.path(name), *options)
        return self.path(name)

    def assert_closed(self, vertices, triangles):
        edges = set()
        for t in triangles:
            for k in range(3):
                edge = (t[k], t[(k + 1) % 3])
                self.assertNotIn(edge, edges)
                edges.add(edge)
        for a, b in edges:
            self.assertIn((b, a), edges)
        self.assertEqual({v for t in triangles for v in t}, set(range(len(vertices))))
        self.assertEqual(len(vertices) - len(edges) // 2 + len(triangles), 2)

    def test_ellipsoid_at_each_level_is_closed_outward_and_on_the_surface(self):
        body = self.make_ellipsoid()
        exact = 4.0 / 3.0 * math.pi * AXES[0] * AXES[1] * AXES[2]
        for level in range(5):
            vertices, triangles = read_obj(self.surface(body, "s.obj", "-n", str(level)))
            self.assertEqual(len(vertices), 10 * 4**level + 2)
            self.assertEqual(len(triangles), 20 * 4**level)
            self.assert_closed(vertices, triangles)
            for v in vertices:
                value = sum((x / a) ** 2 for x, a in zip(v, AXES))
                self.assertLessEqual(abs(value - 1.0), 1e-13)
            # inscribed: below the true volume; an icosahedron fills 60.5 % of its sphere, and
            # each level cuts what is missing at least to a third
            inscribed = volume(vertices, triangles)
            self.assertLess(inscribed, exact)
            self.assertGreaterEqual(inscribed, exact * (1.0 - 0.3955 / 3.0**level))

    def test_every_triangle_of_an_ellipsoid_faces_away_from_the_centre(self):
        vertices, triangles = read_obj(self.surface(self.make_ellipsoid(), "s.obj", "-n", "3"))
        for t in triangles:
            self.assertGreater(volume(vertices, [t]), 0.0)

    def test_ply_holds_the_same_mesh(self):
        body = self.make_ellipsoid()
        self.assertEqual(read_ply(self.surface(body, "s.ply", "-n", "2")),
                         read_obj(self.surface(body, "s.obj", "-n", "2")))

    def test_degree_leaves_out_the_rest(self):
        rows = ellipsoid_rows()
        for l in (2, 3):
            for m in range(-l, l + 1):
                rows[l, m] = [2e-4, -1e-4, 1e-4]
        source = self.write("bumpy.csv", table(rows))
        self.done("create", source, "-o", self.path("bumpy.shcd"))
        full = read_obj(self.surface(self.path("bumpy.shcd"), "full.obj", "-n", "2"))
        low = read_obj(self.surface(self.path("bumpy.shcd"), "low.obj", "-n", "2", "-d", "1"))
        plain = read_obj(self.surface(self.make_ellipsoid(), "plain.obj", "-n", "2"))
        self.assertEqual(low[1], plain[1])
        for v, w in zip(low[0], plain[0]):
            self.assertLessEqual(math.dist(v, w), 1e-15)
        self.assertGreater(max(math.dist(v, w) for v, w in zip(full[0], plain[0])), 1e-4)
        self.fails(1, "--degree 4: the body's degree is 3", "surface", self.path("bumpy.shcd"),
                   "-o", self.path("s.obj"), "--degree", "4")

    def test_a_truncated_series_that_is_inside_out_is_turned(self):
        # a point-reflected ellipsoid, outweighed by harmonics of degree 3: the volume is a cubic
        # form, so of these and of their negatives one choice gives a body that is not inside out
        created = []
        for sign in (1.0, -1.0):
            rows = ellipsoid_rows(axes=(-0.001, -0.001, -0.001))
            for m in range(-2, 3):
                rows[2, m] = [0.0, 0.0, 0.0]
            for m in range(-3, 4):
                rows[3, m] = [0.02 * sign * math.sin((m + 4.0) * (k + 1.0)) for k in range(3)]
            body = self.path("reflected%g.shcd" % sign)
            self.write("reflected.csv", table(rows))
            if self.shcd("create", self.path("reflected.csv"), "-o", body).returncode == 0:
                created.append(body)
        self.assertEqual(len(created), 1)
        mesh = read_obj(self.surface(created[0], "low.obj", "-n", "2", "-d", "1"))
        self.assert_closed(*mesh)
        self.assertGreater(volume(*mesh), 0.0)

    def test_failures_leave_no_file(self):
        body = self.make_ellipsoid()
        self.fails(1, "none.shcd", "surface", self.path("none.shcd"), "-o", self.path("s.obj"))
        self.fails(1, "cannot write to the folder", "surface", body, "-o",
                   self.path("none/s.obj"))
        os.mkdir(self.path("folder.obj"))
        self.fails(1, "not a regular file", "surface", body, "-o", self.path("folder.obj"))
        copy = self.path("body.obj")
        os.link(body, copy)
        self.fails(1, "overwrite the input", "surface", body, "-o", copy)

    def test_a_signal_removes_the_file_under_way(self):
        body = self.make_ellipsoid()
        before = sorted(os.listdir(self.folder))
        process = subprocess.Popen([SHCD, "surface", body, "-o", self.path("s.obj"), "-n", "8"])
        while sorted(os.listdir(self.folder)) == before and process.poll() is None:
            time.sleep(0.002)
        process.terminate()
        self.assertEqual(process.wait(timeout=60), -signal.SIGTERM)
        self.assertEqual(sorted(os.listdir(self.folder)), before)

    def test_an_existing_file_is_replaced(self):
        self.write("s.obj", "old")
        vertices, _ = read_obj(self.surface(self.make_ellipsoid(), "s.obj", "-n", "0"))
        self.assertEqual(len(vertices), 12)
        mask = os.umask(0)
        os.umask(mask)
        self.assertEqual(os.stat(self.path("s.obj")).st_mode & 0o777, 0o666 & ~mask)


if __name__ == "__main__":
    unittest.main()
