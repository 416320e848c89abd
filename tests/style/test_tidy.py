# SPDX-License-Identifier: MIT
"""clang-tidy finds no bug in protocol, server and renderer."""

import concurrent.futures
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

import sources

TIDY = shutil.which("clang-tidy")
FOLDERS = {"protocol", "server", "renderer"}


def compiled_files(database):
    """The C and C++ files of the judged folders that the build compiles."""
    with open(database / "compile_commands.json", encoding="utf-8") as stream:
        paths = {pathlib.Path(entry["file"]) for entry in json.load(stream)}
    inside = [path for path in paths if path.is_relative_to(sources.root())]
    return sorted(str(path) for path in inside
                  if path.relative_to(sources.root()).parts[0] in FOLDERS and path.exists())


def findings(database, name):
    done = subprocess.run([TIDY, "--quiet", "-p", str(database), name], cwd=sources.root(),
                          capture_output=True, text=True, check=False)
    told = [line for line in done.stdout.splitlines()
            if ": error: " in line or ": warning: " in line]
    if done.returncode != 0 and not told:
        told = [f"{name}: clang-tidy failed: {done.stderr.strip()[-300:]}"]
    return told


class Tidy(unittest.TestCase):
    def test_clang_tidy_finds_nothing(self):
        database = sources.build_dir()
        names = compiled_files(database)
        self.assertGreater(len(names), 10, "the compilation database must name the sources")
        with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            told = {line for lines in pool.map(lambda name: findings(database, name), names)
                    for line in lines}
        self.assertEqual([], sorted(told), "\n" + "\n".join(sorted(told)))

    def test_a_planted_bug_is_caught(self):
        with tempfile.TemporaryDirectory() as folder:
            source = pathlib.Path(folder) / "planted.c"
            source.write_text("#include <stdlib.h>\nint f(void);\nint f(void)\n{\n"
                              "    int *p = malloc(4);\n    free(p);\n    return *p;\n}\n")
            command = {"directory": folder, "file": str(source), "command": f"cc -c {source}"}
            (pathlib.Path(folder) / "compile_commands.json").write_text(json.dumps([command]))
            shutil.copy(sources.root() / ".clang-tidy", folder)
            self.assertNotEqual([], findings(pathlib.Path(folder), str(source)))


if __name__ == "__main__":
    if not TIDY:
        print("skipped: clang-tidy is not installed")
        sys.exit(sources.SKIPPED_EXIT_CODE)
    sources.run_tests(__name__)
