# SPDX-License-Identifier: MIT
"""The files of the project that are ours to judge, and how every style test is started."""

import os
import pathlib
import re
import shutil
import subprocess
import sys
import unittest

HERE = pathlib.Path(__file__).resolve().parent
C_SUFFIXES = {".c", ".h", ".cpp"}
CODE_SUFFIXES = C_SUFFIXES | {".glsl", ".py"}
SKIPPED_EXIT_CODE = 77
CLANG_VERSION = 14  # of clang-format and clang-tidy: each version formats and judges otherwise


def root():
    """The repository: the first argument of the test, or the one this file lies in."""
    return pathlib.Path(sys.argv[1]).resolve() if len(sys.argv) > 1 else HERE.parents[1]


def build_dir():
    """The build folder: the second argument of the test, or the release build."""
    return pathlib.Path(sys.argv[2]).resolve() if len(sys.argv) > 2 else root() / "build"


def files():
    """Every file of the project as a path relative to the root: what git tracks or would track."""
    listing = subprocess.run(
        ["git", "-C", str(root()), "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
        capture_output=True, check=False)
    if listing.returncode == 0:
        names = [name for name in listing.stdout.decode().split("\0") if name]
    else:  # a source archive, without git
        names = [os.path.relpath(os.path.join(folder, name), root())
                 for folder, _, entries in os.walk(root()) for name in entries]
    paths = sorted({pathlib.PurePosixPath(name) for name in names})
    return [path for path in paths
            if not path.parts[0].startswith("build") and (root() / path).is_file()]


def read(path):
    return (root() / path).read_text(encoding="utf-8")


def read_manual(name):
    return read(f"docs/{name}")


def clang_tool(name):
    """The tool in the version that judges here, or None."""
    for command in (f"{name}-{CLANG_VERSION}", name):
        path = shutil.which(command)
        told = path and subprocess.run([path, "--version"], capture_output=True, text=True,
                                       check=False).stdout
        if told and re.search(rf"version {CLANG_VERSION}\.", told):
            return path
    return None


def run_tests(module_name):
    """unittest.main with our own arguments taken out of its sight."""
    unittest.main(module=module_name, argv=sys.argv[:1], verbosity=2)
