# SPDX-License-Identifier: MIT
"""clang-tidy finds no bug in protocol, server and renderer.

    tests/style/test_tidy.py ROOT BUILD [--analyze]

Nine tenths of its time are the analyzer's, which follows paths through a program. The file
`analyzed` names a commit in which the analyzer found nothing. Files whose text or whose headers of
ours differ from that commit are analyzed, and all of them where .clang-tidy differs or the history
lacks the commit; the other checks judge every file. With --analyze the analyzer goes over every
file, and writes the commit anew when it found nothing.

A file that was analyzed and found clean is not judged again while its preprocessed text, its
command, the configuration and clang-tidy stay what they were: the build folder keeps the hashes of
clean files ($TIDY_CLEAN_DIR names another folder, which checkouts may share)."""

import concurrent.futures
import hashlib
import json
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import unittest

import sources

TIDY = sources.clang_tool("clang-tidy")
FOLDERS = {"protocol", "server", "renderer"}
CONFIGURATION = ".clang-tidy"
ANALYZED = pathlib.PurePosixPath("tests/style/analyzed")
COMPILER = "clang-diagnostic-*"  # without it -Werror counts only where no analyzer runs
USE_AFTER_FREE = "int *p = malloc(4);\n    free(p);\n    return *p;"  # the analyzer sees it
INCLUDE = re.compile(r'^\s*#\s*include\s+"([^"]+)"', re.M)


def git(root, *words):
    """What git prints, or None where it fails."""
    done = subprocess.run(["git", "-C", str(root), *words], capture_output=True, text=True,
                          check=False)
    return done.stdout if done.returncode == 0 else None


def changed_since(root, commit):
    """Paths that differ in the working tree; None where the history lacks the commit."""
    if not commit or git(root, "merge-base", "--is-ancestor", commit, "HEAD") is None:
        return None
    told = (git(root, "diff", "--name-only", "--no-renames", "-z", commit)
            + git(root, "ls-files", "--others", "--exclude-standard", "-z"))
    return {name for name in told.split("\0") if name}


def includes(root, path):
    """Headers of ours that the text of a file below root names."""
    text = (root / path).read_text(encoding="utf-8")
    places = [place for name in INCLUDE.findall(text)
              for place in (pathlib.Path(name), path.parent / name)]
    return [place for place in places if (root / place).is_file()]


def to_analyze(root, paths):
    """Those of the files below root that the analyzer has to judge."""
    commit = (root / ANALYZED).read_text().strip() if (root / ANALYZED).exists() else ""
    changed = changed_since(root, commit)
    if changed is None or CONFIGURATION in changed:
        return set(paths)
    direct = {}  # file: what it includes

    def differs(path):
        reached, left = {path}, [path]
        while left:
            here = left.pop()
            if str(here) in changed:
                return True
            if here not in direct:
                direct[here] = includes(root, here)
            left += set(direct[here]) - reached
            reached.update(direct[here])
        return False

    return {path for path in paths if differs(path)}


def compiled_files(database):
    """{path below root: its command} of what the build compiles in the judged folders."""
    with open(database / "compile_commands.json", encoding="utf-8") as stream:
        entries = json.load(stream)
    root = sources.root()
    files = {pathlib.Path(entry["file"]): entry for entry in entries}
    return {path.relative_to(root): entry for path, entry in files.items()
            if path.is_relative_to(root) and path.relative_to(root).parts[0] in FOLDERS
            and path.exists()}


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
    text = b"\0".join([version, (sources.root() / CONFIGURATION).read_bytes(),
                       os.fsencode(" ".join(words)), done.stdout]).replace(root, b".")
    return hashlib.sha256(text).hexdigest()


def findings_unless_clean(entry, clean):
    """What clang-tidy finds in the file, which is nothing where `clean` has its key."""
    key = key_of(entry)
    if key and (clean / key).exists():
        return []
    told = findings_with_analyzer(entry)
    if key and not told:
        (clean / key).touch()
    return told


def findings(entry, *options):
    """What clang-tidy says of the file under the options of this one command: it goes wrong over
    a file that two targets compile."""
    done = subprocess.run([TIDY, "--quiet", *options, entry["file"], "--", *options_of(entry)[1:]],
                          cwd=entry["directory"], capture_output=True, text=True, check=False)
    told = [line for line in done.stdout.splitlines()
            if ": error: " in line or ": warning: " in line]
    if done.returncode != 0 and not told:
        told = [f"{entry['file']}: clang-tidy failed: {done.stderr.strip()[-300:]}"]
    return told


def findings_with_analyzer(entry):
    return findings(entry, f"--checks={COMPILER}")


def findings_without_analyzer(entry):
    return findings(entry, f"--checks={COMPILER},-clang-analyzer-*")


def judge(entries, analyzed):
    """Sorted findings of all files {path: command}, of the analyzer only in those `analyzed`."""
    clean = pathlib.Path(os.environ.get("TIDY_CLEAN_DIR") or sources.build_dir() / "tidy_clean")
    clean.mkdir(parents=True, exist_ok=True)
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        told = pool.map(lambda path: findings_unless_clean(entries[path], clean)
                        if path in analyzed else findings_without_analyzer(entries[path]), entries)
        return sorted({line for lines in told for line in lines})


