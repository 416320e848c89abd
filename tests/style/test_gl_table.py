# SPDX-License-Identifier: MIT
"""The table of the GL functions that the test rig hooks has every call of the sources."""

import pathlib
import sys
import unittest

import sources

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "support"))
import gl_table  # pylint: disable=wrong-import-position

HEADER = """
EPOXY_PUBLIC void (EPOXY_CALLSPEC *epoxy_glFinish)(void);

EPOXY_PUBLIC GLenum (EPOXY_CALLSPEC *epoxy_glGetError)(void);

EPOXY_PUBLIC const GLubyte * (EPOXY_CALLSPEC *epoxy_glGetStringi)(GLenum name, GLuint index);

EPOXY_PUBLIC void (EPOXY_CALLSPEC *epoxy_glShaderSource)(GLuint name, const char *const* text);
"""


class Table(unittest.TestCase):
    def test_a_call_in_any_spelling_is_found(self):
        self.assertEqual({"Finish", "GetError", "Flush", "UseProgram"},
                         gl_table.called(["glFinish();", "x.next.GetError()", "HOOK(Flush);",
                                          "gl->UseProgram(3)", "piglFoo(1), glTF only"]))

    def test_rows_have_parameters_and_their_names(self):
        self.assertEqual(
            [("VOID", "Finish", "void", "void", ""),
             ("VALUE", "GetStringi", "const GLubyte *", "GLenum name, GLuint index", "name, index"),
             ("VOID", "ShaderSource", "void", "GLuint name, const char *const* text",
              "name, text")],
            gl_table.rows(HEADER, {"Finish", "GetStringi", "ShaderSource", "Unheard"}))

    def test_the_table_of_this_build_has_what_the_renderer_calls(self):
        made = sources.build_dir() / "generated/tests/support/gl_table.h"
        if not made.exists():
            self.skipTest("nothing is built")
        names = gl_table.called(sources.read(path) for path in sources.files()
                                if path.suffix == ".c" and path.parts[0] == "renderer")
        text = made.read_text()
        self.assertGreater(len(names), 80)
        self.assertEqual(set(), {name for name in names - {"TF"} if f", {name}, " not in text})


if __name__ == "__main__":
    sources.run_tests(__name__)
