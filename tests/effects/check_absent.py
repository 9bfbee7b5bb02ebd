# SPDX-License-Identifier: BSD-3-Clause
"""The same session with the whole table of effects, and with a library whose table holds the
session's own effects only: the ticks take the same number of instructions (callgrind, within 0.5 %),
the state as many bytes, and the forces have the same bits.

That the count can tell: one more effect in the scene costs more than those 0.5 %, and the small
library does not know it."""
import argparse
import os
import re
import subprocess
import sys

OWN = ["stiffness", "damping"]
OTHER = "friction"
SHARE = 0.005


def fail(message):
    sys.exit(f"check_absent.py: {message}")


def run(command, **options):
    done = subprocess.run(command, capture_output=True, text=True, **options)
    if done.returncode != 0:
        fail(f"{' '.join(command)}:\n{done.stdout}{done.stderr}")
    return done


def build(arguments):
    run([arguments.cmake, "-S", arguments.source, "-B", arguments.build, "-G", arguments.generator,
         f"-DCMAKE_C_COMPILER={arguments.compiler}", "-DCMAKE_BUILD_TYPE=Release",
         f"-DSHCD_EFFECTS={';'.join(OWN)}", "-DSHCD_BUILD_FIT=OFF", "-DSHCD_BUILD_DAEMON=OFF",
         "-DSHCD_BUILD_TESTS=OFF"])
    run([arguments.cmake, "--build", arguments.build, "--target", "shcd", "-j", "2"])
    return os.path.join(arguments.build, "libshcd")


def environment(folder):
    return dict(os.environ, LD_LIBRARY_PATH=folder)


def count(arguments, folder, effects):
    """(instructions within shcd_step, what the session printed)"""
    done = run([arguments.valgrind, "--tool=callgrind", "--callgrind-out-file=/dev/null",
                "--toggle-collect=shcd_step", arguments.session, *effects],
               env=environment(folder))
    collected = re.search(r"Collected : (\d+)", done.stderr)
    if not collected or int(collected.group(1)) == 0:
        fail(f"callgrind counted nothing:\n{done.stderr}")
    return int(collected.group(1)), done.stdout.split()


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    for name in ("cmake", "generator", "compiler", "source", "build", "valgrind", "session", "full"):
        parser.add_argument(f"--{name}", required=True)
    arguments = parser.parse_args()
    if arguments.valgrind.endswith("NOTFOUND"):
        print("check_absent.py: skipped: no valgrind here")
        sys.exit(77)
    chosen = build(arguments)
    unknown = subprocess.run([arguments.session, *OWN, OTHER], env=environment(chosen),
                             capture_output=True, text=True)
    if unknown.returncode == 0 or f"unknown effect '{OTHER}'" not in unknown.stderr:
        fail(f"the small library was not used: {unknown.stdout}{unknown.stderr}")
    n_full, printed_full = count(arguments, arguments.full, OWN)
    n_chosen, printed_chosen = count(arguments, chosen, OWN)
    n_more, printed_more = count(arguments, arguments.full, [*OWN, OTHER])
    print(f"instructions: {n_full} with the whole table, {n_chosen} with the session's effects, "
          f"{n_more} with {OTHER} as well; bytes: {printed_full[0]}, {printed_chosen[0]}, "
          f"{printed_more[0]}")
    if printed_full != printed_chosen:
        fail(f"state bytes and forces differ: {printed_full}, {printed_chosen}")
    if abs(n_full - n_chosen) > SHARE * n_chosen:
        fail("the instructions differ by more than 0.5 %")
    if n_more <= (1.0 + SHARE) * n_full or int(printed_more[0]) <= int(printed_full[0]):
        fail("the count does not see an effect that is there")


main()
