# SPDX-License-Identifier: MIT
"""Includes point one way between the folders, and each third-party API has one home."""

import fnmatch
import pathlib
import re
import unittest

import sources

FOLDERS = {"server", "protocol", "renderer", "shaders", "glb", "clients", "tests"}

# folder -> what it may include: whole folders, or single headers
ARROWS = {
    "protocol": {"protocol"},
    "renderer": {"renderer", "shaders", "protocol/error.h", "protocol/shadow_technique.h"},
    "glb": {"glb", "protocol"},
    "server": {"server", "protocol", "renderer", "glb/demo_scene.h"},
    # images and their metrics need no GL, and a client that compares files needs no server
    "clients": {"clients", "protocol", "glb", "renderer/accuracy", "renderer/image"},
    "shaders": {"shaders"},
    "tests": FOLDERS,
}

# third-party header -> the only files that may include it; the first pattern that fits decides
HOMES = [
    ("microhttpd.h", ["server/http/http*"]),
    ("tiny_gltf.h", ["renderer/*_shim.cpp"]),
    ("stb_dxt.h", ["renderer/textures/texture_blocks.c"]),
    ("OpenImageIO/*", ["renderer/*_shim.cpp"]),
    ("draco/*", ["renderer/*_shim.cpp"]),
    ("meshoptimizer.h", ["renderer/*_shim.cpp"]),
    ("curl/*", ["clients/vitrail/http.c"]),
    ("epoxy/*", ["renderer/*", "tests/gpu/*", "tests/bench/*", "tests/drivers/*",
                 "tests/support/gl_*"]),
    ("GL/glu.h", ["renderer/scene/section_resolve.c"]),
    ("GL/*", []),
    ("GLES*/*", []),
    ("EGL/*", []),
    ("jansson.h", ["protocol/*", "glb/*", "server/*", "clients/*", "tests/*"]),
    ("seccomp.h", ["server/decoder/sandbox.c"]),
    ("ini.h", ["server/base/config.c"]),
    ("wslay/*", ["server/http/websocket.c"]),
    ("openssl/*", ["server/base/digest.c", "server/http/websocket_accept.c",
                    "clients/vitrail/scene_source.c"]),
    ("png.h", ["glb/*", "renderer/image/png_codec.c", "tests/*"]),
    ("webp/*", ["renderer/image/webp_codec.c"]),
    ("embree*/*", ["renderer/raytrace/embree.h"]),
    ("cmocka.h", ["tests/*"]),
]

# headers of the C and C++ libraries and of the kernel; whatever else is named in <> needs a home
STANDARD = re.compile(r"""
    (assert|complex|ctype|errno|fenv|float|inttypes|limits|locale|math|setjmp|signal|stdalign|stdarg
    |stdatomic|stdbool|stddef|stdint|stdio|stdlib|stdnoreturn|string|strings|threads|time
    |uchar|wchar|dirent|dlfcn|elf|endian|execinfo|fcntl|ftw|getopt|glob|grp|iconv|ifaddrs
    |fnmatch|langinfo|libgen|link
    |malloc|netdb|paths|poll|pthread|pwd|sched|semaphore|spawn|syslog|termios|ucontext|unistd|utime
    |arpa/\w+|net/\w+|netinet/\w+|sys/\w+|linux/\w+|asm/\w+|bits/\w+|x86intrin|immintrin)\.h
    |c?[a-z_]+""", re.VERBOSE)

GL_OWNER = re.compile(r"\bgl(Create|Gen|Delete)[A-Z]\w*\s*\(")
INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')


def may_include(folder, target):
    return any(target == allowed or target.startswith(allowed + "/") for allowed in ARROWS[folder])


def include_fault(path, quote, target):
    """Why the file `path` must not include `target`, or None."""
    folder = path.split("/")[0]
    if folder not in FOLDERS:
        return None
    if target.split("/")[0] in FOLDERS:
        if not may_include(folder, target):
            return f"{folder} may not include {target}"
        return None
    for header, homes in HOMES:
        if fnmatch.fnmatchcase(target, header):
            if not any(fnmatch.fnmatchcase(path, home) for home in homes):
                return f"{target} lives in {', '.join(homes) or 'no file of ours'}"
            return None
    if quote == '"' and not is_shader_fragment(path, target):
        return f'"{target}" names no folder of ours'
    if quote == "<" and not STANDARD.fullmatch(target):
        return f"<{target}> has no home in {pathlib.Path(__file__).name}"
    return None


def is_shader_fragment(path, target):
    """GLSL names fragments from shaders/ on, because that is where the composer looks them up."""
    return path.endswith(".glsl") and ".." not in target.split("/")


def faults_of(path, text):
    faults = []
    for number, line in enumerate(text.splitlines(), 1):
        found = INCLUDE.match(line)
        fault = found and include_fault(path, found[1], found[2])
        if fault:
            faults.append(f"{path}:{number}: {fault}")
    return faults


