# SPDX-License-Identifier: BSD-3-Clause
"""What the tests of the command share: running it, checking failures, an exact ellipsoid."""
import math
import os
import shutil
import subprocess
import tempfile
import unittest

SHCD = os.environ["SHCD"]

# Y_1m = N1 (y, z, x): an ellipsoid is exactly a series of degree 1
N1 = math.sqrt(3.0 / (4.0 * math.pi))
AXES = (0.05, 0.04, 0.03)
DIAGONAL = 2.0 * math.sqrt(sum(a * a for a in AXES))


def ellipsoid_rows(axes=AXES, centre=(0.0, 0.0, 0.0)):
    """{(l, m): [x, y, z]} of degree 1."""
    y00 = math.sqrt(1.0 / (4.0 * math.pi))
    return {
        (0, 0): [c / y00 for c in centre],
        (1, -1): [0.0, axes[1] / N1, 0.0],
        (1, 0): [0.0, 0.0, axes[2] / N1],
        (1, 1): [axes[0] / N1, 0.0, 0.0],
    }


def table(rows, header="l,m,x,y,z"):
    lines = [header]
    for (l, m), values in sorted(rows.items()):
        lines.append("%d,%d,%s" % (l, m, ",".join("%.17g" % v for v in values)))
    return "\n".join(lines) + "\n"


class CommandTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp()
        self.addCleanup(shutil.rmtree, self.folder)

    def path(self, name):
        return os.path.join(self.folder, name)

    def write(self, name, content):
        mode = "wb" if isinstance(content, bytes) else "w"
        with open(self.path(name), mode) as file:
            file.write(content)
        return self.path(name)

    def read(self, name):
        with open(self.path(name)) as file:
            return file.read()

    def shcd(self, *arguments, stdin="", **options):
        return subprocess.run([SHCD, *arguments], input=stdin, stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, text=True, timeout=300, **options)

    def done(self, *arguments, **options):
        result = self.shcd(*arguments, **options)
        self.assertEqual(result.returncode, 0, result.stderr)
        return result

    def fails(self, status, pattern, *arguments, stdin=""):
        """One line on stderr that names the subcommand, the given status, no new file."""
        before = sorted(os.listdir(self.folder))
        result = self.shcd(*arguments, stdin=stdin)
        self.assertEqual(result.returncode, status, (arguments, result))
        self.assertEqual(result.stderr.count("\n"), 1, result.stderr)
        self.assertTrue(result.stderr.endswith("\n"), result.stderr)
        self.assertRegex(result.stderr, "^shcd( [a-z]+)?: ")
        self.assertRegex(result.stderr, pattern)
        self.assertEqual(sorted(os.listdir(self.folder)), before)
        return result

    def make_ellipsoid(self, name="ellipsoid.shcd", **options):
        self.write(name + ".csv", table(ellipsoid_rows(**options)))
        self.done("create", self.path(name + ".csv"), "-o", self.path(name))
        return self.path(name)
