#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Installs the build into a private prefix, moves that elsewhere, and looks at what is there: all
of it must work from the new place. Leaves the prefix, with a body in it, for the consumers."""
import argparse
import re
import shutil
import sys
from pathlib import Path

from surroundings import clean_environment, run

AXIS = 2.0466534158929770  # sqrt(4 pi / 3)


def expected_files(source, libdir, version, soversion, has_fit, has_daemon):
    headers = {f"include/shcd/{path.name}" for path in (source / "include/shcd").iterdir()}
    scenes = {f"share/shcd/scenes/{path.name}" for path in (source / "scenes").iterdir()
              if path.is_file() and path.name != "CMakeLists.txt"}
    names = {"bin/shcd", "share/man/man1/shcd.1", "share/doc/shcd/LICENSE",
             f"{libdir}/cmake/shcd/shcdConfig.cmake",
             f"{libdir}/cmake/shcd/shcdConfigVersion.cmake"}
    for component, library in (("shcd", "shcd"), ("fit", "shcd-fit")):
        if component == "fit" and not has_fit:
            headers.discard("include/shcd/fit.h")
            continue
        names |= {f"{libdir}/cmake/shcd/shcd-{component}Targets.cmake",
                  f"{libdir}/pkgconfig/{library}.pc"}
        names |= {f"{libdir}/lib{library}.so{suffix}"
                  for suffix in ("", f".{soversion}", f".{version}")}
    if has_daemon:
        names.add("bin/shcdd")
    return names | headers | scenes


def check_files(prefix, expected, private_folders):
    found = {path.relative_to(prefix).as_posix() for path in prefix.rglob("*")
             if path.is_symlink() or path.is_file()}
    failures = [f"{name}: not installed" for name in sorted(expected - found)]
    failures += [f"{name}: installed, but belongs to no component" for name in
                 sorted(found - expected) if name.startswith("include/")]
    for name in sorted(found):
        if name.endswith((".cmake", ".pc")):
            text = (prefix / name).read_text()
            failures += [f"{name}: names {folder}" for folder in private_folders
                         if re.search(re.escape(str(folder)) + r"\b", text)]
    return failures


def make_body(prefix, environment):
    """With the installed command, which finds its libraries beside itself."""
    rows = {(0, 0): (0, 0, 0), (1, 1): (0.03 * AXIS, 0, 0), (1, -1): (0, 0.02 * AXIS, 0),
            (1, 0): (0, 0, 0.01 * AXIS)}
    table = "l,m,x,y,z\n" + "".join(f"{l},{m},{x!r},{y!r},{z!r}\n"
                                    for (l, m), (x, y, z) in rows.items())
    run([prefix / "bin/shcd", "create", "-", "-o", prefix / "ellipsoid.shcd"], environment, table)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cmake", required=True)
    parser.add_argument("--source", required=True, type=Path)
    parser.add_argument("--build", required=True, type=Path)
    parser.add_argument("--config", default="")
    parser.add_argument("--prefix", required=True, type=Path)
    parser.add_argument("--libdir", required=True)
    parser.add_argument("--version", required=True)
    parser.add_argument("--soversion", required=True)
    parser.add_argument("--fit", action="store_true")
    parser.add_argument("--daemon", action="store_true")
    arguments = parser.parse_args()
    environment = clean_environment()
    first = arguments.prefix.with_name(arguments.prefix.name + "-first")
    for folder in (first, arguments.prefix):
        shutil.rmtree(folder, ignore_errors=True)
    config = ["--config", arguments.config] if arguments.config else []
    run([arguments.cmake, "--install", arguments.build, "--prefix", first, *config], environment)
    first.rename(arguments.prefix)
    expected = expected_files(arguments.source, arguments.libdir, arguments.version,
                              arguments.soversion, arguments.fit, arguments.daemon)
    failures = check_files(arguments.prefix, expected,
                           [first, arguments.source, arguments.build])
    for command in ["shcd"] + ["shcdd"] * arguments.daemon:
        output = run([arguments.prefix / "bin" / command, "--version"], environment)
        if arguments.version not in output:
            failures.append(f"{command} --version: {output}")
    make_body(arguments.prefix, environment)
    print("\n".join(failures + [f"{len(expected)} files expected, {len(failures)} failures"]))
    return len(failures) > 0


if __name__ == "__main__":
    sys.exit(main())