class Arrows(unittest.TestCase):
    def test_every_include_of_the_project_is_allowed(self):
        checked = 0
        faults = []
        for path in sources.files():
            if path.suffix in sources.C_SUFFIXES | {".glsl"}:
                checked += 1
                faults += faults_of(str(path), sources.read(path))
        self.assertGreater(checked, 20, "the scanner must have found the sources")
        self.assertEqual([], faults, "\n" + "\n".join(faults))

    def test_cpp_is_for_shims_only(self):
        strays = [str(path) for path in sources.files()
                  if path.suffix in {".cpp", ".cc", ".cxx"} and not path.stem.endswith("_shim")]
        self.assertEqual([], strays)


    def test_gl_names_are_made_and_ended_in_one_folder(self):
        strays = [f"{path}:{number}: {line.strip()}" for path in sources.files()
                  if path.suffix in sources.C_SUFFIXES and path.parts[:2] != ("renderer", "gl")
                  and path.parts[0] != "tests"
                  for number, line in enumerate(sources.read(path).splitlines(), 1)
                  if GL_OWNER.search(line)]
        self.assertEqual([], strays)


class PlantedFaultsAreCaught(unittest.TestCase):
    def assert_refused(self, path, include):
        self.assertEqual(1, len(faults_of(path, f"#include {include}\n")), f"{path} {include}")

    def assert_allowed(self, path, include):
        self.assertEqual([], faults_of(path, f"#include {include}\n"))

    def test_wrong_arrows_between_folders(self):
        self.assert_refused("protocol/a.c", '"renderer/view.h"')
        self.assert_refused("protocol/a.c", '"server/routes.h"')
        self.assert_refused("renderer/gl/a.c", '"protocol/render_request.h"')
        self.assert_refused("renderer/gl/a.c", '"server/worker/worker.h"')
        self.assert_refused("clients/vitrail/a.c", '"renderer/view.h"')
        self.assert_refused("clients/vitrail/a.c", '"renderer/renderer.h"')
        self.assert_refused("clients/vitrail/a.c", '"renderer/gl/context.h"')
        self.assert_refused("server/a.c", '"clients/vitrail/http.h"')
        self.assert_refused("server/a.c", '"glb/glb_builder.h"')
        self.assert_refused("glb/a.c", '"renderer/image/image.h"')
        self.assert_refused("server/a.c", '"tests/support/a.h"')
        self.assert_refused("shaders/shared/a.h", '"renderer/view.h"')
        self.assert_refused("renderer/a.c", "<server/worker/worker.h>")

    def test_third_party_apis_away_from_home(self):
        self.assert_refused("server/routes.c", "<microhttpd.h>")
        self.assert_refused("renderer/import/import.c", "<tiny_gltf.h>")
        self.assert_refused("server/a.c", "<OpenImageIO/imageio.h>")
        self.assert_refused("server/a.c", "<epoxy/gl.h>")
        self.assert_refused("tests/unit/test_a.c", "<epoxy/gl.h>")
        self.assert_refused("renderer/gl/a.c", "<GL/gl.h>")
        self.assert_refused("renderer/plan/a.c", "<jansson.h>")
        self.assert_refused("clients/vitrail/main.c", "<curl/curl.h>")

    def test_a_library_that_has_no_home_yet(self):
        self.assert_refused("server/a.c", "<zlib.h>")
        self.assert_refused("renderer/a.c", "<vulkan/vulkan.h>")

    def test_a_gl_name_made_elsewhere(self):
        self.assertTrue(GL_OWNER.search("    glCreateBuffers(1, &name);"))
        self.assertFalse(GL_OWNER.search("    glGenerateTextureMipmap(name);"))

    def test_includes_without_a_folder(self):
        self.assert_refused("renderer/gl/a.c", '"program.h"')
        self.assert_refused("renderer/gl/a.c", '"../scene/scene.h"')
        self.assert_refused("shaders/draw.glsl", '"../renderer/view.h"')

    def test_the_arrows_of_the_design_are_allowed(self):
        self.assert_allowed("server/a.c", '"protocol/error.h"')
        self.assert_allowed("server/a.c", '"renderer/renderer.h"')
        self.assert_allowed("server/a.c", '"glb/demo_scene.h"')
        self.assert_allowed("clients/vitrail/a.c", '"glb/demo_scene.h"')
        self.assert_allowed("renderer/gl/a.c", '"protocol/error.h"')
        self.assert_allowed("renderer/gl/a.c", '"shaders/shared/light.h"')
        self.assert_allowed("renderer/gl/a.c", "<epoxy/gl.h>")
        self.assert_allowed("renderer/import/gltf_shim.cpp", "<tiny_gltf.h>")
        self.assert_allowed("server/http/http_daemon.c", "<microhttpd.h>")
        self.assert_allowed("clients/compare/a.c", '"renderer/accuracy/metrics.h"')
        self.assert_allowed("clients/compare/a.c", '"renderer/image/image.h"')
        self.assert_allowed("clients/vitrail/http.c", "<curl/curl.h>")
        self.assert_allowed("renderer/a.c", "<stdio.h>")
        self.assert_allowed("server/a.c", "<sys/socket.h>")
        self.assert_allowed("renderer/import/gltf_shim.cpp", "<vector>")
        self.assert_allowed("shaders/draw.glsl", '"shared/records.h"')


if __name__ == "__main__":
    sources.run_tests(__name__)
