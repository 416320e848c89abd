# SPDX-License-Identifier: MIT
"""Writes the table of the GL functions that the sources call, for the test rig's hooks.

usage: gl_table.py EPOXY_HEADER OUT_HEADER SOURCE...

Each function of libepoxy's header (epoxy/gl_generated.h) that a source calls as glName(, or that
the hooks name as next.Name(, gl->Name( or HOOK(Name), becomes a row of a macro that C files expand.
"""

import pathlib
import re
import sys

DECLARATION = re.compile(
    r"EPOXY_PUBLIC\s+(?P<ret>[\w\s*]+?)\s*\(EPOXY_CALLSPEC\s*\*\s*epoxy_gl(?P<name>[A-Z]\w*)\)"
    r"\((?P<params>[^;]*)\);")
CALL = re.compile(r"\b(?:gl|(?:next|gl)(?:\.|->)|HOOK\()([A-Z]\w*)\s*[()]")
PARAMETER_NAME = re.compile(r"(\w+)\s*(?:\[[^\]]*\])?$")


def arguments(params):
    """The names of the parameters, ready for a call."""
    if params.strip() == "void":
        return ""
    return ", ".join(PARAMETER_NAME.search(param.strip())[1] for param in params.split(","))


def rows(header, names):
    """(kind, name, return type, parameters, arguments) of each name that the header declares."""
    found = []
    for match in DECLARATION.finditer(header):
        if match["name"] in names:
            kind = "VOID" if match["ret"] == "void" else "VALUE"
            found.append((kind, match["name"], match["ret"], match["params"],
                          arguments(match["params"])))
    return sorted(found, key=lambda row: row[1])


def called(texts):
    """The names, without gl, that the sources call."""
    return {name for text in texts for name in CALL.findall(text)}


def table(found):
    """The C header."""
    lines = ["/* Made by gl_table.py: VOID or VALUE(type, name, parameters, arguments)"
             " of each GL function that is called. */",
             "#define GL_TABLE(VOID, VALUE) \\"]
    lines += [f"    {kind}({ret}, {name}, ({params}), ({args})) \\"
              for kind, name, ret, params, args in found]
    return "\n".join(lines) + "\n\n"


def main():
    header, out = pathlib.Path(sys.argv[1]).read_text(), pathlib.Path(sys.argv[2])
    names = called(pathlib.Path(source).read_text() for source in sys.argv[3:])
    text = table(rows(header, names))
    if not out.exists() or out.read_text() != text:
        out.write_text(text)


if __name__ == "__main__":
    main()
