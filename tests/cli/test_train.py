# SPDX-License-Identifier: BSD-3-Clause
"""`shcd train`: what it prints and writes, and how it refuses a table's line."""
import json
import math
import os
import random
import shutil
import unittest

from support import AXES, CommandTest

HEADER = "x,y,z,depth_m,force_n"


def rows(n_places=40, depths=(0.001, 0.002, 0.003, 0.004)):
    """Indentations of the ellipsoid with k = 200 (1 + 2 x/0.05) N/m."""
    generator = random.Random(4)
    found = []
    for _ in range(n_places):
        v = [generator.gauss(0.0, 1.0) for _ in range(3)]
        size = math.sqrt(sum(a * a for a in v))
        p = [a * b / size for a, b in zip(AXES, v)]
        k = 200.0 * (1.0 + 0.2 * p[0] / AXES[0])
        found += [p + [d, k * d] for d in depths]
    return found


def text(lines, header=HEADER):
    return "\n".join([header] + [",".join("%.17g" % v for v in line) for line in lines]) + "\n"


class Train(CommandTest):
    def setUp(self):
        super().setUp()
        self.body = self.make_ellipsoid()
        self.out = self.path("out.shcd")

    def train(self, *arguments, **options):
        return self.done("train", self.body, "-o", self.out, *arguments, **options)

    def test_membrane_prints_its_errors_and_stores_them(self):
        printed = self.train("--n-samples", "30", "--json", self.path("r.json")).stdout
        self.assertRegex(printed, r"(?m)^learned response +20 centres, 1 term in the depth, to 7\.071 mm")
        self.assertRegex(printed, r"(?m)^  force error +max \S+, p99 \S+, rms \S+ N of ")
        figures = json.loads(self.read("r.json"))["learned"]
        self.assertEqual(figures["source"], "membrane")
        self.assertEqual(figures["n_samples"], 150)
        self.assertLess(figures["force_error_rms_n"], 0.05 * figures["force_rms_n"])
        self.assertIn(printed, self.done("info", self.out).stdout)
        self.assertEqual(json.loads(self.done("info", self.out, "--json").stdout)["learned"],
                         figures)
        self.assertIsNone(json.loads(self.done("info", self.body, "--json").stdout)["learned"])

    def test_same_seed_gives_the_same_file(self):
        contents = []
        for seed in ("5", "5", "6"):
            self.train("--n-samples", "20", "--seed", seed, "--quiet")
            with open(self.out, "rb") as file:
                contents.append(file.read())
        self.assertEqual(contents[0], contents[1])
        self.assertNotEqual(contents[0], contents[2])

    def test_body_may_be_overwritten(self):
        self.done("train", self.body, "-o", self.body, "--n-samples", "20")
        self.assertIn("13 centres", self.done("info", self.body).stdout)

    def test_table_is_learned(self):
        table = self.write("t.csv", text(rows()))
        printed = self.train("--samples", table).stdout
        self.assertRegex(printed, r"(?m)^  trained on +a table of samples$")
        self.assertEqual(self.train("--samples", "-", stdin=text(rows())).stdout, printed)
        with_energy = [r + [0.5 * r[3] * r[4]] for r in rows()]
        printed = self.train("--samples", "-",
                             stdin=text(with_energy, HEADER + ",energy_j")).stdout
        self.assertRegex(printed, r"table of samples; its forces are \S+ N rms off the slope")

    def test_bad_line_is_named(self):
        good = rows()

        def refused(pattern, content):
            table = self.write("t.csv", content)
            self.fails(1, pattern, "train", self.body, "-o", self.out, "--samples", table)

        refused(r"t\.csv:1: the first line must be x,y,z,depth_m,force_n", text(good, "x,y,z"))
        lines = text(good).splitlines()
        refused(r"t\.csv:3: 4 fields instead of x,y,z,depth_m,force_n$",
                "\n".join(lines[:2] + ["0,0,0.03,0.001"] + lines[2:]))
        refused(r"t\.csv:3: field 4, 'deep', is not a finite number",
                "\n".join(lines[:2] + ["0,0,0.03,deep,1"] + lines[2:]))
        refused(r"t\.csv:3: a depth of -0\.001 m is not positive",
                "\n".join(lines[:2] + ["0,0,0.03,-0.001,1"] + lines[2:]))
        refused(r"t\.csv:3: the point is 0\.97 m from the surface",
                "\n".join(lines[:2] + ["0,0,1,0.001,1"] + lines[2:]))
        refused(r"t\.csv: no samples", HEADER + "\n")
        refused(r"t\.csv: train: samples at 5 different points; at least 8", text(good[:20]))
        refused(r"t\.csv: train: .* does not resist", text([r[:4] + [-1.0] for r in good]))

    def test_bad_usage(self):
        table = self.write("t.csv", text(rows()))
        for pattern, arguments in (
                (r"-o OUT\.shcd is missing", ()),
                (r"--beta -1: must be 0 to 10000", ("-o", self.out, "--beta", "-1")),
                (r"--poisson 0\.5: must be above 0", ("-o", self.out, "--poisson", "0.5")),
                (r"--depth-max 0: is not a positive", ("-o", self.out, "--depth-max", "0")),
                (r"--n-samples 3: must be 8", ("-o", self.out, "--n-samples", "3")),
                (r"--seed 0: must be 1", ("-o", self.out, "--seed", "0")),
                (r"--beta has no meaning with --samples",
                 ("-o", self.out, "--beta", "1", "--samples", table)),
                (r"--plot a\.pdf: the name must end in", ("-o", self.out, "--plot", "a.pdf"))):
            self.fails(2, pattern, "train", self.body, *arguments)
        self.fails(1, "two outputs cannot be one file", "train", self.body, "-o", self.out,
                   "--json", self.out)
        self.fails(1, "would overwrite an input", "train", self.body, "-o", table, "--samples",
                   table)

    @unittest.skipUnless(shutil.which("gnuplot"), "gnuplot is not installed")
    def test_plot_is_a_picture(self):
        self.train("--n-samples", "20", "--plot", self.path("p.svg"))
        picture = self.read("p.svg")
        self.assertIn("<svg", picture)
        self.assertIn("The learned response of", picture)

    def test_plot_without_gnuplot_leaves_nothing(self):
        environment = dict(os.environ, PATH="")
        result = self.shcd("train", self.body, "-o", self.out, "--plot", self.path("p.svg"),
                           env=environment)
        self.assertEqual(result.returncode, 1)
        self.assertIn("needs gnuplot", result.stderr)
        self.assertFalse(os.path.exists(self.out))


if __name__ == "__main__":
    unittest.main()
