# SPDX-License-Identifier: BSD-3-Clause
"""What the real-time functions can reach: which functions outside the library, whether anything
recurs, and how much stack that can take.

The objects (compiled with -ffunction-sections -fstack-usage) are linked with the functions marked
SHCD_RT in the headers as roots and everything else swept away. Whatever a relocation of the rest
still names can be called or read in a tick; what is not there cannot. So it is a proof for this
build, not a sample of runs: no allocation, lock, print, system call, and no function of libm but
those allowed. shcd_effect_at is a root, so the effects behind function pointers are included.

Stack: nothing recurs, so what a function takes is bounded by the longest chain of frames that its
references lead to (of the compiled paths of one evaluation only one can be on it), and by that of
each table of functions on top, which calls by pointer can reach."""
import argparse
import re
import subprocess
import sys
import tempfile
from pathlib import Path

# libccd's intersection test: fixed memory, capped steps (tests/unit/test_tool_cull.c), and its first
# direction, a constant
ALLOWED = {"sqrt", "fabs", "memcpy", "memmove", "memset", "memcmp", "strcmp", "ccdGJKIntersect",
           "ccdFirstDirDefault"}
LINKER = {"_GLOBAL_OFFSET_TABLE_"}


def fail(message):
    sys.exit(f"tick_closure.py: {message}")


def run(*command):
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        fail(f"{command[0]}: {done.stderr.strip()}")
    return done.stdout


def real_time_functions(headers):
    names = set()
    for header in sorted(headers.glob("*.h")):
        text = re.sub(r"/\*.*?\*/", " ", header.read_text(), flags=re.DOTALL)
        text = re.sub(r"^#.*$", " ", text, flags=re.MULTILINE)
        for declaration in re.findall(r"\bSHCD_RT\b([^;]*);", text):
            names.add(re.search(r"\b(shcd_\w+)\s*\(", declaration).group(1))
    if "shcd_step" not in names or "shcd_closest" not in names:
        fail(f"the headers in {headers} mark no shcd_step or shcd_closest as SHCD_RT")
    return names


def link(objects, roots, out):
    defined = set(re.findall(r" T (\w+)$", run("nm", *objects), flags=re.MULTILINE))
    if roots - defined:
        fail(f"declared but not defined: {' '.join(sorted(roots - defined))}")
    wanted = [f"--undefined={name}" for name in sorted(roots)]
    run("ld", "-r", "--gc-sections", *wanted, "-o", out, *objects)


def references(linked):
    """Section -> names it refers to (of text sections the function's name stands for the section),
    and the functions that call themselves by a relocation."""
    graph, selfish, section = {}, [], None
    for line in run("objdump", "-r", linked).splitlines():
        head = re.match(r"RELOCATION RECORDS FOR \[(.*)\]", line)
        record = re.match(r"[0-9a-f]+ +(R_\w+) +(\S+)", line)
        if head:
            section = plain(head.group(1))
        elif record and section is not None and not section.startswith((".eh_frame", ".debug")):
            target = plain(re.sub(r"[-+]0x[0-9a-f]+$", "", record.group(2)))
            if target != section and section != f".rodata.{target}":  # a jump table of its own
                graph.setdefault(section, set()).add(target)
            elif re.search("PLT|CALL", record.group(1)):
                selfish.append(target)
    return graph, selfish


def plain(name):
    """Function of a section or symbol, without what compilers append to parts and clones."""
    name = re.sub(r"^\.text\.(unlikely\.|hot\.|startup\.)?", "", name)
    return re.sub(r"(\.(part|isra|constprop|cold)(\.\d+)?)+$", "", name)


def find_cycle(graph):
    """A chain of functions that leads back to its start, or None."""
    done, chain = set(), []

    def visit(name):
        if name in chain:
            return chain[chain.index(name):] + [name]
        if name in done:
            return None
        chain.append(name)
        for target in sorted(graph.get(name, ())):
            cycle = visit(target)
            if cycle:
                return cycle
        chain.pop()
        done.add(name)
        return None

    for start in sorted(graph):
        cycle = visit(start)
        if cycle:
            return cycle
    return None


def calls_itself(linked):
    """Functions with a call to their own start that needs no relocation."""
    found, function = [], None
    for line in run("objdump", "-d", "--no-show-raw-insn", linked).splitlines():
        head = re.match(r"[0-9a-f]+ <(.*)>:$", line)
        if head:
            function = head.group(1)
        elif function and re.search(rf"\t(call|bl)q?\s.*<{re.escape(function)}>$", line):
            found.append(function)
    return found


def frames(objects, functions):
    found = {}
    for listing in (Path(name).with_suffix(".su") for name in objects):
        for line in listing.read_text().splitlines():
            place, size, kind = line.split("\t")
            name = plain(place.split(":")[-1])
            if name in functions:
                if "dynamic" in kind and "bounded" not in kind:
                    fail(f"{name} has a frame without a fixed size")
                found[name] = found.get(name, 0) + int(size)
    return found


def chain(graph, sizes, name, known):
    """Bytes of the longest chain of frames from a function on; there is no cycle."""
    if name not in known:
        below = [chain(graph, sizes, target, known) for target in graph.get(name, ())]
        known[name] = sizes.get(name, 0) + max(below, default=0)
    return known[name]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--headers", type=Path, required=True)
    parser.add_argument("--stack-max", type=int, required=True, help="bytes")
    parser.add_argument("objects", nargs="+", help="FILE.o, with FILE.su beside it")
    arguments = parser.parse_args()
    roots = real_time_functions(arguments.headers)
    with tempfile.TemporaryDirectory() as folder:
        linked = str(Path(folder) / "tick.o")
        link(arguments.objects, roots, linked)
        graph, selfish = references(linked)
        selfish += calls_itself(linked)
        undefined = set(re.findall(r" U (\S+)$", run("nm", linked), flags=re.MULTILINE))
        functions = {plain(name) for name in
                     re.findall(r" [tT] (\S+)$", run("nm", linked), flags=re.MULTILINE)}
    outside = {name for targets in graph.values() for name in targets} & (undefined - LINKER)
    print(f"{len(roots)} real-time functions reach {len(functions)} functions; outside the "
          f"library: {' '.join(sorted(outside))}")
    if outside - ALLOWED:
        callers = {name: sorted(s for s, t in graph.items() if name in t)
                   for name in sorted(outside - ALLOWED)}
        fail(f"a tick can reach {callers}; allowed are {' '.join(sorted(ALLOWED))}")
    cycle = selfish or find_cycle(graph)
    if cycle:
        fail(f"recursion: {' -> '.join(cycle)}")
    sizes = frames(arguments.objects, functions)
    known = {}
    by_pointer = chain(graph, sizes, "shcd_effect_at", known)
    stack = {root: chain(graph, sizes, root, known) + by_pointer for root in roots}
    deepest = max(stack, key=stack.get)
    print(f"stack: shcd_step at most {stack['shcd_step']} bytes, {deepest} {stack[deepest]}")
    if stack[deepest] > arguments.stack_max:
        fail(f"{deepest} may take {stack[deepest]} bytes of stack, not {arguments.stack_max}")


main()
