# SPDX-License-Identifier: MIT
"""Sources that comments and manuals name exist, so that a move takes its mentions along."""

import pathlib
import re
import unittest

import sources

SUFFIXES = sources.CODE_SUFFIXES | {".md", ".txt", ".cmake"}

# With its ending or without: "server/base/ipc.h", "renderer/plan". Before a wildcard it is the
# folder ("renderer/*.c"), or the beginning of a name ("tests/unit/test_*.c").
PATH = re.compile(r"(?<![\w/.-])(?:server|renderer|protocol|shaders|glb|clients|tests|cmake)"
                  r"(?:/[a-z0-9_]+)+"
                  r"(?:\.(?:comp|frag|vert))?(?:\.(?:c|h|cpp|glsl|json|py|js)\b)?")

GENERATED = {"tests/support/gl_table.h"}

# what was, and what is planted
NOT_JUDGED = {"CHANGELOG.md", "tests/style/test_arrows.py", "tests/style/test_paths.py"}


def names_of(paths):
    """What may be named: files, with their endings and without, and folders."""
    names = set()
    for path in map(pathlib.PurePosixPath, paths):
        names |= {str(path), str(path).rsplit(".", 1)[0]} | {str(folder) for folder in path.parents}
    return names


def is_known(name, names):
    return name in names or (name.endswith("_") and any(one.startswith(name) for one in names))


def strays_of(path, text, names):
    return [f"{path}:{number}: {name}" for number, line in enumerate(text.splitlines(), 1)
            for name in PATH.findall(line) if not is_known(name, names)]


class Paths(unittest.TestCase):
    def test_every_source_that_is_named_exists(self):
        paths = sources.files()
        names = names_of(map(str, paths)) | GENERATED
        strays = []
        for path in paths:
            if path.suffix in SUFFIXES and str(path) not in NOT_JUDGED:
                strays += strays_of(path, sources.read(path), names)
        self.assertEqual([], strays, "\n" + "\n".join(strays))

    def test_planted_mentions(self):
        names = names_of(["server/base/ipc.h", "shaders/shading/aov.comp.glsl",
                          "renderer/plan/plan.c",
                          "renderer/plan/plan_cache.c"])
        for text in ("`server/base/ipc.h`", "server/base/ipc", "renderer/plan",
                     "shaders/shading/aov.comp.glsl", "renderer/plan/plan.c.", "renderer/*/a.h",
                     "renderer/plan/plan_*.c", "http://host/server/of/others"):
            self.assertEqual([], strays_of("a.md", text, names), text)
        for text in ("`server/ipc.h`", "renderer/plan/plan.h", "(server/base/child)"):
            self.assertEqual(1, len(strays_of("a.md", text, names)), text)


if __name__ == "__main__":
    sources.run_tests(__name__)
