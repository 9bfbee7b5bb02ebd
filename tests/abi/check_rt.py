#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What a comment calls RT safe carries the marker SHCD_RT, which tests/determinism/tick_closure.py
takes its roots from, and what carries the marker is called so: by its own comment, or by that of the
file where its own does not object.

    check_rt.py HEADER...
"""
import re
import sys
from pathlib import Path


def says(comment):
    """True, False, or None if the comment says neither."""
    text = re.sub(r"[\s*]+", " ", comment)
    if re.search(r"\b(?:not|none is) RT safe\b", text, re.I):
        return False
    return True if re.search(r"\bRT safe\b", text) else None


def declarations(text):
    """(name, has the marker, comment directly before) of every exported function."""
    for found in re.finditer(r"(/\*\*(?:(?!\*/).)*\*/)?\s*(SHCD_API\b[^;{]*?\b(shcd_\w+)\s*\([^;{]*;)",
                             text, re.S):
        comment, declaration, name = found.groups()
        yield name, re.search(r"\bSHCD_RT\b", declaration) is not None, comment or ""


def check(path):
    text = re.sub(r"^[ \t]*#(?:[^\n\\]|\\.)*(?:\\\n(?:[^\n\\]|\\.)*)*", "",
                  path.read_text(), flags=re.M)
    about = re.search(r"/\*\*\s*@file.*?\*/", text, re.S)
    whole_file = says(about.group(0)) if about else None
    found = list(declarations(text))
    failures = []
    for name, marked, comment in found:
        own = says(comment)
        if marked and own is not True and not (own is None and whole_file is True):
            failures.append(f"{path}: {name} has SHCD_RT, but its comment does not say RT safe")
        if not marked and (own is True or (own is None and whole_file is True)):
            failures.append(f"{path}: {name} is said to be RT safe, but has no SHCD_RT")
    return len(found), failures


def main(paths):
    if not paths:
        sys.exit("usage: check_rt.py HEADER...")
    n, failures = 0, []
    for path in map(Path, paths):
        n_here, found = check(path)
        n += n_here
        failures += found
    if n == 0:
        failures.append("no exported function in " + " ".join(paths))
    if failures:
        sys.exit("\n".join(failures))
    print(f"{n} functions: what is called RT safe is marked, and the other way round")


if __name__ == "__main__":
    main(sys.argv[1:])
