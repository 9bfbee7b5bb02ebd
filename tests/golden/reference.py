# SPDX-License-Identifier: BSD-3-Clause
"""Computes one row of a golden table with 60 digits, apart from the library and by other formulas.

    python3 reference.py harmonics 'Y 15 -7 | 0.3 -0.5 0.8'
    python3 reference.py closest 'ellipsoid 0.06 0.04 0.03 | 0.01 0.02 0.03'
    python3 reference.py closest 'lump 15 7 | 0.01 0.02 0.03'
    python3 reference.py contact 'sphere 0.05 stiffness 300 | radius 0.003 at 0.05 0 0'

Prints the row with expected value, tolerance and source filled in. Needs mpmath (Debian:
python3-mpmath); the tests do not run it. Inputs count as the doubles nearest to them.

harmonics  The Legendre polynomial as its explicit sum, P_l(z) = 2^-l sum_k (-1)^k C(l,k) C(2l-2k,l)
           z^(l-2k), differentiated term by term; cos(m phi) sin^m(theta) as the real part of
           (x + iy)^m. Derivatives by central differences of step 1e-40 with 200 digits of
           f(x/|x|): its Euclidean gradient is the tangential one, the tangential part of its
           Euclidean Hessian the covariant one.
closest    Ellipsoids: the largest root t of sum (a_i p_i/(t + a_i^2))^2 = 1, foot a_i^2 p_i/(t +
           a_i^2); in a plane of symmetry also the feet off the plane. Lumps: all points of a
           spherical grid, the six best and well separated ones polished by Newton's method; the
           sign by the solid angles of the grid's triangles.
contact    F = k depth max(0, 1 + 1.5 ratio/v_ref clamp(u, -10 v_ref, 10 v_ref)) along the normal at
           the closest point, u = -v.n, summed over the bodies that the tool overlaps.
"""
import math
import re
import sys

from mpmath import mp, mpf

mp.dps = 60


def floats(text):
    return [float(word) for word in text.split()]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def norm(a):
    return mp.sqrt(dot(a, a))


def show(x):
    return mp.nstr(x, 20)


# ---- harmonics ----

