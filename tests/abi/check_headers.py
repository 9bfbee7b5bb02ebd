#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The public headers, seen by one pair of compilers: each compiles alone, as C and as C++, without
a warning; layouts are those on record; no structure has padding; every initialiser works."""
import argparse
import re
import subprocess
import sys
from pathlib import Path

import header_text

HERE = Path(__file__).resolve().parent
WARNINGS = ["-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wsign-conversion", "-Wshadow",
            "-Wundef", "-Wcast-qual", "-Werror"]
C, CXX = ["c99", "c17"], ["c++11", "c++20"]


class Compiler:
    def __init__(self, arguments):
        self.arguments = arguments
        self.failures = 0

    def accept(self, what, standard, source, *options):
        """Compiles; a failure is printed and counted."""
        is_cxx = standard.startswith("c++")
        command = [self.arguments.cxx if is_cxx else self.arguments.cc, "-fsyntax-only",
                   f"-std={standard}", *WARNINGS, *options, "-I", self.arguments.include,
                   "-I", HERE, "-x", "c++" if is_cxx else "c", "-"]
        done = subprocess.run(command, input=source, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            self.fail(f"{what}: {command[0]} -std={standard}:\n{done.stderr}")

    def fail(self, text):
        print(text)
        self.failures += 1


def recorded(layout):
    """The names in shcd.layout: structures, structure.members and enumerators."""
    pattern = r"^(SIZE|AT|VALUE)\((\w+)(?:, (\w+))??, -?\d+\)$"
    return {f"{name}.{member}" if kind == "AT" else name
            for kind, name, member in re.findall(pattern, layout, re.M)}


def declared(headers):
    names = set()
    for path in headers:
        text = path.read_text()
        for structure, members in header_text.structs(text):
            names |= {structure, *(f"{structure}.{member}" for member in members)}
        for _, enumerators in header_text.enumerators(text):
            names |= set(enumerators)
        names |= set(header_text.limits(text))
    return names


def check_complete(compiler, headers):
    on_record, in_headers = recorded((HERE / "shcd.layout").read_text()), declared(headers)
    for name in sorted(in_headers - on_record):
        compiler.fail(f"{name} is not in shcd.layout (tests/abi/print_layout.py prints it anew)")
    for name in sorted(on_record - in_headers):
        compiler.fail(f"{name} is in shcd.layout, but in no header")
    tried = (HERE / "initialisers.c").read_text()
    for path in headers:
        for _, macro in header_text.initialisers(path.read_text()):
            if not re.search(rf"\b{macro}\b", tried):
                compiler.fail(f"{macro} of {path.name} is not tried in initialisers.c")


def check_sized(compiler, headers):
    """An _INIT that starts a structure starts it with struct_size."""
    for path in headers:
        text = path.read_text()
        members = dict(header_text.structs(text))
        for structure, macro in header_text.initialisers(text):
            if members.get(structure, [None])[0] != "struct_size":
                compiler.fail(f"{macro}: {structure} does not start with struct_size")


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cc", required=True)
    parser.add_argument("--cxx", required=True)
    parser.add_argument("--include", required=True, type=Path)
    compiler = Compiler(parser.parse_args())
    headers = header_text.headers(compiler.arguments.include)
    for path in headers:
        for standard in C + CXX:
            # twice, for the guard
            compiler.accept(path.name, standard, f'#include "shcd/{path.name}"\n' * 2)
    for standard in ["c11"] + CXX:
        compiler.accept("layout.c", standard, (HERE / "layout.c").read_text())
    for standard in C + CXX:
        compiler.accept("initialisers.c", standard, (HERE / "initialisers.c").read_text())
    # the end of an older caller's structure would lie in padding, and be read as the next member
    compiler.accept("padding", "c17", "".join(f'#include "shcd/{path.name}"\n' for path in headers),
                    "-Wpadded")
    check_complete(compiler, headers)
    check_sized(compiler, headers)
    print(f"{len(headers)} headers, {len(declared(headers))} names, {compiler.failures} failures")
    return compiler.failures > 0


if __name__ == "__main__":
    sys.exit(main())
