#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes the project's own meshes, organ.obj and hook.obj, from closed formulas.

    python3 make_organ.py FOLDER

Lengths are metres. The same files come out on every machine: the arithmetic is double precision,
the output has six digits.
"""
import math
import os
import sys


def unit(v):
    n = math.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
    return (v[0] / n, v[1] / n, v[2] / n)


def icosphere(n_halvings):
    """Unit sphere: an icosahedron whose triangles are split into four, n_halvings times."""
    g = (1.0 + math.sqrt(5.0)) / 2.0
    vertices = [unit(v) for v in (
        (-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g),
        (0, -1, -g), (0, 1, -g), (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1))]
    triangles = [
        (0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4),
        (11, 10, 2), (10, 7, 6), (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8),
        (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1)]
    for _ in range(n_halvings):
        middle_of = {}

        def middle(a, b):
            key = (min(a, b), max(a, b))
            if key not in middle_of:
                p, q = vertices[a], vertices[b]
                middle_of[key] = len(vertices)
                vertices.append(unit((p[0] + q[0], p[1] + q[1], p[2] + q[2])))
            return middle_of[key]

        finer = []
        for a, b, c in triangles:
            ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
            finer += [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
        triangles = finer
    return vertices, triangles


# Swellings and dents of the organ: direction, height (share of the radius), sharpness. A term is
# height exp(sharpness (w . direction - 1)), so its half-width is about sqrt(1.4 / sharpness) rad.
RELIEF = (
    ((-0.85, -0.10, -0.45), 0.34, 3.0),   # right lobe, hanging
    ((0.90, -0.20, 0.30), 0.16, 4.0),     # left lobe
    ((0.30, -0.75, -0.60), -0.38, 16.0),  # notch between the lobes, in the front lower edge
    ((0.05, 0.35, -0.95), -0.34, 7.0),    # hollow of the lower side
    ((-0.20, 0.70, -0.70), 0.20, 16.0),   # small lobe behind the hollow
)


def organ_point(w):
    """The sphere, blown up radially, scaled to a wedge and arched.

    Each step maps space one to one: radially by a positive factor, y and z by factors that are
    positive functions of x, z by a shift that depends on x. So the surface cannot cross itself.
    """
    radius = 1.0
    for direction, height, sharpness in RELIEF:
        d = unit(direction)
        cosine = w[0] * d[0] + w[1] * d[1] + w[2] * d[2]
        radius += height * math.exp(sharpness * (cosine - 1.0))
    x, y, z = radius * w[0], radius * w[1], radius * w[2]
    thickness = 0.5 + 0.5 / (1.0 + math.exp(2.2 * (x - 0.2)))  # thick right (x < 0), thin left
    return (0.086 * x, 0.062 * y * (0.6 + 0.4 * thickness),
            0.057 * z * thickness - 0.010 * x * x + 0.0037)


def organ():
    directions, triangles = icosphere(4)
    return [organ_point(w) for w in directions], triangles


def hook_rings(n_cap, n_body):
    """Centre, outward axis, tube radius of each ring of a tube bent by 240 degrees with round ends.

    The radius has no slope at the ends, where the caps, half spheres, take over.
    """
    bend_radius, sweep = 0.045, 240.0 * math.pi / 180.0
    rings = []
    for i in range(1 - n_cap, n_body + n_cap):
        share = min(max(i / n_body, 0.0), 1.0)
        tube = 0.0165 + 0.0025 * math.cos(math.pi * share)
        beyond = i if i < 0 else max(i - n_body, 0)
        latitude = 0.5 * math.pi * beyond / n_cap
        angle = sweep * share
        along = tube * math.sin(latitude)  # how far the cap carries the ring along the tangent
        centre = (bend_radius * math.cos(angle) - along * math.sin(angle),
                  bend_radius * math.sin(angle) + along * math.cos(angle))
        rings.append((centre, angle, tube * math.cos(latitude)))
    return rings


def hook_end(at_start):
    """Pole of a cap."""
    angle = 0.0 if at_start else 240.0 * math.pi / 180.0
    along = -0.019 if at_start else 0.014
    return (0.045 * math.cos(angle) - along * math.sin(angle),
            0.045 * math.sin(angle) + along * math.cos(angle), 0.0)


def hook():
    n_around, n_cap, n_body = 22, 5, 44
    vertices, triangles = [hook_end(True)], []
    rings = hook_rings(n_cap, n_body)
    for (cx, cy), angle, tube in rings:
        for k in range(n_around):
            turn = 2.0 * math.pi * k / n_around
            out, up = tube * math.cos(turn), tube * math.sin(turn)
            vertices.append((cx + out * math.cos(angle), cy + out * math.sin(angle), up))
    last = len(vertices)
    vertices.append(hook_end(False))
    for k in range(n_around):
        a, b = 1 + k, 1 + (k + 1) % n_around
        triangles.append((0, a, b))
        for r in range(len(rings) - 1):
            p, q = r * n_around, (r + 1) * n_around
            triangles += [(a + p, b + q, b + p), (a + p, a + q, b + q)]
        shift = (len(rings) - 1) * n_around
        triangles.append((last, b + shift, a + shift))
    return vertices, triangles


def write_obj(path, title, mesh):
    vertices, triangles = mesh
    with open(path, "w", encoding="ascii", newline="\n") as out:
        out.write("# SPDX-License-Identifier: BSD-3-Clause\n")
        out.write("# %s, in metres; written by make_organ.py.\n" % title)
        for v in vertices:
            # adding zero turns -0 into 0
            out.write("v %.6g %.6g %.6g\n" % tuple(round(c, 12) + 0.0 for c in v))
        for t in triangles:
            out.write("f %d %d %d\n" % tuple(i + 1 for i in t))


def main():
    if len(sys.argv) != 2:
        sys.stderr.write("usage: make_organ.py FOLDER\n")
        return 2
    write_obj(os.path.join(sys.argv[1], "organ.obj"), "Organ-like body", organ())
    write_obj(os.path.join(sys.argv[1], "hook.obj"), "Hook, not star-shaped", hook())
    return 0


if __name__ == "__main__":
    sys.exit(main())