def legendre_terms(l, m):
    """Exponent and integer coefficient of 2^l d^m/dz^m P_l."""
    terms = []
    for k in range((l - m) // 2 + 1):
        power = l - 2 * k
        factor = (-1) ** k * math.comb(l, k) * math.comb(2 * l - 2 * k, l)
        terms.append((power - m, factor * math.factorial(power) // math.factorial(power - m)))
    return terms


def harmonic(l, m):
    """Y_lm as a function of any direction."""
    order = abs(m)
    terms = legendre_terms(l, order)
    size = mp.sqrt((2 * l + 1) / (4 * mp.pi) * mpf(math.factorial(l - order))
                   / math.factorial(l + order) * (2 if order > 0 else 1)) / mpf(2) ** l

    def value(v):
        n = norm(v)
        x, y, z = (c / n for c in v)
        wave = mp.mpc(x, y) ** order
        return size * sum(c * z ** e for e, c in terms) * (wave.real if m >= 0 else wave.imag)
    return value


def harmonics_row(fields):
    quantity, l, m = fields[0].split()
    l, m = int(l), int(m)
    mp.dps = 200
    w = [mpf(c) for c in floats(fields[1])]
    w = [c / norm(w) for c in w]
    f, h = harmonic(l, m), mpf(10) ** -40

    def at(*steps):
        return f([c + sum(s for axis, s in steps if axis == i) for i, c in enumerate(w)])

    def first(i):
        return (at((i, h)) - at((i, -h))) / (2 * h)

    def second(i, k):
        return (at((i, h), (k, h)) - at((i, h), (k, -h)) - at((i, -h), (k, h))
                + at((i, -h), (k, -h))) / (4 * h * h)
    axes = ["xyz".index(c) for c in quantity[1:]]
    if quantity == "Y":
        expected, unit = f(w), "K"
    elif quantity[0] == "G":
        expected, unit = first(axes[0]), "K*l"
    else:
        project = [[(i == k) - w[i] * w[k] for k in range(3)] for i in range(3)]
        full = [[second(i, k) for k in range(3)] for i in range(3)]
        expected = sum(project[axes[0]][i] * full[i][k] * project[k][axes[1]]
                       for i in range(3) for k in range(3))
        unit = "K*l*l"
    if abs(expected) < mpf(10) ** -60:
        expected = mpf(0)
    return f"{show(expected)} | 1e-13 {unit} | explicit sum"


# ---- closest points ----

def ellipsoid_feet(axes, p):
    """Candidates for the closest point; the closest is among them."""
    a2 = [mpf(a) ** 2 for a in axes]

    def excess(t):
        return sum(a * (c / (t + a)) ** 2 for a, c in zip(a2, p)) - 1
    low = -min(a for a, c in zip(a2, p) if c != 0) if any(p) else None
    feet = []
    if low is not None:
        high = max(abs(low), norm(p) * mp.sqrt(max(a2)), *a2) * 4
        low = low * (1 - mpf(10) ** -55)
        for _ in range(400):
            middle = (low + high) / 2
            low, high = (middle, high) if excess(middle) > 0 else (low, middle)
        feet.append([a * c / (low + a) for a, c in zip(a2, p)])
    for i in range(3):  # t = -a_i^2 where p_i = 0: feet on both sides of that plane
        if p[i] == 0 and all(a2[k] != a2[i] or p[k] == 0 for k in range(3)):
            foot = [mpf(0) if a2[k] == a2[i] else a2[k] * p[k] / (a2[k] - a2[i]) for k in range(3)]
            left = 1 - sum(foot[k] ** 2 / a2[k] for k in range(3))
            if left >= 0:
                foot[i] = mp.sqrt(a2[i] * left)
                feet.append(foot)
    return feet


def ellipsoid_closest(axes, p):
    """Signed distance, foot, outward normal."""
    foot = min(ellipsoid_feet(axes, p), key=lambda x: norm([a - b for a, b in zip(x, p)]))
    normal = [c / mpf(a) ** 2 for c, a in zip(foot, axes)]
    normal = [c / norm(normal) for c in normal]
    inside = sum((c / mpf(a)) ** 2 for c, a in zip(p, axes)) < 1
    distance = norm([a - b for a, b in zip(foot, p)])
    return (-distance if inside else distance), foot, normal


def lump_coefficients(degree, seed):
    """The recipe of closest.txt, in doubles: the same bits as the test's."""
    c = [[0.0] * 3 for _ in range((degree + 1) ** 2)]
    unit = 2.0466534158929770
    c[3][0], c[1][1], c[2][2] = 0.05 * unit, 0.045 * unit, 0.04 * unit
    for l in range(2, degree + 1):
        size = 0.012 / float(1000 * l * l * l)
        for i in range(l * l, (l + 1) ** 2):
            for k in range(3):
                seed = (seed * 6364136223846793005 + 1442695040888963407) % 2 ** 64
                c[i][k] = size * float((seed >> 33) % 2001 - 1000)
    return c


class Lump:
    def __init__(self, degree, seed):
        self.degree = degree
        self.coefficients = lump_coefficients(degree, seed)
        # polynomials in (x, y, z) by order: x^.. are taken from (x + iy)^m and powers of z
        self.parts = []
        for m in range(degree + 1):
            poly = [[[mpf(0)] * (degree + 1) for _ in range(3)] for _ in range(2)]
            for l in range(max(m, 0), degree + 1):
                size = mp.sqrt((2 * l + 1) / (4 * mp.pi) * mpf(math.factorial(l - m))
                               / math.factorial(l + m) * (2 if m > 0 else 1)) / mpf(2) ** l
                for power, factor in legendre_terms(l, m):
                    for k in range(3):
                        poly[0][k][power] += size * factor * self.coefficients[l * l + l + m][k]
                        if m > 0:
                            poly[1][k][power] += size * factor * self.coefficients[l * l + l - m][k]
            self.parts.append(poly)
        self.fast = [[[[float(c) for c in row] for row in side] for side in poly]
                     for poly in self.parts]

    def point(self, w, parts=None):
        parts = self.parts if parts is None else parts
        x, y, z = w
        c, s, out = 1, 0, [0, 0, 0]
        for poly in parts:
            for k in range(3):
                a = b = 0
                for i in range(self.degree, -1, -1):
                    a, b = a * z + poly[0][k][i], b * z + poly[1][k][i]
                out[k] += a * c + b * s
            c, s = x * c - y * s, x * s + y * c
        return out

    def grid(self, n=120):
        rows = []
        for j in range(n + 1):
            t = math.pi * j / n
            row = []
            for i in range(2 * n):
                f = math.pi * i / n
                w = (math.sin(t) * math.cos(f), math.sin(t) * math.sin(f), math.cos(t))
                row.append((w, self.point(w, self.fast)))
            rows.append(row)
        return rows

    def polish(self, w, p):
        """Newton in the chart (w + u t1 + v t2)/|..|, derivatives by differences of 1e-15."""
        h = mpf(10) ** -15
        for _ in range(12):
            w = [c / norm(w) for c in w]
            t1 = [w[1], -w[0], 0] if abs(w[2]) < 0.9 else [0, w[2], -w[1]]
            t1 = [c / norm(t1) for c in t1]
            t2 = [w[1] * t1[2] - w[2] * t1[1], w[2] * t1[0] - w[0] * t1[2],
                  w[0] * t1[1] - w[1] * t1[0]]

            def f(u, v):
                d = [a + u * b + v * c for a, b, c in zip(w, t1, t2)]
                d = [c / norm(d) for c in d]
                return sum((a - b) ** 2 for a, b in zip(self.point(d), p)) / 2
            g = [(f(h, 0) - f(-h, 0)) / (2 * h), (f(0, h) - f(0, -h)) / (2 * h)]
            a, d = ((f(h, 0) - 2 * f(0, 0) + f(-h, 0)) / h ** 2,
                    (f(0, h) - 2 * f(0, 0) + f(0, -h)) / h ** 2)
            b = (f(h, h) - f(h, -h) - f(-h, h) + f(-h, -h)) / (4 * h * h)
            det = a * d - b * b
            if a <= 0 or det <= 0:  # not near a minimum: downhill
                step = [-g[0] / (abs(a) + abs(d)), -g[1] / (abs(a) + abs(d))]
            else:
                step = [-(d * g[0] - b * g[1]) / det, -(a * g[1] - b * g[0]) / det]
            size = mp.sqrt(step[0] ** 2 + step[1] ** 2)
            scale = min(1, mpf("0.1") / size) if size > 0 else 1
            w = [x + scale * (step[0] * y + step[1] * z) for x, y, z in zip(w, t1, t2)]
            if size < mpf(10) ** -22:
                break
        w = [c / norm(w) for c in w]
        return norm([a - b for a, b in zip(self.point(w), p)])


def turns(rows, p):
    """Winding number of the grid's triangles."""
    total, n = 0.0, len(rows[0])

    def angle(*corners):
        a, b, c = ([x - y for x, y in zip(q, p)] for q in corners)
        la, lb, lc = (math.sqrt(dot(q, q)) for q in (a, b, c))
        volume = dot(a, (b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2],
                         b[0] * c[1] - b[1] * c[0]))
        return 2 * math.atan2(volume, la * lb * lc + dot(a, b) * lc + dot(b, c) * la
                              + dot(c, a) * lb)
    for upper, lower in zip(rows, rows[1:]):
        for i in range(n):
            a, b, c, d = upper[i][1], lower[i][1], lower[(i + 1) % n][1], upper[(i + 1) % n][1]
            total += angle(a, b, c) + angle(a, c, d)
    return round(total / (4 * math.pi))


def lump_distance(lump, rows, p):
    near = sorted((math.dist(x, p), w) for row in rows for w, x in row)
    starts = []
    for _, w in near:
        if all(math.dist(w, other) > 0.15 for other in starts):
            starts.append(w)
        if len(starts) == 6:
            break
    exact = [mpf(c) for c in p]
    best = min(lump.polish([mpf(c) for c in w], exact) for w in starts)
    return -best if turns(rows, p) else best


cache = {}


def closest_row(fields):
    kind, *numbers = fields[0].split()
    p = floats(fields[1])
    if kind == "lump":
        key = tuple(int(word) for word in numbers)
        if key not in cache:
            lump = Lump(*key)
            cache[key] = (lump, lump.grid())
        distance = lump_distance(*cache[key], p)
        return f"{show(distance)} | 2e-10 m | grid and Newton, 60 digits"
    axes = floats(" ".join(numbers)) * (3 if kind == "sphere" else 1)
    if kind == "sphere":
        return f"{show(norm([mpf(c) for c in p]) - axes[0])} | 2e-10 m | |p| - r"
    distance = ellipsoid_closest(axes, [mpf(c) for c in p])[0]
    size = 2e-9 * max(norm([mpf(a) for a in axes]), abs(distance))
    return f"{show(distance)} | {mp.nstr(size, 1)} m | secular equation"


# ---- contact forces ----

def clause(text, word, count, default):
    found = re.search(rf"\b{word}((?: +[-+.\deE]+){{{count}}})", text)
    return [mpf(c) for c in floats(found.group(1))] if found else [mpf(c) for c in default]


def rotate(q, v):
    n = mp.sqrt(dot(q, q))
    w, *u = (c / n for c in q)

    def cross(a, b):
        return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    t = [2 * c for c in cross(u, v)]
    return [a + w * b + c for a, b, c in zip(v, t, cross(u, t))]


def contact_force(body, centre, velocity, radius):
    kind, *rest = body.split()
    axes = floats(" ".join(rest[:1])) * 3 if kind == "sphere" else floats(" ".join(rest[:3]))
    q = clause(body, "turned", 4, [1, 0, 0, 0])
    back = [q[0], -q[1], -q[2], -q[3]]
    local = rotate(back, [a - b for a, b in zip(centre, clause(body, "at", 3, [0, 0, 0]))])
    distance, _, normal = ellipsoid_closest(axes, local)
    depth = radius - distance
    if depth <= 0:
        return [mpf(0)] * 3
    normal = rotate(q, normal)
    ratio, v_ref = clause(body, "damping", 2, [0, 1])
    rate = max(-10 * v_ref, min(10 * v_ref, -dot(velocity, normal)))
    force = clause(body, "stiffness", 1, [0])[0] * depth
    force *= max(mpf(0), 1 + mpf(3) / 2 * ratio / v_ref * rate)
    return [force * c for c in normal]


def contact_row(fields):
    tool = fields[1]
    centre, velocity = clause(tool, "at", 3, [0, 0, 0]), clause(tool, "moving", 3, [0, 0, 0])
    radius = clause(tool, "radius", 1, [0])[0]
    forces = [contact_force(body.strip(), centre, velocity, radius)
              for body in fields[0].split(";")]
    total = [sum(f[k] for f in forces) for k in range(3)]
    return f"{' '.join(show(c) for c in total)} | 1e-6 N | F = k depth (1 + ...) n"


def main():
    rows = {"harmonics": harmonics_row, "closest": closest_row, "contact": contact_row}
    if len(sys.argv) < 3 or sys.argv[1] not in rows:
        sys.exit(__doc__)
    for text in sys.argv[2:]:
        mp.dps = 60
        print(f"{text.strip()} | {rows[sys.argv[1]]([f.strip() for f in text.split('|')])}")


main()
