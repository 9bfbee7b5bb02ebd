#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Every function that a header marks SHCD_RT is called by the source whose footprint is measured.

    check_calls.py SOURCE HEADER...
"""
import re
import sys
from pathlib import Path


def marked(header):
    text = re.sub(r"/\*.*?\*/", "", header.read_text(), flags=re.S)
    for declaration in re.findall(r"SHCD_API\b[^;{]*;", text):
        if re.search(r"\bSHCD_RT\b", declaration):
            yield re.search(r"\b(shcd_\w+)\s*\(", declaration).group(1)


def main():
    source, *headers = map(Path, sys.argv[1:])
    called = set(re.findall(r"\b(shcd_\w+)\s*\(", source.read_text()))
    names = [name for header in headers for name in marked(header)]
    missing = sorted(set(names) - called)
    for name in missing:
        print(f"{source}: does not call {name}, which is marked SHCD_RT")
    print(f"{len(names)} functions, {len(missing)} missing")
    return 1 if missing or len(names) < 40 else 0


sys.exit(main())
