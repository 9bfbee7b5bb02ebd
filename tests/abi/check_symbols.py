#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""A library exports what its committed list says, and the headers declare the same functions.

    check_symbols.py LIBRARY.so LIST HEADER... [--write]    --write: the list is made anew
"""
import argparse
import subprocess
import sys
from pathlib import Path

import header_text

COMMENT = ("# SPDX-License-Identifier: BSD-3-Clause\n"
           "# Exported symbols (nm -D --defined-only). To change it: CONTRIBUTING.md, Symbols.\n")


def exported(nm, library):
    output = subprocess.run([nm, "-D", "--defined-only", library], check=True, text=True,
                            capture_output=True).stdout
    # address, kind, name@@VERSION; the version nodes themselves are absolute (A)
    fields = [line.split() for line in output.splitlines()]
    return sorted(f"{kind} {name.replace('@@', '@')}" for _, kind, name in fields if kind != "A")


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("library")
    parser.add_argument("list", type=Path)
    parser.add_argument("headers", nargs="+", type=Path)
    parser.add_argument("--nm", default="nm")
    parser.add_argument("--write", action="store_true")
    arguments = parser.parse_args()
    now = exported(arguments.nm, arguments.library)
    if arguments.write:
        arguments.list.write_text(COMMENT + "".join(f"{line}\n" for line in now))
    committed = {line for line in arguments.list.read_text().splitlines()
                 if line and not line.startswith("#")}
    declared = {name for path in arguments.headers
                for name in header_text.functions(path.read_text())}
    failures = [f"{line}: exported, but not in {arguments.list.name}" for line in now
                if line not in committed]
    failures += [f"{line}: in {arguments.list.name}, but not exported"
                 for line in sorted(committed - set(now))]
    names = {line.split()[1].split("@")[0] for line in now}
    failures += [f"{name}: declared SHCD_API, but not exported" for name in
                 sorted(declared - names)]
    failures += [f"{name}: exported, but no header declares it" for name in
                 sorted(names - declared)]
    print("\n".join(failures + [f"{len(now)} symbols, {len(failures)} failures"]))
    return len(failures) > 0


if __name__ == "__main__":
    sys.exit(main())
