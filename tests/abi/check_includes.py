#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Who includes whom: base < model < query < response inside libshcd; everybody else sees it through
public headers, and LCM is known to the daemon and the clients only."""
import re
import sys
from pathlib import Path

# Folders of libshcd in their order, each with the public headers that appear at its level.
LEVELS = {
    "base": {"base.h", "vec.h"},
    "model": {"learned.h", "model.h", "map.h"},
    "query": {"query.h", "accuracy.h", "shape.h", "tool.h", "sweep.h", "pair.h"},
    "response": {"energy.h", "scene.h"},
}
STANDARD = set("assert complex ctype errno fenv float inttypes iso646 limits locale math setjmp "
               "signal stdalign stdarg stdatomic stdbool stddef stdint stdio stdlib stdnoreturn "
               "string tgmath threads time uchar wchar wctype".split())
# The standard headers that a library without state, locale or streams has no use for.
RUN_TIME = STANDARD - set("locale setjmp signal stdatomic threads time wchar".split())
# What single files may include beyond the rule of their folder.
BEYOND = {
    "libshcd/model/model_file.c": {"zlib.h"},
    "libshcd/query/tool_cull.c": {"ccd/ccd.h"},
    # instructions that vector types have no operator for
    "libshcd/model/scan_kernel.h": {"immintrin.h"},
    "libshcd/model/surface_kernel.h": {"immintrin.h"},
    "tools/cost_plot.c": {"cost_plot_script.h"},  # made from cost_plot.gp
    # one table of options feeds --help, man pages and completion of both programs
    "daemon/options_help.h": {"tools/help.h"},
    # a cost table names its machine in one way, whoever measured it
    "daemon/cost_quick.c": {"tools/cost_machine.h"},
    "tools/man_page.c": {"daemon/options_help.h"},
    "tools/completion.c": {"daemon/options_help.h"},
}


def includes(path):
    for number, line in enumerate(path.read_text().splitlines(), 1):
        found = re.match(r"\s*#\s*include\s*([<\"])([^>\"]+)[>\"]", line)
        if found:
            yield number, found.group(1) == "<", found.group(2)


def sources(folder):
    return sorted(path for path in folder.rglob("*") if path.suffix in (".c", ".h"))


class Check:
    def __init__(self, root):
        self.root = root
        self.failures = []
        self.files = 0

    def each(self, folder, allowed):
        """allowed(name, is_system) says whether a file of this folder may include that name."""
        for path in sources(folder):
            self.files += 1
            where = path.relative_to(self.root).as_posix()
            for number, is_system, name in includes(path):
                if not allowed(name, is_system) and name not in BEYOND.get(where, ()):
                    self.failures.append(f"{where}:{number}: must not include {name}")

    def library_folder(self, level):
        names = list(LEVELS)[: level + 1]
        public = set().union(*(LEVELS[name] for name in names))

        def allowed(name, is_system):
            if is_system:
                return name[: -len(".h")] in RUN_TIME
            folder, _, rest = name.partition("/")
            return rest in public if folder == "shcd" else folder in names

        self.each(self.root / "libshcd" / names[-1], allowed)

    def neighbour(self, folder, refused_systems=r"$^"):
        """A folder that knows its own files, generated messages, and libshcd's public headers."""
        own = {path.name for path in sources(folder)}
        public = {f"shcd/{path.name}" for path in sources(self.root / "include/shcd")}

        def allowed(name, is_system):
            if is_system:
                return not re.match(refused_systems, name)
            return name in own | public or re.match(r"shcdmsg_\w+\.h$", name) is not None

        self.each(folder, allowed)

    def public(self):
        """fit.h stands apart: no other public header draws it in."""
        own = {f"shcd/{path.name}" for path in sources(self.root / "include/shcd")} - {"shcd/fit.h"}

        def allowed(name, is_system):
            return name[: -len(".h")] in STANDARD if is_system else name in own

        self.each(self.root / "include/shcd", allowed)


def main():
    check = Check(Path(sys.argv[1]).resolve())
    known = {header for headers in LEVELS.values() for header in headers} | {"shcd.h", "fit.h"}
    for path in sources(check.root / "include/shcd"):
        if path.name not in known:
            check.failures.append(f"{path.name}: at which level? (LEVELS in check_includes.py)")
    check.public()
    for level in range(len(LEVELS)):
        check.library_folder(level)
    check.neighbour(check.root / "libshcd/fit", r"(lcm|shcd)/")
    check.neighbour(check.root / "tools", r"(lcm|shcd)/")
    check.neighbour(check.root / "daemon", r"(gsl|assimp|shcd)/|(fftw3|cholmod)\.h")
    check.neighbour(check.root / "clients", r"(gsl|assimp|shcd)/|(fftw3|cholmod)\.h")
    for name in sorted(path.name for path in (check.root / "libshcd").iterdir() if path.is_dir()):
        if name not in {*LEVELS, "fit"}:
            check.failures.append(f"libshcd/{name}: at which level? (LEVELS in check_includes.py)")
    print("\n".join(check.failures + [f"{check.files} files, {len(check.failures)} failures"]))
    return len(check.failures) > 0


if __name__ == "__main__":
    sys.exit(main())
