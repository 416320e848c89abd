# SPDX-License-Identifier: MIT
"""Files, functions and lines stay short, and every source says its licence and what it is for."""

import ast
import re
import unittest

import sources

FILE_LINES_MAX = 800
FUNCTION_LINES_MAX = 100
LINE_COLUMNS_MAX = 100
C_LIKE = sources.C_SUFFIXES | {".glsl"}
LEFTOVER = re.compile(r"\b(TODO|FIXME|XXX|HACK)\b")

NOT_A_FUNCTION = re.compile(r"^(struct|union|enum|typedef|namespace|extern)\b[^()]*$|=\s*{?\s*$")
NAME = re.compile(r"(\w+)\s*\(")


def c_functions(text):
    """(name, first line, number of lines) of each C function: a brace in column one until its end.

    Understands K&R as clang-format writes it: what opens at the left margin closes there.
    """
    found = []
    signature = []
    start = name = None
    for number, line in enumerate(text.splitlines(), 1):
        if start is not None:
            if line.startswith("}"):
                if name:
                    found.append((name, start, number - start + 1))
                start = None
                signature = []
            continue
        if line.rstrip().endswith("{") and not line.startswith((" ", "#")):
            head = " ".join(signature + [line.rstrip()[:-1]]).strip()
            call = None if NOT_A_FUNCTION.search(head) else NAME.search(head)
            if head.startswith('extern "C"') and not call:
                continue  # a linkage block: its content is at the left margin too
            start = number - len(signature)
            name = call[1] if call else None
        elif line.startswith(("#", "/", "*", " *", "}")) or not line.strip() or line.endswith(";"):
            signature = []
        else:
            signature.append(line.strip())
    return found


def python_functions(text):
    kinds = (ast.FunctionDef, ast.AsyncFunctionDef)
    return [(node.name, node.lineno, node.end_lineno - node.lineno + 1)
            for node in ast.walk(ast.parse(text)) if isinstance(node, kinds)]


def functions(path, text):
    return python_functions(text) if path.suffix == ".py" else c_functions(text)


def code_files():
    return [(path, sources.read(path)) for path in sources.files()
            if path.suffix in sources.CODE_SUFFIXES]


def purpose_of(text):
    """The words of the line that follows the SPDX line: what the file is for."""
    lines = text.splitlines()
    spdx = next((i for i, line in enumerate(lines[:3]) if "SPDX-License-Identifier:" in line), None)
    if spdx is None or spdx + 1 >= len(lines):
        return ""
    comment = re.match(r'\s*(/\*+|//|#\s|"""|\'\'\')\s*(.*)', lines[spdx + 1])
    return comment[2] if comment else ""


class Sizes(unittest.TestCase):
    def report(self, faults):
        self.assertEqual([], faults, "\n" + "\n".join(faults))

    def test_files_have_at_most_800_lines(self):
        files = code_files()
        self.assertGreater(len(files), 20, "the scanner must have found the sources")
        self.report([f"{path}: {len(text.splitlines())} lines" for path, text in files
                     if len(text.splitlines()) > FILE_LINES_MAX])

    def test_functions_have_at_most_100_lines(self):
        total = 0
        faults = []
        for path, text in code_files():
            for name, line, count in functions(path, text):
                total += 1
                if count > FUNCTION_LINES_MAX:
                    faults.append(f"{path}:{line}: {name} has {count} lines")
        self.assertGreater(total, 100, "the scanner must have found the functions")
        self.report(faults)

    def test_lines_have_at_most_100_columns(self):
        self.report([f"{path}:{number}: {len(line)} columns" for path, text in code_files()
                     for number, line in enumerate(text.splitlines(), 1)
                     if len(line) > LINE_COLUMNS_MAX])

    def test_lines_end_without_blanks_and_hold_no_tabs(self):
        self.report([f"{path}:{number}" for path, text in code_files()
                     for number, line in enumerate(text.splitlines(), 1)
                     if line != line.rstrip() or "\t" in line])

    def test_every_source_names_its_licence(self):
        more = {".js", ".css", ".html", ".cmake", ".sh"}
        names = {"CMakeLists.txt", "run", "check", "install-packages"}
        missing = []
        for path in sources.files():
            if path.suffix in sources.CODE_SUFFIXES | more or path.name in names:
                head = sources.read(path).splitlines()[:3]
                if not any("SPDX-License-Identifier: MIT" in line for line in head):
                    missing.append(str(path))
        self.report(missing)

    def test_every_source_says_in_a_sentence_what_it_is_for(self):
        self.report([str(path) for path, text in code_files()
                     if len(purpose_of(text).split()) < 3])

    def test_nothing_is_left_for_later(self):
        self.report([f"{path}:{number}: {line.strip()}" for path, text in code_files()
                     if path.name != "test_sizes.py"
                     for number, line in enumerate(text.splitlines(), 1) if LEFTOVER.search(line)])


class PlantedFaultsAreCaught(unittest.TestCase):
    def test_the_length_of_a_c_function_is_counted_from_signature_to_brace(self):
        body = "    x += 1;\n" * 7
        text = f"struct a {{\n    int b;\n}};\n\nstatic int f(int x,\n    int y)\n{{\n{body}}}\n"
        self.assertEqual([("f", 5, 11)], c_functions(text))

    def test_functions_inside_extern_c_are_seen(self):
        text = 'extern "C" {\n\nint g(void)\n{\n    return 1;\n}\n\n}\n'
        self.assertEqual([("g", 3, 4)], c_functions(text))

    def test_glsl_functions_with_the_brace_on_the_same_line_are_seen(self):
        self.assertEqual([("main", 1, 3)], c_functions("void main() {\n    x = 1;\n}\n"))

    def test_tables_and_structs_are_not_functions(self):
        text = "static const struct row table[] = {\n    ROW(1),\n};\nenum kind {\n    A,\n};\n"
        self.assertEqual([], c_functions(text))

    def test_a_file_without_a_sentence_is_caught(self):
        self.assertEqual("", purpose_of("/* SPDX-License-Identifier: MIT */\n#include <stdio.h>\n"))
        self.assertEqual("Does a thing. */",
                         purpose_of("/* SPDX-License-Identifier: MIT */\n/* Does a thing. */\n"))


if __name__ == "__main__":
    sources.run_tests(__name__)
