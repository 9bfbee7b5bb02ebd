# SPDX-License-Identifier: BSD-3-Clause
"""test_reference.py DOXYGEN DOXYFILE: a warning fails, and so does a function, type or enumeration
of a public header without words. Left out are vec.h, whose names say it, and fields."""
import glob
import os
import subprocess
import sys
import tempfile
import xml.etree.ElementTree

SILENT = "vec.h"


def is_described(element):
    return any("".join(element.find(part).itertext()).strip()
               for part in ("briefdescription", "detaileddescription"))


def undescribed(folder):
    """(how many were looked at, names of those without a description)"""
    count, names = 0, []
    for file in glob.glob(os.path.join(folder, "xml", "*.xml")):
        for compound in xml.etree.ElementTree.parse(file).iter("compounddef"):
            if compound.get("kind") not in ("struct", "file"):
                continue
            place = compound.find("location").get("file")
            elements = [(compound, compound.findtext("compoundname"))]
            if compound.get("kind") == "file" and os.path.basename(place) != SILENT:
                elements += [(member, member.findtext("name"))
                             for member in compound.iter("memberdef")
                             if member.get("kind") in ("function", "typedef", "enum")]
            count += len(elements)
            names += [f"{place}: {name}" for element, name in elements
                      if not is_described(element)]
    return count, sorted(set(names))


def main():
    program, doxyfile = sys.argv[1:]
    if not os.path.isfile(program):
        print("doxygen is not installed (or was not when the build was configured)")
        sys.exit(77)
    with tempfile.TemporaryDirectory() as folder:
        with open(os.path.join(folder, "Doxyfile"), "w", encoding="utf8") as file:
            file.write(f"@INCLUDE = {doxyfile}\nOUTPUT_DIRECTORY = {folder}\n"
                       "GENERATE_XML = YES\n")
        run = subprocess.run([program, file.name], stdout=subprocess.PIPE,
                             stderr=subprocess.STDOUT, text=True, check=False)
        if run.returncode != 0 or run.stdout:
            sys.exit(f"{run.stdout}doxygen ended with status {run.returncode}")
        count, names = undescribed(folder)
    if names or count < 50:
        sys.exit("\n".join(["no description:", *names, f"{count} names looked at"]))
    print(f"{count} headers, functions and types are described")


if __name__ == "__main__":
    main()
