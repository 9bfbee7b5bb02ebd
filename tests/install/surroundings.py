# SPDX-License-Identifier: BSD-3-Clause
"""Running programs as on a machine that knows nothing of this build."""
import os
import subprocess
import sys

HIDDEN = ("DESTDIR", "LD_LIBRARY_PATH", "LIBRARY_PATH", "CPATH", "C_INCLUDE_PATH",
          "CPLUS_INCLUDE_PATH", "CMAKE_PREFIX_PATH", "PKG_CONFIG_PATH", "PKG_CONFIG_LIBDIR",
          "CFLAGS", "CXXFLAGS", "CPPFLAGS", "LDFLAGS", "shcd_DIR", "shcd_ROOT")


def clean_environment(**more):
    kept = {name: value for name, value in os.environ.items() if name not in HIDDEN}
    return {**kept, **more}


def run(command, environment, text=None):
    """Returns the output; ends the test with it if the command fails."""
    done = attempt(command, environment, text)
    if done.returncode != 0:
        print(done.stdout)
        sys.exit(f"{' '.join(map(str, command))}: exit status {done.returncode}")
    return done.stdout


def attempt(command, environment, text=None):
    return subprocess.run(list(map(str, command)), env=environment, input=text, text=True,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, check=False)
