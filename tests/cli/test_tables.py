# SPDX-License-Identifier: BSD-3-Clause
"""create, info, coefficients: the way from a table to a body and back."""
import json
import math
import os
import subprocess
import unittest

from support import AXES, DIAGONAL, SHCD, CommandTest, ellipsoid_rows, table

COMPLEX = "l,m,x_re,x_im,y_re,y_im,z_re,z_im"


def parse(text):
    lines = text.splitlines()
    rows = {}
    for line in lines[1:]:
        fields = line.split(",")
        rows[int(fields[0]), int(fields[1])] = [float(f) for f in fields[2:]]
    return lines[0], rows


def bumpy_rows():
    """An ellipsoid off the origin with small harmonics up to l = 4, different in each place."""
    rows = ellipsoid_rows(centre=(0.01, -0.02, 0.03))
    for l in range(2, 5):
        for m in range(-l, l + 1):
            rows[l, m] = [1e-4 * math.sin(7.0 * l + 3.0 * m + k) for k in range(3)]
    return rows


def to_complex(rows):
    """The defining relation, written out independently of the library."""
    result = {}
    for (l, m) in rows:
        c, s = rows[l, abs(m)], rows[l, -abs(m)]
        values = []
        for k in range(3):
            if m == 0:
                a = complex(c[k], 0.0)
            else:
                a = (-1) ** abs(m) * complex(c[k], -s[k]) / math.sqrt(2.0)
                if m < 0:
                    a = (-1) ** abs(m) * a.conjugate()
            values += [a.real, a.imag]
        result[l, m] = values
    return result


