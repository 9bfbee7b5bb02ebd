# SPDX-License-Identifier: BSD-3-Clause
"""Options, help, version: bad usage is status 2 and one line that points to --help."""
import subprocess
import unittest

from support import SHCD, CommandTest

COMMANDS = ("fit", "info", "query", "surface", "coefficients", "create", "cost", "modes")


class Usage(CommandTest):
    def bad(self, pattern, *arguments):
        result = self.fails(2, pattern, *arguments)
        self.assertIn("--help'", result.stderr)
        self.assertEqual(result.stdout, "")

    def test_overview_lists_every_command(self):
        text = self.done("--help").stdout
        for command in COMMANDS:
            self.assertRegex(text, r"(?m)^  %s " % command)

    def test_each_command_has_help_within_eighty_columns(self):
        for command in COMMANDS:
            text = self.done(command, "--help").stdout
            self.assertTrue(text.startswith("usage: shcd %s " % command))
            for line in text.splitlines()[1:]:
                self.assertLessEqual(len(line), 80, line)

    def test_version_names_command_and_library(self):
        self.assertRegex(self.done("--version").stdout, r"^shcd \d+\.\d+\.\d+ \(libshcd \d+\.")

    def test_top_level(self):
        self.bad("no command")
        self.bad("unknown command 'frobnicate'", "frobnicate")
        self.bad("unknown command", "--frobnicate")

    def test_options_in_general(self):
        self.bad("unknown or ambiguous option --frobnicate", "info", "--frobnicate")
        self.bad("unknown option -z", "info", "-z", "body")
        self.bad("--json takes no argument", "info", "--json=yes", "body")
        self.bad("--output needs an argument", "create", "table.csv", "-o")
        self.bad("unknown or ambiguous option --degre", "fit", "--degre", "3")
        self.bad("BODY.shcd is missing", "info")
        self.bad("unexpected operand 'two'", "info", "one", "two")

    def test_values_of_options(self):
        for degree in ("0", "151", "-1", "3.5", "3x", "", " 3", "99999999999999999999"):
            self.bad("--degree .*must be 1 to 150", "surface", "b", "-o", "s.obj", "-d", degree)
        for level in ("-1", "10", "two"):
            self.bad("--subdivide .*must be 0 to 9", "surface", "b", "-o", "s.obj", "-n", level)
        for length in ("0", "-1", "nan", "inf", "1e999", "1 mm", "mm", "0x1p3", "1,5", "3ft", ""):
            self.bad("--tolerance .*not a positive length", "query", "b", "--tolerance", length)
        for unit in ("0", "-1", "nan", "mile", "1cm", ""):
            self.bad("--unit .*must be m, cm", "create", "t.csv", "-o", "b", "--unit", unit)
        self.bad("--tier best: must be map, fast or exact", "query", "b", "--tier", "best")
        self.bad("no meaning with --tier map", "query", "b", "--tier", "map", "--tolerance", "1")
        self.bad("--grid has a meaning with --tier map only", "query", "b", "--grid", "latlong")
        self.bad("--grid cube: must be octahedral or latlong", "query", "b", "--grid", "cube")
        self.bad("--interpolation no: must be linear or hermite", "query", "b",
                 "--interpolation", "no")
        for resolution in ("1", "513", "3.5", "x"):
            self.bad("--resolution .* whole number from 2 to 512", "query", "b",
                     "--resolution", resolution)
        self.bad("needs --grid octahedral", "query", "b", "--tier", "map", "--grid", "latlong",
                 "--interpolation", "hermite")

    def test_modes(self):
        for command in (("fit", "m.obj"), ("modes", "b")):
            for n in ("-1", "1025", "2.5", "x"):
                self.bad("--modes .*must be 0 to 1024", *command, "-o", "o", "--modes", n)
        for anchor in ("", "1,2,3", "1,2,3,0", "1,2,3,-1", "1,2,3,1,0", "1,2,3,1,1,1", "1,2,,1",
                       "a,2,3,1", "1,2,3,nan", "1 2 3 4", "1,2,3," + "1" * 80):
            self.bad("--anchor .*must be x,y,z,radius", "modes", "b", "-o", "o", "--anchor", anchor)
        self.bad("more than 64 times --anchor", "modes", "b", "-o", "o",
                 *(["--anchor", "1,2,3,4"] * 65))
        self.bad("leaves no modes to be anchored", "modes", "b", "-o", "o", "--modes", "0",
                 "--anchor", "1,2,3,4")

    def test_missing_output(self):
        self.bad("-o OUT.shcd is missing", "modes", "body")
        self.bad("-o BODY.shcd is missing", "create", "table.csv")
        self.bad("-o BODY.shcd is missing", "create", "table.csv", "-o", "-")
        self.bad("-o OUT.obj", "surface", "body")
        self.bad("must end in .obj or .ply", "surface", "body", "-o", "surface.stl")

    def test_messages_stay_one_line(self):
        self.fails(1, r"no\?such", "info", "no\nsuch")

    def test_full_device_is_a_failure(self):
        with open("/dev/full", "w") as full:
            result = subprocess.run([SHCD, "--help"], stdout=full, stderr=subprocess.PIPE,
                                    text=True)
        self.assertEqual(result.returncode, 1)
        self.assertRegex(result.stderr, "^shcd: standard output: cannot write: .*\n$")


if __name__ == "__main__":
    unittest.main()
