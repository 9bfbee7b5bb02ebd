#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes what a body looks like now as PLY files, from shcdd's messages.

Each deform_state message holds the coefficients of the surface S(w) = sum_i c_i Y_i(w), real
orthonormal spherical harmonics without the Condon-Shortley phase, i = l*l + l + m. This program
evaluates them on a subdivided icosahedron, in the world frame, with the displacement against the
rest shape as a vertex property for viewers that colour by it. The rest shape is that of the first
message whose volume is the rest volume, and this program waits for one: start it before the body is
touched. With --first the first message counts instead. Plain Python, to be copied.
"""
import argparse
import math
import pathlib
import select
import struct
import sys
import time

import lcm
from shcdmsg import deform_state_t


def icosphere(n_subdivisions):
    """Unit vectors, and triangles counter-clockwise from outside."""
    g = (1.0 + math.sqrt(5.0)) / 2.0
    points = [(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g), (0, -1, -g),
              (0, 1, -g), (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1)]
    points = [unit(p) for p in points]
    triangles = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4),
                 (11, 10, 2), (10, 7, 6), (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8),
                 (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1)]
    for _ in range(n_subdivisions):
        middle = {}

        def between(i, j):
            key = (min(i, j), max(i, j))
            if key not in middle:
                middle[key] = len(points)
                points.append(unit([a + b for a, b in zip(points[i], points[j])]))
            return middle[key]

        triangles = [t for a, b, c in triangles
                     for ab, bc, ca in [(between(a, b), between(b, c), between(c, a))]
                     for t in ((a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca))]
    return points, triangles


def unit(v):
    n = math.sqrt(math.fsum(x * x for x in v))
    return tuple(x / n for x in v)


def harmonics(degree, w):
    """All Y_lm(w) up to a degree, in the order of the messages.

    Y_lm = Q_lm(z) times the real or imaginary part of (x + i y)^m: no angle, no pole.
    """
    x, y, z = w
    values = [0.0] * (degree + 1) ** 2
    c, s = 1.0, 0.0  # of (x + i y)^m
    q_mm = math.sqrt(1.0 / (4.0 * math.pi))
    for m in range(degree + 1):
        if m > 0:
            c, s = x * c - y * s, x * s + y * c
            q_mm *= math.sqrt(3.0) if m == 1 else math.sqrt((2 * m + 1) / (2 * m))
        before, q = 0.0, q_mm
        for l in range(m, degree + 1):
            if l > m:
                a = math.sqrt((4 * l * l - 1) / (l * l - m * m))
                b = math.sqrt(((l - 1) ** 2 - m * m) / (4 * (l - 1) ** 2 - 1)) if l > m + 1 else 0.0
                before, q = q, a * (z * q - b * before)
            values[l * l + l + m] = q * c
            if m > 0:
                values[l * l + l - m] = q * s
    return values


def rotate(q, v):
    """v turned by the unit quaternion q = (w, x, y, z)."""
    w, u = q[0], q[1:]

    def cross(a, b):
        return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])

    t = [2.0 * x for x in cross(u, v)]
    return tuple(a + w * b + c for a, b, c in zip(v, t, cross(u, t)))


def surface(message, basis):
    """Vertices of the body's surface in the world frame [m]."""
    vertices = []
    for y in basis:
        s = [math.fsum(message.coeff[3 * i + k] * y_i for i, y_i in enumerate(y))
             for k in range(3)]
        vertices.append(tuple(a + b for a, b in zip(rotate(message.quat, s), message.pos)))
    return vertices


def write_ply(path, vertices, triangles, displacements_m):
    """Binary little-endian PLY, under a temporary name until it is whole."""
    head = (f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\n"
            "property float x\nproperty float y\nproperty float z\n"
            "property float displacement_m\n"
            f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n")
    part = path.with_suffix(".part")
    with open(part, "wb") as file:
        file.write(head.encode())
        for vertex, d in zip(vertices, displacements_m):
            file.write(struct.pack("<4f", *vertex, d))
        for triangle in triangles:
            file.write(struct.pack("<B3i", 3, *triangle))
    part.replace(path)


def is_rest(message):
    """A dent of a hundredth of a millimetre over a square centimetre is 1e-9 m^3."""
    return abs(message.volume - message.rest_volume) <= 1e-6 * abs(message.rest_volume)


def read_options():
    p = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    p.add_argument("--body", type=int, default=0, help="index of the body in the scene")
    p.add_argument("--out", type=pathlib.Path, default=pathlib.Path("body.ply"), metavar="FILE.ply",
                   help="file to write; with --count above 1 a number goes before the ending")
    p.add_argument("--count", type=int, default=1, help="how many shapes to write")
    p.add_argument("--every", type=float, default=0.1, metavar="S", help="time between them")
    p.add_argument("--subdivide", type=int, default=4, choices=range(0, 8),
                   help="10 4^N + 2 vertices")
    p.add_argument("--first", action="store_true",
                   help="measure displacements against the first message, rest shape or not")
    p.add_argument("--wait", type=float, default=10.0, metavar="S",
                   help="how long to wait for a message")
    return p.parse_args()


def main():
    options = read_options()
    points, triangles = icosphere(options.subdivide)
    latest = {}
    link = lcm.LCM()

    def on_deform(_, data):
        message = deform_state_t.decode(data)
        if message.body_id == options.body:
            latest["message"] = message

    def wait(due, what, is_wanted):
        """The first such message, at `due` or later."""
        latest.clear()
        give_up = max(due, time.monotonic()) + options.wait
        while True:
            # the newest: what has queued up while a shape was written is old
            while select.select([link.fileno()], [], [], 0)[0]:
                link.handle()
            message = latest.get("message")
            if message is not None and time.monotonic() >= due and is_wanted(message):
                return message
            if time.monotonic() > give_up:
                sys.exit(f"deform_ply: {what} of body {options.body} in {options.wait:g} s: " + (
                    "does shcdd run here, with that body in its scene?" if message is None else
                    "something presses it; --first takes the first shape as it is"))
            select.select([link.fileno()], [], [], 0.02)

    subscription = link.subscribe("SHCD_DEFORM", on_deform)
    due = time.monotonic()
    rest = wait(due, "no rest shape", (lambda _: True) if options.first else is_rest)
    basis = [harmonics(rest.degree, w) for w in points]
    reference = surface(rest, basis)
    message = rest
    for n in range(options.count):
        if n > 0:
            message = wait(due, "no shape", lambda _: True)
        due = time.monotonic() + options.every
        vertices = surface(message, basis)
        moved = [math.dist(a, b) for a, b in zip(vertices, reference)]
        path = options.out if options.count == 1 else options.out.with_name(
            f"{options.out.stem}-{n:04d}{options.out.suffix}")
        write_ply(path, vertices, triangles, moved)
        print(f"{path}: tick {message.tick}, degree {message.degree}, moved by at most "
              f"{1e3 * max(moved):.3f} mm, volume {message.volume:.9g} m^3 "
              f"({1e6 * (message.volume - message.rest_volume):+.3f} ml)", flush=True)
    link.unsubscribe(subscription)


if __name__ == "__main__":
    main()
