# SPDX-License-Identifier: BSD-3-Clause
"""Writes the meshes of this folder that exist in every format, and the binary ones.

usage: make_meshes.py FOLDER

One shape for each reason to refuse a surface, in six formats: NAME.obj, NAME.off, NAME.text.ply,
NAME.binary.ply, NAME.text.stl, NAME.binary.stl. What is wrong with the bytes of one format only is
a text file of its own here, or stands at the end. expected.txt says what `shcd fit` makes of each.
"""
import itertools
import os
import struct
import sys

TETRA = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
FACES = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)]


def moved(vertices, by):
    return [tuple(x + d for x, d in zip(v, by)) for v in vertices]


def shifted(faces, by):
    return [tuple(i + by for i in face) for face in faces]


def icosahedron():
    g = 1.618034
    vertices = [v for a in (-1, 1) for b in (-g, g) for v in ((0, a, b), (a, b, 0), (b, 0, a))]
    near = {frozenset(p) for p in itertools.combinations(range(12), 2)
            if sum((vertices[p[0]][k] - vertices[p[1]][k]) ** 2 for k in range(3)) < 4.1}
    faces = []
    for a, b, c in itertools.combinations(range(12), 3):
        if {frozenset((a, b)), frozenset((b, c)), frozenset((a, c))} <= near:
            p, q, r = (vertices[i] for i in (a, b, c))
            det = (p[0] * (q[1] * r[2] - q[2] * r[1]) + p[1] * (q[2] * r[0] - q[0] * r[2]) +
                   p[2] * (q[0] * r[1] - q[1] * r[0]))
            faces.append((a, b, c) if det > 0 else (a, c, b))
    return vertices, faces


def torus():
    """Three by three quadrilaterals: nine vertices, eighteen triangles."""
    around = ((1.0, 0.0), (-0.5, 0.75), (-0.5, -0.75))
    vertices = [(c * (3 + u), s * (3 + u), v) for c, s in around for u, v in around]
    faces = []
    for i, j in itertools.product(range(3), repeat=2):
        a, b = 3 * i + j, 3 * ((i + 1) % 3) + j
        c, d = 3 * i + (j + 1) % 3, 3 * ((i + 1) % 3) + (j + 1) % 3
        faces += [(a, b, d), (a, d, c)]
    return vertices, faces


def pinched():
    """An icosahedron whose opposite vertices have been brought together."""
    vertices, faces = icosahedron()
    opposite = vertices.index(tuple(-x for x in vertices[0]))
    vertices[opposite] = vertices[0]
    return vertices, faces


# the six vertices of the projective plane, each pair of which is an edge of two triangles
PROJECTIVE = [(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 5), (0, 5, 1), (1, 2, 4), (2, 3, 5),
              (3, 4, 1), (4, 5, 2), (5, 1, 3)]

NAN, INFINITY = float("nan"), float("inf")
SHAPES = {
    "good": (TETRA, FACES),
    "turned": (TETRA, [FACES[0][::-1]] + FACES[1:]),
    "inside_out": (TETRA, [face[::-1] for face in FACES]),
    "degenerate": (TETRA, FACES + [(1, 1, 2)]),
    "only_degenerate": (TETRA, [(0, 0, 1), (2, 3, 3)]),
    "empty": ([], []),
    "open": (TETRA, FACES[:3]),
    "crowded_edge": (TETRA + [(0, -1, 0), (0, 0, -1)], FACES + [(0, 1, 4), (0, 5, 1), (1, 5, 4),
                                                              (0, 4, 5)]),
    "two": (TETRA + moved(TETRA, (3, 0, 0)), FACES + shifted(FACES, 4)),
    "one_sided": (TETRA + [(1, 1, 0.25), (0.25, 1, 1)], PROJECTIVE),
    "pinched": pinched(),
    "torus": torus(),
    "flat": (TETRA[:3], [(0, 1, 2), (0, 2, 1)]),
    "nan": ([(NAN, 0, 0)] + TETRA[1:], FACES),
    "infinite": (TETRA[:3] + [(0, 0, -INFINITY)], FACES),
    "far": (moved(TETRA, (30000, 0, 0)), FACES),
}
INDEXED = {
    "index_too_large": (TETRA, FACES[:3] + [(0, 3, 4)]),
}


def number(x):
    return "%.9g" % x


def point(v):
    return " ".join(number(x) for x in v)


def write_obj(vertices, faces):
    return ("".join("v %s\n" % point(v) for v in vertices) +
            "".join("f %d %d %d\n" % tuple(i + 1 for i in f) for f in faces)).encode() or b"#\n"


def write_off(vertices, faces):
    return ("OFF\n%d %d 0\n" % (len(vertices), len(faces)) +
            "".join(point(v) + "\n" for v in vertices) +
            "".join("3 %d %d %d\n" % f for f in faces)).encode()


