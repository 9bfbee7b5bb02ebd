# SPDX-License-Identifier: BSD-3-Clause
"""effects: the table for people and in Markdown, and that docs/effects.md holds the same."""
import os
import re
import unittest

from support import CommandTest

DOCUMENT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "docs",
                        "effects.md")


def without_costs(text):
    """The rows of the first table end in bytes of state and two times; those are measured."""
    return re.sub(r"(?m) \| (?:\d+|-) \| (?:\d+|-) \| (?:\d+|-) \|$", " |", text)


class EffectsTest(CommandTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.markdown = None

    def table(self):
        if EffectsTest.markdown is None:
            EffectsTest.markdown = self.done("effects", "--markdown").stdout
        return EffectsTest.markdown

    def test_document_is_the_librarys_table(self):
        with open(DOCUMENT, encoding="ascii") as file:
            document = file.read()
        block = re.search(r"(?s)<!-- shcd effects --markdown -->\n(.*)<!-- end -->", document)
        self.assertEqual(without_costs(block.group(1)), without_costs(self.table()))

    def test_document_has_a_section_for_each_effect(self):
        with open(DOCUMENT, encoding="ascii") as file:
            headings = " ".join(re.findall(r"(?m)^## (.*)$", file.read()))
        for name in re.findall(r"(?m)^\| `(\w+)` \| [^`]", self.table()):
            self.assertRegex(headings, r"\b%s\b" % name)

    def test_costs_are_those_of_a_tick(self):
        rows = re.findall(r"(?m)^\| `(\w+)` \| [^`].* \| (\S+) \| (\S+) \| (\S+) \|$", self.table())
        costs = {name: numbers for name, *numbers in rows}
        for name in ("texture", "stiffness", "damping", "relaxation", "friction", "viscosity"):
            state, mean, slow = (float(value) for value in costs[name])
            self.assertGreaterEqual(state, 24)
            self.assertGreaterEqual(slow, mean)
            self.assertLess(mean, 1e5)
        self.assertEqual(float(costs["stiffness"][0]), 24)  # a gain, and no memory of contacts
        self.assertGreaterEqual(float(costs["friction"][0]), 24 + 88)  # an anchor for each of them
        for name in ("wave", "pulse"):  # the built-in body has no modes
            self.assertEqual(costs[name], ["-", "-", "-"])

    def test_text_names_every_parameter(self):
        text = self.done("effects").stdout
        for name in re.findall(r"(?m)^\| `\w+` \| `(\w+)` \|", self.table()):
            self.assertIn("  %s " % name, text)

    def test_body_is_measured(self):
        self.assertIn("ns a tick", self.done("effects", "--body", self.make_ellipsoid()).stdout)

    def test_bad_usage(self):
        self.fails(2, "operand", "effects", "body.shcd")
        self.fails(1, "none.shcd", "effects", "--body", self.path("none.shcd"))


if __name__ == "__main__":
    unittest.main()
