# SPDX-License-Identifier: BSD-3-Clause
"""The manual against --help, the programs' own word.

pages       each command has a page, which lists just its options, with their arguments
groff       the formatter has nothing to say about any page
completion  bash offers just the commands and the options that there are
"""
import os
import re
import shutil
import subprocess
import sys

MAN_DIR = os.environ["MAN_DIR"]


def output(*command):
    return subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout


def subcommands():
    listed = re.search(r"(?ms)^commands:$(.*?)^$", output(os.environ["SHCD"], "--help"))
    return re.findall(r"(?m)^  (\S+)", listed.group(1))


def manual():
    """{page: --help of what it is about}, but for shcd(1)."""
    helps = {"shcd-" + name: output(os.environ["SHCD"], name, "--help") for name in subcommands()}
    if "SHCDD" in os.environ:
        helps["shcdd"] = output(os.environ["SHCDD"], "--help")
    return helps


def read(page):
    with open(os.path.join(MAN_DIR, page + ".1"), encoding="ascii") as file:
        return file.read()


def options_of(text):
    """The lines of --help that introduce an option, e.g. "-o, --output FILE"."""
    options = re.findall(r"(?m)^  ((?:-\w, )?--\S+(?: \S+)?)$", text)
    assert "-h, --help" in options, text
    return options


def same(what, found, expected):
    if sorted(found) != sorted(expected):
        sys.exit(f"{what}: {sorted(found)} are not {sorted(expected)}")


def pages():
    helps = manual()
    overview = read("shcd").replace("\\-", "-")
    same("shcd.1", re.findall(r"(?m)^\.BR (shcd-\S+) \(1\)$", overview),
         ["shcd-" + name for name in subcommands()])
    for page, text in helps.items():
        source = re.sub(r"\\f[BIR]", "", read(page)).replace("\\-", "-")
        listed = re.search(r"(?ms)^\.SH OPTIONS$(.*?)^\.SH", source).group(1)
        same(page + ".1", re.findall(r"(?m)^\.TP\n(.*)$", listed), options_of(text))
        synopsis = re.search(r"(?m)^\.SH SYNOPSIS\n\.B (.*)\n(.*)$", source).groups()
        same(page + ".1", [" ".join(synopsis)], re.findall(r"\Ausage: (.*)", text))


def groff():
    program = shutil.which("groff")
    if program is None:
        print("groff is not installed: the man pages were not formatted")
        sys.exit(77)
    for page in ["shcd", *manual()]:
        run = subprocess.run([program, "-man", "-ww", "-z", os.path.join(MAN_DIR, page + ".1")],
                             check=True, stderr=subprocess.PIPE, text=True)
        if run.stderr:
            sys.exit(run.stderr)


def offered(program, *words):
    """What bash offers behind these words, the last of which is being typed."""
    script = ('source "$0"; COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); "_$1"; '
              'printf "%s\\n" "${COMPREPLY[@]}"')
    file = os.path.join(os.environ["COMPLETION_DIR"], program)
    return output(shutil.which("bash"), "-c", script, file, program, *words).split()


def completion():
    if shutil.which("bash") is None:
        print("bash is not installed: its completions were not tried")
        sys.exit(77)
    same("shcd", offered("shcd", ""), [*subcommands(), "--help", "--version"])
    same("shcd qu", offered("shcd", "qu"), ["query"])
    for page, text in manual().items():
        words = page.split("-")
        options = [re.search("--[a-z-]+", option).group() for option in options_of(text)]
        same(page, offered(*words, "--"), options)
        same(page, offered(*words, "--he"), ["--help"])
        same(page, offered(*words, "body"), [])  # bash's own file names
    same("shcd unknown", offered("shcd", "unknown", "--"), [])


if __name__ == "__main__":
    {"pages": pages, "groff": groff, "completion": completion}[sys.argv[1]]()
