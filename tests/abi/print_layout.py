#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Prints the size of each public structure, the offset of each member and the value of each
enumerator and limit, as the compiler lays them out: the content of shcd.layout.

    tests/abi/print_layout.py > tests/abi/shcd.layout
"""
import argparse
import subprocess
import tempfile
from pathlib import Path

import header_text

ROOT = Path(__file__).resolve().parents[2]


def probe(include_dir):
    lines = ["#include <stddef.h>", "#include <stdio.h>"]
    lines += [f'#include "shcd/{path.name}"' for path in header_text.headers(include_dir)]
    lines.append("int main(void) {")

    def say(text, value):
        lines.append(f'    printf("{text}\\n", (long)({value}));')

    for path in header_text.headers(include_dir):
        text = path.read_text()
        for name, members in header_text.structs(text):
            say(f"SIZE({name}, %ld)", f"sizeof({name})")
            for member in members:
                say(f"AT({name}, {member}, %ld)", f"offsetof({name}, {member})")
        for _, names in header_text.enumerators(text):
            for name in names:
                say(f"VALUE({name}, %ld)", name)
        for name in header_text.limits(text):
            say(f"VALUE({name}, %ld)", name)
    return "\n".join(lines + ["    return 0;", "}", ""])


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("--cc", default="cc")
    parser.add_argument("--include", type=Path, default=ROOT / "include")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        source, program = Path(folder, "probe.c"), Path(folder, "probe")
        source.write_text(probe(arguments.include))
        subprocess.run([arguments.cc, "-std=c17", "-I", arguments.include, "-o", program, source,
                        "-lm"], check=True)
        print("/* SPDX-License-Identifier: BSD-3-Clause */", flush=True)
        subprocess.run([program], check=True)


if __name__ == "__main__":
    main()