class Tables(CommandTest):
    def create(self, text, *options):
        source = self.write("in.csv", text)
        self.done("create", source, "-o", self.path("out.shcd"), *options)
        return self.path("out.shcd")

    def refuse(self, pattern, text):
        source = self.write("in.csv", text)
        self.fails(1, pattern, "create", source, "-o", self.path("out.shcd"))

    def assert_rows_near(self, actual, expected, tolerance):
        self.assertEqual(sorted(actual), sorted(expected))
        for key in expected:
            for a, e in zip(actual[key], expected[key]):
                self.assertLessEqual(abs(a - e), tolerance, key)

    def test_real_table_round_trip_is_exact(self):
        rows = bumpy_rows()
        header, back = parse(self.done("coefficients", self.create(table(rows))).stdout)
        self.assertEqual(header, "l,m,x,y,z")
        self.assertEqual(back, rows)

    def test_complex_table_follows_the_condon_shortley_convention(self):
        rows = bumpy_rows()
        body = self.create(table(rows))
        self.done("coefficients", body, "--complex", "-o", self.path("complex.csv"))
        header, values = parse(self.read("complex.csv"))
        self.assertEqual(header, COMPLEX)
        # one rounding of a product and of a quotient each, of values below 0.15
        self.assert_rows_near(values, to_complex(rows), 4 * 0.15 * 2.0**-53)

    def test_complex_table_round_trip(self):
        rows = bumpy_rows()
        body = self.create(table(to_complex(rows), COMPLEX))
        _, back = parse(self.done("coefficients", body).stdout)
        self.assert_rows_near(back, rows, 4 * 0.15 * 2.0**-53)

    def test_rows_in_any_order_with_comments_blanks_and_windows_line_ends(self):
        lines = table(ellipsoid_rows()).splitlines()
        shuffled = "\ufeff# a comment\r\n\r\n" + lines[0] + "\r\n" + "".join(
            " %s \r\n" % line.replace(",", " ,\t") for line in reversed(lines[1:]))
        _, back = parse(self.done("coefficients", self.create(shuffled)).stdout)
        self.assertEqual(back, ellipsoid_rows())

    def test_table_from_standard_input(self):
        self.done("create", "-", "-o", self.path("out.shcd"), stdin=table(ellipsoid_rows()))
        _, back = parse(self.done("coefficients", self.path("out.shcd")).stdout)
        self.assertEqual(back, ellipsoid_rows())

    def test_unit_scales(self):
        body = self.create(table(ellipsoid_rows(axes=(5.0, 4.0, 3.0))), "--unit", "cm")
        info = json.loads(self.done("info", body, "--json").stdout)
        # rounding only: the factor 0.01 and the products with it
        self.assertLessEqual(abs(info["volume_m3"] / self.volume(body) - 1.0), 1e-12)

    def volume(self, body):
        return json.loads(
            self.done("info", self.make_ellipsoid(), "--json").stdout)["volume_m3"]

    def test_info_json_of_an_ellipsoid(self):
        body = self.make_ellipsoid(centre=(0.1, 0.0, 0.0))
        info = json.loads(self.done("info", body, "--json").stdout)
        self.assertEqual(info["degree"], 1)
        self.assertEqual(info["n_coefficients"], 4)
        self.assertIs(info["is_embedded"], True)
        self.assertIs(info["is_star_shaped"], True)
        self.assertIsNone(info["fit"])
        for k in range(3):
            centre = 0.1 if k == 0 else 0.0
            # a box of samples lies inside the true one, by less than a hundredth
            self.assertLessEqual(info["box_max_m"][k], centre + AXES[k] * (1 + 1e-12))
            self.assertGreaterEqual(info["box_max_m"][k], centre + 0.99 * AXES[k])
            self.assertGreaterEqual(info["box_min_m"][k], centre - AXES[k] * (1 + 1e-12))
        self.assertLessEqual(abs(info["diagonal_m"] / DIAGONAL - 1.0), 0.01)
        # a ball around the ellipsoid cannot be smaller than its longest half axis
        self.assertGreaterEqual(info["radius_m"], AXES[0])
        self.assertLessEqual(info["radius_m"], DIAGONAL)
        self.assertIn(info["embedded_certainty"], ("sampled", "proven"))

    def test_info_text_names_the_essentials(self):
        text = self.done("info", self.make_ellipsoid()).stdout
        for word in ("degree", "diagonal", "certified radius", "star-shaped", "self-intersection"):
            self.assertIn(word, text)

    def test_file_name_that_is_not_utf8_still_gives_json(self):
        body = self.make_ellipsoid()
        strange = os.fsencode(self.folder) + b'/\xff\xc0"\\.shcd'
        os.rename(body, strange)
        out = subprocess.run([SHCD, b"info", strange, b"--json"], check=True,
                             stdout=subprocess.PIPE).stdout
        self.assertTrue(json.loads(out.decode("utf-8"))["file"].endswith('/\ufffd\ufffd"\\.shcd'))

    def test_unusual_size_brings_a_warning(self):
        source = self.write("in.csv", table(ellipsoid_rows(axes=(50.0, 40.0, 30.0))))
        result = self.done("create", source, "-o", self.path("big.shcd"))
        self.assertRegex(result.stderr, "^shcd create: warning: .*not between 1 mm and 10 m.*\n$")

    def test_bad_tables_are_refused_with_their_line(self):
        good = table(ellipsoid_rows())
        self.refuse("in.csv: empty", "")
        self.refuse("in.csv: empty", "# nothing but a comment\n")
        self.refuse("in.csv:1: the header must be", "0,0,1,2,3\n")
        self.refuse("in.csv: there are no rows", "l,m,x,y,z\n")
        self.refuse("in.csv: l=1, m=0 is missing", "".join(
            line + "\n" for line in good.splitlines() if not line.startswith("1,0,")))
        self.refuse("in.csv:6: l=1, m=0 was given already on line 4", good + "1,0,0,0,0\n")
        self.refuse("in.csv:6: m = '3' is not", good + "2,3,0,0,0\n")
        self.refuse("in.csv:6: l = '-1' is not", good + "-1,0,0,0,0\n")
        self.refuse("in.csv:6: l = '151' is not", good + "151,0,0,0,0\n")
        self.refuse("in.csv:6: l = '2.0' is not", good + "2.0,0,0,0,0\n")
        self.refuse("in.csv:6: 4 fields instead of 5", good + "2,0,0,0\n")
        for word in ("nan", "inf", "1e999", "3mm", "0x10", "", "1 2", "1.5.2"):
            self.refuse("in.csv:6: field 4, '.*', is not a finite number",
                        good + "2,0,0,%s,0\n" % word)
        self.refuse("in.csv:6: a zero byte", good.encode() + b"2,0,\0,0,0\n")
        self.refuse("in.csv:6: the line is longer", good + "2" * 5000 + "\n")
        self.refuse("in.csv:6: more than 16 fields", good + "," * 20 + "\n")

    def test_complex_table_of_no_real_surface_is_refused(self):
        rows = to_complex(ellipsoid_rows())
        rows[1, -1][2] += 1e-3
        self.refuse("in.csv:3: l=1, m=-1 is not", table(rows, COMPLEX))
        rows = to_complex(ellipsoid_rows())
        rows[0, 0][1] = 1e-3
        self.refuse("in.csv:2: l=0, m=0 is not", table(rows, COMPLEX))

    def test_coefficients_without_a_surface_are_refused(self):
        self.refuse("in.csv: ", "l,m,x,y,z\n0,0,1,0,0\n")
        flat = ellipsoid_rows()
        flat[1, 0] = [0.0, 0.0, 0.0]
        flat[1, 1] = [0.0, 0.0, 0.0]
        flat[1, -1] = [0.0, 0.0, 0.0]
        self.refuse("in.csv: ", table(flat))
        inside_out = ellipsoid_rows(axes=(0.05, 0.04, -0.03))
        self.refuse("in.csv: ", table(inside_out))

    def test_bad_files(self):
        self.fails(1, "none.csv: cannot open", "create", self.path("none.csv"), "-o",
                   self.path("out.shcd"))
        self.fails(1, "none.shcd", "info", self.path("none.shcd"))
        self.fails(1, "cannot", "create", self.folder, "-o", self.path("out.shcd"))
        source = self.write("in.csv", table(ellipsoid_rows()))
        self.fails(1, "cannot write to the folder", "create", source, "-o",
                   self.path("no/such/folder.shcd"))
        self.fails(1, "not a regular file", "create", source, "-o", "/dev/null")
        self.fails(1, "overwrite the input", "create", source, "-o", source)
        os.link(source, self.path("link"))
        self.fails(1, "overwrite the input", "create", source, "-o", self.path("link"))
        self.assertEqual(self.read("in.csv"), table(ellipsoid_rows()))

    def test_bodies_that_are_none(self):
        body = self.make_ellipsoid()
        with open(body, "rb") as file:
            content = file.read()
        middle = len(content) // 2
        altered = content[:middle] + bytes([content[middle] ^ 1]) + content[middle + 1:]
        for bad in (b"", b"not a body", content[:-1], content[:middle], altered):
            self.write("bad.shcd", bad)
            for command in (["info"], ["query"], ["coefficients"],
                            ["surface", "-o", self.path("s.obj")]):
                self.fails(1, "bad.shcd", *command, self.path("bad.shcd"))

    def test_failed_coefficients_leave_the_old_file(self):
        body = self.make_ellipsoid()
        self.write("old.csv", "old")
        self.fails(1, "overwrite the input", "coefficients", body, "-o", body)
        self.fails(1, "bad", "coefficients", self.write("bad.shcd", "bad"), "-o",
                   self.path("old.csv"))
        self.assertEqual(self.read("old.csv"), "old")


if __name__ == "__main__":
    unittest.main()
