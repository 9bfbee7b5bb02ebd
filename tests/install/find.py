#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""What find_package and pkg-config say yes and no to: versions and components."""
import argparse
import shutil
import sys
from pathlib import Path

from surroundings import attempt, clean_environment


def packages(version, has_fit):
    """(what is asked of find_package, whether it is to succeed, what its output must say)"""
    major, minor, patch = map(int, version.split("."))
    yield "", True, "has shcd::shcd"
    yield f"{major}.{minor}", True, "has shcd::shcd"
    yield f"{version} EXACT", True, "has shcd::shcd"
    yield f"{major}.{minor}.{patch + 1}", False, "requested version"
    yield f"{major}.{minor + 1}", False, "requested version"
    yield f"{major + 1}.0", False, "requested version"
    if minor > 0:
        yield f"{major}.{minor - 1}", False, "requested version"
    yield "COMPONENTS shcd", True, "has shcd::shcd"
    yield "COMPONENTS shcd teapot", False, "no component teapot (there are: shcd, fit)"
    if has_fit:
        for order in "fit", "shcd fit", "fit shcd":
            yield f"COMPONENTS {order}", True, "has shcd::fit"
    else:
        yield "COMPONENTS fit", False, "SHCD_BUILD_FIT=OFF"
    yield "OPTIONAL_COMPONENTS teapot", True, "has shcd::shcd"


def modules(version, has_fit):
    """(arguments of pkg-config, whether it is to succeed, what its output must say)"""
    major, minor, patch = map(int, version.split("."))
    for name in ["shcd"] + ["shcd-fit"] * has_fit:
        yield ["--modversion", name], True, version
        yield ["--exists", f"{name} >= {major}.{minor}"], True, ""
        yield ["--exists", f"{name} > {major}.{minor}.{patch}"], False, ""
    yield ["--static", "--libs", "shcd"], True, "-lz"
    if has_fit:
        yield ["--libs", "shcd-fit"], True, "-lshcd "
        yield ["--static", "--libs", "shcd-fit"], True, "-lgsl"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--prefix", required=True, type=Path)
    parser.add_argument("--libdir", required=True)
    parser.add_argument("--version", required=True)
    parser.add_argument("--fit", action="store_true")
    parser.add_argument("--cmake", required=True)
    parser.add_argument("--generator", required=True)
    parser.add_argument("--pkg-config", required=True)
    parser.add_argument("--project", required=True, type=Path)
    parser.add_argument("--work", required=True, type=Path)
    arguments = parser.parse_args()
    pc = str(arguments.prefix / arguments.libdir / "pkgconfig")
    attempts = []
    for wanted, good, text in packages(arguments.version, arguments.fit):
        command = [arguments.cmake, "-G", arguments.generator, "-S", arguments.project,
                   "-B", arguments.work, f"-DCMAKE_PREFIX_PATH={arguments.prefix}",
                   f"-DWANTED={wanted}"]
        attempts.append((f"find_package(shcd {wanted})", command, clean_environment(), good, text))
    for wanted, good, text in modules(arguments.version, arguments.fit):
        attempts.append((f"pkg-config {' '.join(wanted)}", [arguments.pkg_config, *wanted],
                         clean_environment(PKG_CONFIG_LIBDIR=pc), good, text))
    failures = 0
    for name, command, environment, good, text in attempts:
        shutil.rmtree(arguments.work, ignore_errors=True)
        done = attempt(command, environment)
        if (done.returncode == 0) != good or text not in " ".join(done.stdout.split()) + " ":
            print(f"{name}: to {'succeed' if good else 'fail'} with '{text}', but:\n{done.stdout}")
            failures += 1
    print(f"{len(attempts)} requests, {failures} failures")
    return failures > 0


if __name__ == "__main__":
    sys.exit(main())
