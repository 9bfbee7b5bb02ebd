#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The version numbers agree wherever they stand: CMake, base.h, version scripts, CONTRIBUTING.md.

    check_versions.py ROOT VERSION SOVERSION
"""
import re
import sys
from pathlib import Path


def main():
    root, version, soversion = Path(sys.argv[1]), sys.argv[2], sys.argv[3]
    base = (root / "include/shcd/base.h").read_text()
    header = ".".join(re.search(rf"#define SHCD_VERSION_{part} (\d+)", base).group(1)
                      for part in ("MAJOR", "MINOR", "PATCH"))
    contributing = (root / "CONTRIBUTING.md").read_text()
    found = {
        ("include/shcd/base.h", "version"): (header, version),
        ("CONTRIBUTING.md", "version"):
            (re.search(r"^\| Version \| `([^`]+)`", contributing, re.M).group(1), version),
        ("CONTRIBUTING.md", "soname"):
            (re.search(r"^\| Soname \| `([^`]+)`", contributing, re.M).group(1),
             f"libshcd.so.{soversion}"),
        ("CONTRIBUTING.md", "node"):
            (re.search(r"^\| Symbol version \| `([^`]+)`", contributing, re.M).group(1),
             f"SHCD_{soversion}"),
    }
    for script, node in (("libshcd/shcd.map", "SHCD"), ("libshcd/fit/shcd-fit.map", "SHCD_FIT")):
        text = (root / script).read_text()
        found[(script, "node")] = (re.search(r"^(\w+)\s*\{", text, re.M).group(1),
                                   f"{node}_{soversion}")
    failures = [f"{where}: {what} {is_}, expected {expected}"
                for (where, what), (is_, expected) in found.items() if is_ != expected]
    print("\n".join(failures + [f"{len(found)} places, {len(failures)} failures"]))
    return len(failures) > 0


if __name__ == "__main__":
    sys.exit(main())
