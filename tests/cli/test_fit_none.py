# SPDX-License-Identifier: BSD-3-Clause
"""fit in a build without libshcd-fit: it says so and fails; usage is still checked."""
import unittest

from support import CommandTest


class FitNone(CommandTest):
    def test_refuses_with_the_reason(self):
        self.fails(1, "this build has no libshcd-fit", "fit", "mesh.obj", "-o",
                   self.path("body.shcd"))

    def test_modes_refuses_with_the_reason(self):
        self.fails(1, "this build has no libshcd-fit", "modes", "body.shcd", "-o",
                   self.path("copy.shcd"))
        self.fails(2, "unknown or ambiguous option --frobnicate", "modes", "--frobnicate")

    def test_train_refuses_with_the_reason(self):
        self.fails(1, "this build has no libshcd-fit", "train", "body.shcd", "-o",
                   self.path("copy.shcd"))
        self.fails(2, "unknown or ambiguous option --frobnicate", "train", "--frobnicate")

    def test_usage_is_still_checked(self):
        self.fails(2, "unknown or ambiguous option --frobnicate", "fit", "--frobnicate")
        self.assertIn("--unit", self.done("fit", "--help").stdout)

    def test_version_says_so(self):
        self.assertIn("without libshcd-fit", self.done("--version").stdout)


if __name__ == "__main__":
    unittest.main()
