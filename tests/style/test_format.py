# SPDX-License-Identifier: MIT
"""clang-format would change nothing in C and C++."""

import re
import subprocess
import sys
import unittest

import sources

FORMATTER = sources.clang_tool("clang-format")


class Format(unittest.TestCase):
    def test_every_file_is_as_clang_format_writes_it(self):
        names = [str(path) for path in sources.files() if path.suffix in sources.C_SUFFIXES]
        self.assertGreater(len(names), 20, "the scanner must have found the sources")
        done = subprocess.run([FORMATTER, "--dry-run", "-Werror", *names], cwd=sources.root(),
                              capture_output=True, text=True, check=False)
        faults = [line for line in done.stderr.splitlines() if ": error: " in line]
        summary = sorted({line.split(":")[0] for line in faults})
        self.assertEqual(0, done.returncode,
                         "\n".join(["", "run: clang-format -i " + " ".join(summary)] + faults[:20]))

    def test_no_enum_has_its_comment_beside_the_brace(self):
        """clang-format aligns every enumerator with such a comment."""
        beside = re.compile(r"^(typedef )?enum \w* ?\{ +(/\*|//)")
        strays = [f"{path}:{number}" for path in sources.files()
                  if path.suffix in sources.C_SUFFIXES
                  for number, line in enumerate(sources.read(path).splitlines(), 1)
                  if beside.match(line) and not line.rstrip().endswith("};")]
        self.assertEqual([], strays)
        self.assertTrue(beside.match("enum kind { /* of a value */"))

    def test_a_planted_fault_is_caught(self):
        done = subprocess.run([FORMATTER, "--dry-run", "-Werror", "--assume-filename=a.c"],
                              input="int main(void) {return 0 ;}\n", cwd=sources.root(),
                              capture_output=True, text=True, check=False)
        self.assertNotEqual(0, done.returncode)


if __name__ == "__main__":
    if not FORMATTER:
        print(f"skipped: no clang-format {sources.CLANG_VERSION}; others judge otherwise")
        sys.exit(sources.SKIPPED_EXIT_CODE)
    sources.run_tests(__name__)
