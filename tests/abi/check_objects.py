#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""No object file of the run-time library holds a variable: all writable sections are empty.

.data.rel.ro is constant after loading (tables of pointers) and allowed.
"""
import re
import subprocess
import sys

WRITABLE = re.compile(r"^\.(t?data|t?bss|ldata|lbss|sdata|sbss)(\.|$)|^COMMON$")


def writable_sections(objdump, path):
    output = subprocess.run([objdump, "-h", "-w", path], check=True, text=True,
                            capture_output=True).stdout
    for index, name, size in re.findall(r"^\s*(\d+)\s+(\S+)\s+([0-9a-f]{8,})\s", output, re.M):
        if WRITABLE.match(name) and not name.startswith(".data.rel.ro") and int(size, 16) > 0:
            yield f"{name} {int(size, 16)} bytes"


def common_symbols(objdump, path):
    """Tentative definitions have no section of their own before linking (-fcommon)."""
    output = subprocess.run([objdump, "-t", path], check=True, text=True,
                            capture_output=True).stdout
    return [line.split()[-1] for line in output.splitlines() if "*COM*" in line]


def main():
    objdump, *paths = sys.argv[1:]
    failures = [f"{path}: {what}" for path in paths
                for what in [*writable_sections(objdump, path), *common_symbols(objdump, path)]]
    print("\n".join(failures + [f"{len(paths)} object files, {len(failures)} failures"]))
    return len(failures) > 0 or not paths


if __name__ == "__main__":
    sys.exit(main())