def analyze_everything():
    """Writes the commit at hand into `analyzed` where no file has a finding."""
    root = sources.root()
    judged = [*sorted(FOLDERS), "glb", "shaders", CONFIGURATION]
    if git(root, "status", "--porcelain", "--", *judged) != "":
        sys.exit("--analyze: commit first; the commit is named as the one that was analyzed")
    commit = git(root, "rev-parse", "HEAD")
    entries = compiled_files(sources.build_dir())
    told = judge(entries, set(entries))
    if told:
        sys.exit("\n".join(told))
    if git(root, "diff", "--name-only", commit.strip(), "--", *judged) != "":
        sys.exit("--analyze: files changed meanwhile; run it again")
    (root / ANALYZED).write_text(commit)
    print(f"{len(entries)} files analyzed; {ANALYZED} names {commit.strip()}: commit it")


def planted(folder, body):
    """The command of a file below `folder` with a function of that body."""
    source = pathlib.Path(folder) / "planted.c"
    source.write_text(f"#include <stdlib.h>\nint f(void);\nint f(void)\n{{\n    {body}\n}}\n")
    shutil.copy(sources.root() / CONFIGURATION, folder)
    return {"directory": folder, "file": str(source), "command": f"cc -c {source}"}


class Tidy(unittest.TestCase):
    def test_clang_tidy_finds_nothing(self):
        entries = compiled_files(sources.build_dir())
        self.assertGreater(len(entries), 10, "the compilation database must name the sources")
        analyzed = to_analyze(sources.root(), set(entries))
        print(f"{len(analyzed)} of {len(entries)} files analyzed")
        told = judge(entries, analyzed)
        self.assertEqual([], told, "\n" + "\n".join(told))

    def test_a_planted_bug_is_caught(self):
        with tempfile.TemporaryDirectory() as folder:
            entry = planted(folder, USE_AFTER_FREE)
            clean = pathlib.Path(folder) / "clean"
            clean.mkdir()
            for _ in range(2):  # a file with a finding is judged again each time
                self.assertNotEqual([], findings_unless_clean(entry, clean))
            self.assertEqual([], os.listdir(clean))

    def test_checks_other_than_the_analyzer_judge_every_file(self):
        with tempfile.TemporaryDirectory() as folder:
            self.assertEqual([], findings_without_analyzer(planted(folder, USE_AFTER_FREE)))
            told = findings_without_analyzer(planted(folder, "if (rand()); return 1;"))
            self.assertIn("bugprone-suspicious-semicolon", "".join(told))

    def test_warnings_of_the_compiler_are_findings_with_and_without_the_analyzer(self):
        with tempfile.TemporaryDirectory() as folder:
            entry = planted(folder, "return (rand() > 1) & (rand() < 3) ? 4 : 5;")
            entry["command"] = entry["command"].replace("cc ", "cc -Wall ")
            for judged in (findings_with_analyzer, findings_without_analyzer):
                self.assertIn("bitwise-conditional-parentheses", "".join(judged(entry)))

    def test_files_are_analyzed_whose_text_or_headers_changed(self):
        def below(*names):
            return {pathlib.Path("server", name) for name in names}

        paths = below("a.c", "b.c", "c.c")
        texts = {"a.c": '#include "a.h"\n', "a.h": f'#include "{below("base.h").pop()}"\n',
                 "base.h": "\n", "b.c": "int b;\n", "c.c": "int c;\n"}
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            (root / "server").mkdir()
            (root / ANALYZED).parent.mkdir(parents=True)
            (root / ANALYZED).write_text("no commit\n")
            (root / CONFIGURATION).write_text("\n")
            for name, text in texts.items():
                (root / "server" / name).write_text(text)
            self.assertEqual(paths, to_analyze(root, paths), "no repository")
            for words in (["init", "-q"], ["add", "."], ["-c", "user.name=a", "-c",
                          "user.email=a@b", "commit", "-q", "-m", "a"]):
                self.assertIsNotNone(git(root, *words))
            self.assertEqual(paths, to_analyze(root, paths), "a commit that the history lacks")
            (root / ANALYZED).write_text(git(root, "rev-parse", "HEAD"))
            self.assertEqual(set(), to_analyze(root, paths))
            (root / "server" / "base.h").write_text("int base;\n")
            (root / "server" / "b.c").write_text("int other;\n")
            self.assertEqual(below("a.c", "b.c"), to_analyze(root, paths))
            (root / "server" / "d.c").write_text("int new;\n")
            self.assertEqual(below("d.c"), to_analyze(root, below("c.c", "d.c")))
            (root / CONFIGURATION).write_text("Checks: '*'\n")
            self.assertEqual(paths, to_analyze(root, paths))

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
    if sys.argv[3:] == ["--analyze"]:
        analyze_everything()
    else:
        sources.run_tests(__name__)
