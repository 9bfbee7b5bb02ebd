# SPDX-License-Identifier: BSD-3-Clause
"""What the public headers declare, read with regular expressions: enough for their plain style (no
nested structures, one typedef for each), and loud where that no longer holds."""
import re
from pathlib import Path


def strip(text):
    """Without comments and preprocessor lines."""
    text = re.sub(r"/\*.*?\*/", " ", text, flags=re.S)
    text = re.sub(r"//[^\n]*", " ", text)
    return re.sub(r"^[ \t]*#(?:[^\n\\]|\\.)*(?:\\\n(?:[^\n\\]|\\.)*)*", "", text, flags=re.M)


def headers(include_dir):
    return sorted(Path(include_dir, "shcd").glob("*.h"))


def member_names(body):
    """{ size_t a; double b[3], c; void (*f)(int x); } -> a b c f"""
    for declaration in body.split(";"):
        pointer_to_function = re.search(r"\(\s*\*\s*(\w+)\s*\)\s*\(", declaration)
        if pointer_to_function:
            yield pointer_to_function.group(1)
            continue
        for declarator in declaration.split(","):
            name = re.search(r"(\w+)\s*(?:\[[^\]]*\]\s*)*$", declarator.strip())
            if name:
                yield name.group(1)


def structs(text):
    """[(name, [member, ...]), ...] of the complete structures, in order."""
    text = strip(text)
    found = re.findall(r"typedef\s+struct\s+(\w+)\s*\{([^{}]*)\}\s*(\w+)\s*;", text)
    if len(found) != len(re.findall(r"\b(?:struct|union)\b[^;(){}]*\{", text)):
        raise SystemExit("a structure that is not `typedef struct name { ... } name;`")
    for tag, _, name in found:
        if tag != name:
            raise SystemExit(f"struct {tag} is called {name}: one name for both, please")
    return [(name, list(member_names(body))) for _, body, name in found]


def enumerators(text):
    """[(enum, [enumerator, ...]), ...]"""
    found = re.findall(r"typedef\s+enum\s+(\w+)\s*\{(.*?)\}\s*\w+\s*;", strip(text), re.S)
    return [(name, re.findall(r"\b(SHCD_\w+)\b\s*(?:=|,|$)", body)) for name, body in found]


def initialisers(text):
    """Names of the macros that initialise a structure: [(structure, macro), ...]."""
    names = re.findall(r"^#define\s+(SHCD_\w+_INIT)\b(?!\()", text, re.M)
    return [(name[: -len("_INIT")].lower(), name) for name in names]


def limits(text):
    """Names of the macros that callers size their arrays by."""
    return re.findall(r"^#define\s+(SHCD_\w+_MAX)\s+\d+u?\s*$", text, re.M)


def functions(text):
    """Names of the exported functions."""
    return re.findall(r"\bSHCD_API\b[^;{]*?\b(shcd_\w+)\s*\(", strip(text))
