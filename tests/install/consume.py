#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Builds a consumer project against an installed prefix, by CMake or by pkg-config, without
optimisation and with warnings as errors, and runs it."""
import argparse
import shutil
import sys
from pathlib import Path

from surroundings import clean_environment, run

WARNINGS = ["-O0", "-Wall", "-Wextra", "-Wpedantic", "-Werror"]


def by_cmake(arguments, source):
    """Returns the program, and the environment that it runs in."""
    language = "C" if source.suffix == ".c" else "CXX"
    environment = clean_environment()
    run([arguments.cmake, "-G", arguments.generator, "-S", arguments.project, "-B", arguments.work,
         f"-DCMAKE_{language}_COMPILER={arguments.compiler}",
         f"-DCMAKE_{language}_FLAGS={' '.join(WARNINGS)}",
         f"-DCMAKE_PREFIX_PATH={arguments.prefix}"], environment)
    run([arguments.cmake, "--build", arguments.work], environment)
    # a multi-configuration generator puts it one folder deeper
    program = next(path for path in sorted(arguments.work.glob("**/consumer")) if path.is_file())
    return program, environment


def by_pkg_config(arguments, source):
    """No other package is visible: shcd.pc must not ask for one."""
    libdir = arguments.prefix / arguments.libdir
    environment = clean_environment(PKG_CONFIG_LIBDIR=str(libdir / "pkgconfig"),
                                    LD_LIBRARY_PATH=str(libdir))
    flags = run([arguments.pkg_config, "--cflags", "--libs", arguments.package], environment)
    standard = "-std=c99" if source.suffix == ".c" else "-std=c++11"
    program = arguments.work / "consumer"
    arguments.work.mkdir(parents=True)
    run([arguments.compiler, standard, *WARNINGS, source, "-o", program, *flags.split()],
        environment)
    return program, environment


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("how", choices=["cmake", "pkg-config"])
    parser.add_argument("--project", required=True, type=Path)
    parser.add_argument("--prefix", required=True, type=Path)
    parser.add_argument("--libdir", required=True)
    parser.add_argument("--package", required=True)
    parser.add_argument("--compiler", required=True)
    parser.add_argument("--cmake", required=True)
    parser.add_argument("--generator", required=True)
    parser.add_argument("--pkg-config", required=True)
    parser.add_argument("--work", required=True, type=Path)
    parser.add_argument("operands", nargs="*")
    arguments = parser.parse_args()
    shutil.rmtree(arguments.work, ignore_errors=True)
    source = next(arguments.project.glob("main.c*"))
    build = by_cmake if arguments.how == "cmake" else by_pkg_config
    program, environment = build(arguments, source)
    print(run([program, *arguments.operands], environment))


if __name__ == "__main__":
    sys.exit(main())
