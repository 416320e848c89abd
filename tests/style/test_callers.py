# SPDX-License-Identifier: MIT
"""Every function that a header of the product declares is called by another file of the product
than the one that defines it. What tests alone call belongs into tests/support; what its own file
alone calls is static, unless tests ask it, too."""

import collections
import pathlib
import re
import unittest

import sources

DECLARING = {"renderer", "server", "protocol"}
CALLING = DECLARING | {"clients", "glb"}

# Functions that stand in a header without such a caller, and why.
ENTRY = "found by its name in a module that is loaded"
SEAM = "its own file calls it, and a test asks it alone: "
ARGUED = {
    "oiio_get_functions": ENTRY,
    "converter_get_functions": ENTRY,
    "auto_fastest": SEAM + "a picture shows one choice of many",
    "choice_row_fits": SEAM + "a choice shows one row of many",
    "deep_statistics_room": SEAM + "too little room shows as a list that is cut",
    "device_speed_load": SEAM + "a file that is not read shows as a second measurement",
    "device_speed_save": SEAM + "a file that is not written shows as a second measurement",
    "frame_stats_warn": SEAM + "no frame has more warnings than there is room for",
    "rt_sheen_albedo": SEAM + "in a picture the albedo is one factor of many",
}

COMMENT = re.compile(r'/\*.*?\*/|//[^\n]*|"(?:\\.|[^"\\\n])*"', re.DOTALL)
DIRECTIVE = re.compile(r"^[ \t]*#(?:\\\n|[^\n])*", re.MULTILINE)
LINKAGE = re.compile(r'extern\s*\{')
WORD = re.compile(r"[A-Za-z_]\w*")
# the name before the first parenthesis that is no macro's
NAME = re.compile(r"\b([a-z_]\w*)\s*\(")


def stripped(text):
    """C without comments and strings, directives kept (macros call functions, too)."""
    return COMMENT.sub(" ", text)


def at_top_level(text):
    """The statements outside of braces; a body leaves `{}`."""
    text = LINKAGE.sub(" ", DIRECTIVE.sub("", stripped(text)))
    depth, statement, found = 0, [], []
    for piece in re.split(r"([{};])", text):
        if piece == "{":
            depth += 1
        elif piece == "}":
            depth = max(0, depth - 1)
            if depth == 0 and NAME.search("".join(statement)):
                found.append("".join(statement) + "{}")
                statement = []
        elif piece == ";" and depth == 0:
            found.append("".join(statement))
            statement = []
        elif depth == 0:
            statement.append(piece)
    return found


def function_of(statement):
    """The function that a statement declares or defines, or None."""
    if "=" in statement.split("(")[0] or re.match(r"\s*(typedef|static_assert|_Static_assert)\b",
                                                  statement):
        return None
    call = NAME.search(statement)
    return call[1] if call and statement[:call.start()].strip() else None


def declared(text):
    """The functions that a header declares, inline ones included."""
    return {name for name in map(function_of, at_top_level(text)) if name}


def defined(text):
    return {name for name in map(function_of, (s for s in at_top_level(text) if s.endswith("{}")))
            if name}


def without_callers(texts):
    """{function: header} of a product: {path: text}."""
    users = collections.defaultdict(set)
    definers = collections.defaultdict(set)
    for path, text in texts.items():
        for word in WORD.findall(stripped(text)):
            users[word].add(path)
        for name in defined(text):
            definers[name].add(path)
    names = {path: declared(text) for path, text in texts.items() if path.suffix == ".h"}
    found = {}
    for path, text in texts.items():
        if path.suffix != ".h" or path.parts[0] not in DECLARING:
            continue
        for name in names[path]:
            declaring = {other for other in users[name] if name in names.get(other, ())}
            again = len(re.findall(rf"\b{name}\b", stripped(text))) > 1  # in a macro, or inline
            if not again and not users[name] - declaring - definers[name]:
                found[name] = path
    return found


class Callers(unittest.TestCase):
    def test_every_declared_function_has_a_caller(self):
        texts = {path: sources.read(path) for path in sources.files()
                 if path.suffix in sources.C_SUFFIXES and path.parts[0] in CALLING}
        self.assertGreater(len(texts), 200, "the sources must have been found")
        found = without_callers(texts)
        self.assertEqual([], sorted(f"{path}: {name}" for name, path in found.items()
                                    if name not in ARGUED))
        self.assertEqual([], sorted(ARGUED.keys() - found.keys()), "argued for without need")

    def test_planted_functions_are_seen(self):
        header, source, other = (pathlib.PurePosixPath(f"renderer/{name}")
                                 for name in ("a.h", "a.c", "b.c"))
        texts = {header: """
#include <x.h>
/* lone(1); called(2) */
MUST_CHECK bool lone(const struct thing *thing,
                     struct error *err);
int called(void) __attribute__((pure));
struct thing { int (*member)(int); };
static inline int inlined(int x) { return x; }
enum { MOST = 3 };
""", source: 'bool lone(const struct thing *t, struct error *e)\n{\n    return lone(t, e);\n}\n',
                 other: 'int main(void)\n{\n    return called() + "lone()"[0]; // lone()\n}\n'}
        self.assertEqual({"lone", "inlined"}, set(without_callers(texts)))


if __name__ == "__main__":
    sources.run_tests(__name__)
