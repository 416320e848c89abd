# SPDX-License-Identifier: MIT
"""clang-tidy finds no bug in protocol, server and renderer.

A file that was found clean is not judged again while its preprocessed text, its command, the
configuration and clang-tidy stay what they were: the build folder keeps the hashes of clean files
($TIDY_CLEAN_DIR names another folder, which checkouts may share)."""

import concurrent.futures
import hashlib
import json
import os
import pathlib
import shlex
import shutil
import subprocess
import sys
import tempfile
import unittest

import sources

TIDY = sources.clang_tool("clang-tidy")
FOLDERS = {"protocol", "server", "renderer"}


def compiled_files(database):
    """{path: its command} of the C and C++ files of the judged folders that the build compiles."""
    with open(database / "compile_commands.json", encoding="utf-8") as stream:
        entries = json.load(stream)
    root = sources.root()
    return {entry["file"]: entry for entry in entries
            if pathlib.Path(entry["file"]).is_relative_to(root)
            and pathlib.Path(entry["file"]).relative_to(root).parts[0] in FOLDERS
            and pathlib.Path(entry["file"]).exists()}


def options_of(entry):
    """The compiler and its options, without what is written where."""
    words = shlex.split(entry["command"])
    for option, count in (("-o", 2), ("-MF", 2), ("-MT", 2), ("-MD", 1), ("-c", 1)):
        while option in words:
            at = words.index(option)
            del words[at:at + count]
    return words


def key_of(entry):
    """Hash of all that decides the verdict of a file; comments too, for they may silence one.
    None when the file cannot be preprocessed."""
    words = options_of(entry)
    done = subprocess.run([*words, "-E", "-C"], cwd=entry["directory"], capture_output=True,
                          check=False)
    if done.returncode != 0:
        return None
    root = os.fsencode(str(sources.root()))
    version = subprocess.run([TIDY, "--version"], capture_output=True, check=True).stdout
    text = b"\0".join([version, (sources.root() / ".clang-tidy").read_bytes(),
                       os.fsencode(" ".join(words)), done.stdout]).replace(root, b".")
    return hashlib.sha256(text).hexdigest()


def findings_unless_clean(entry, clean):
    """What clang-tidy finds in the file, which is nothing where `clean` has its key."""
    key = key_of(entry)
    if key and (clean / key).exists():
        return []
    told = findings(entry)
    if key and not told:
        (clean / key).touch()
    return told


def findings(entry):
    """What clang-tidy says of the file under the options of this one command: it goes wrong over
    a file that two targets compile."""
    done = subprocess.run([TIDY, "--quiet", entry["file"], "--", *options_of(entry)[1:]],
                          cwd=entry["directory"], capture_output=True, text=True, check=False)
    told = [line for line in done.stdout.splitlines()
            if ": error: " in line or ": warning: " in line]
    if done.returncode != 0 and not told:
        told = [f"{entry['file']}: clang-tidy failed: {done.stderr.strip()[-300:]}"]
    return told


class Tidy(unittest.TestCase):
    def test_clang_tidy_finds_nothing(self):
        database = sources.build_dir()
        entries = compiled_files(database).values()
        self.assertGreater(len(entries), 10, "the compilation database must name the sources")
        clean = pathlib.Path(os.environ.get("TIDY_CLEAN_DIR") or database / "tidy_clean")
        clean.mkdir(parents=True, exist_ok=True)
        with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
            judged = pool.map(lambda entry: findings_unless_clean(entry, clean), entries)
            told = {line for lines in judged for line in lines}
        self.assertEqual([], sorted(told), "\n" + "\n".join(sorted(told)))

    def test_a_planted_bug_is_caught(self):
        with tempfile.TemporaryDirectory() as folder:
            source = pathlib.Path(folder) / "planted.c"
            source.write_text("#include <stdlib.h>\nint f(void);\nint f(void)\n{\n"
                              "    int *p = malloc(4);\n    free(p);\n    return *p;\n}\n")
            entry = {"directory": folder, "file": str(source), "command": f"cc -c {source}"}
            (pathlib.Path(folder) / "compile_commands.json").write_text(json.dumps([entry]))
            shutil.copy(sources.root() / ".clang-tidy", folder)
            clean = pathlib.Path(folder) / "clean"
            clean.mkdir()
            for _ in range(2):  # a file with a finding is judged again each time
                self.assertNotEqual([], findings_unless_clean(entry, clean))
            self.assertEqual([], os.listdir(clean))

    def test_a_clean_file_is_judged_again_when_its_text_changes(self):
        with tempfile.TemporaryDirectory() as folder:
            source = pathlib.Path(folder) / "file.c"
            entry = {"directory": folder, "file": str(source), "command": f"cc -c {source}"}
            keys = set()
            for text in ("int a;\n", "int b;\n", "int b; // NOLINT\n", "int a;\n"):
                source.write_text(text)
                keys.add(key_of(entry))
            self.assertEqual(3, len(keys))
            self.assertNotIn(None, keys)


if __name__ == "__main__":
    if not TIDY:
        print(f"skipped: no clang-tidy {sources.CLANG_VERSION}; others judge otherwise")
        sys.exit(sources.SKIPPED_EXIT_CODE)
    sources.run_tests(__name__)