def ply_header(form, n_vertices, n_faces, index="int", more=""):
    return ("ply\nformat %s 1.0\nelement vertex %d\nproperty float x\nproperty float y\n"
            "property float z\nelement face %d\nproperty list uchar %s vertex_indices\n%s"
            "end_header\n" % (form, n_vertices, n_faces, index, more)).encode()


def write_text_ply(vertices, faces):
    return (ply_header("ascii", len(vertices), len(faces)) +
            ("".join(point(v) + "\n" for v in vertices) +
             "".join("3 %d %d %d\n" % f for f in faces)).encode())


def write_binary_ply(vertices, faces, order="<"):
    form = "binary_little_endian" if order == "<" else "binary_big_endian"
    return (ply_header(form, len(vertices), len(faces)) +
            b"".join(struct.pack(order + "3f", *v) for v in vertices) +
            b"".join(struct.pack(order + "B3i", 3, *f) for f in faces))


def write_text_stl(vertices, faces):
    def facet(f):
        return ("facet normal 0 0 0\n outer loop\n" +
                "".join("  vertex %s\n" % point(vertices[i]) for i in f) + " endloop\nendfacet\n")
    return ("solid s\n" + "".join(map(facet, faces)) + "endsolid s\n").encode()


def write_binary_stl(vertices, faces):
    return (b"binary".ljust(80) + struct.pack("<I", len(faces)) +
            b"".join(struct.pack("<12fH", 0, 0, 0, *vertices[f[0]], *vertices[f[1]],
                                 *vertices[f[2]], 0) for f in faces))


WRITERS = {"obj": write_obj, "off": write_off, "text.ply": write_text_ply,
           "binary.ply": write_binary_ply, "text.stl": write_text_stl,
           "binary.stl": write_binary_stl}


def binary_files():
    """What cannot be typed."""
    ply, stl = write_binary_ply(TETRA, FACES), write_binary_stl(TETRA, FACES)
    little, zeros = "binary_little_endian", b"\0" * 20
    yield "good_big.binary.ply", write_binary_ply(TETRA, FACES, ">")
    yield "cut.binary.ply", ply[:-5]
    yield "cut_vertices.binary.ply", ply[:-60]
    yield "cut.binary.stl", stl[:-1]
    yield "cut_header.binary.stl", stl[:83]
    yield "longer.binary.stl", stl + b"\0"
    yield "two_corners.binary.ply", ply[:-13] + b"\2" + ply[-12:]
    yield "no_corners.binary.ply", ply[:-13] + b"\0" + ply[-12:]
    yield "index_negative.binary.ply", ply[:-4] + b"\xff\xff\xff\xff"
    yield "many_vertices.binary.ply", ply_header(little, 4000000000, 4) + zeros
    yield "many_faces.binary.ply", ply_header(little, 4, 4000000000) + zeros
    yield "many_facets.binary.stl", stl[:80] + b"\xff\xff\xff\xff" + stl[84:]
    yield "many_corners.binary.ply", (
        ply_header(little, 4, 1).replace(b"uchar", b"uint") + b"\0" * 48 + b"\xff\xff\xff\x7f" +
        zeros)
    yield "many_materials.binary.ply", (
        ply_header(little, 4, 4, more="element material 1500\nproperty uchar a\n") +
        ply.split(b"end_header\n")[1] + b"\1" * 1500)
    yield "many_corners.obj", (write_obj(TETRA, FACES) + b"f" + b" 1 2 3" * 334 + b"\n")
    yield "bytes.obj", bytes(range(256))
    yield "bytes.off", b"OFF\n" + bytes(range(256))
    yield "bytes.text.ply", b"ply\nformat ascii 1.0\n" + bytes(range(256))
    yield "bytes.text.stl", b"solid " + bytes(range(127, 256)) + b"\n\0\xff\n"
    yield "nothing.obj", b""
    yield "nothing.off", b""
    yield "nothing.ply", b""
    yield "nothing.stl", b""
    yield "carriage_return.off", write_off(TETRA, FACES).replace(b"\n", b"\r")
    yield "good_carriage_return.obj", write_obj(TETRA, FACES).replace(b"\n", b"\r\n")


def main(folder):
    for name, shape in SHAPES.items():
        for extension, write in WRITERS.items():
            with open(os.path.join(folder, name + "." + extension), "wb") as file:
                file.write(write(*shape))
    for name, shape in INDEXED.items():
        for extension in ("obj", "off", "text.ply", "binary.ply"):
            with open(os.path.join(folder, name + "." + extension), "wb") as file:
                file.write(WRITERS[extension](*shape))
    for name, content in binary_files():
        with open(os.path.join(folder, name), "wb") as file:
            file.write(content)


if __name__ == "__main__":
    main(sys.argv[1])
