# SPDX-License-Identifier: MIT
"""Includes point one way between folders, a process has what it needs, and each third-party API
has one home."""

import fnmatch
import pathlib
import re
import unittest

import sources

FOLDERS = {"server", "protocol", "renderer", "shaders", "glb", "clients", "tests"}

# folder -> what it may include: whole folders, or single headers
ARROWS = {
    "protocol": {"protocol"},
    "renderer": {"renderer", "shaders", "protocol/error.h", "protocol/haze_taps.h",
                 "protocol/lobe_members.h",
                 "protocol/provenance_file.h", "protocol/quality_defaults.h",
                 "protocol/quality_setting.h",
                 "protocol/report_counts.h", "protocol/scene_format.h",
                 "protocol/shadow_technique.h", "protocol/transparency.h"},
    "glb": {"glb", "protocol"},
    "server": {"server", "protocol", "renderer", "glb/demo_scene.h"},
    # images and their metrics need no GL, and a client that compares files needs no server
    "clients": {"clients", "protocol", "glb", "renderer/accuracy", "renderer/image"},
    "shaders": {"shaders"},
    "tests": FOLDERS,
}

# The rooms of shaders/, renderer/ and server/: folders, and files ("renderer/frame_report" is
# both .h and .c). A room may include what it lists, and lists only rooms above it in this table, so
# that no arrow runs back. An arrow that no include needs does not stand here.
#
# "server/x" and "renderer/x" are rooms, or parts of them: "renderer/image/image.h" is that header
# alone.
ROOMS = {
    # GLSL names fragments from shaders/ on
    "shaders/shared": "",
    "shaders/base": "shaders/shared",
    "shaders/material": "shaders/shared",
    "shaders/image": "shaders/shared",
    "shaders/draw": "shaders/shared shaders/base shaders/material",
    "shaders/window": "shaders/shared shaders/draw",
    "shaders/lights": "shaders/shared shaders/base",
    "shaders/transparency": "shaders/shared shaders/base shaders/material shaders/draw",
    "shaders/shadows": "shaders/shared shaders/base shaders/material shaders/draw shaders/window"
        " shaders/lights",
    "shaders/shading":
        "shaders/shared shaders/base shaders/material shaders/image shaders/draw shaders/window"
        " shaders/lights shaders/shadows",
    "shaders/probes": "shaders/shared shaders/base",
    "shaders/shader_table": "",

    "renderer/base": "",
    "renderer/base/processor_forms.h": "",
    "renderer/base/file_write.h": "",
    "renderer/image": "renderer/base/processor_forms.h renderer/base/file_write.h",
    "renderer/accuracy": "renderer/image",
    "renderer/environment": "renderer/image",
    "renderer/scene/scene_blob.h": "",
    "renderer/frame_report": "",
    "renderer/view.h": "renderer/image renderer/scene/scene_blob.h",
    "renderer/scene": "renderer/base renderer/image renderer/scene/scene_blob.h renderer/view.h",
    "renderer/import":
        "renderer/base renderer/image renderer/scene renderer/scene/scene_blob.h",
    "renderer/gl": "renderer/base renderer/base/file_write.h renderer/frame_report",
    "renderer/textures": "renderer/base renderer/frame_report renderer/scene renderer/gl",
    "renderer/draw": "renderer/base renderer/scene renderer/gl renderer/textures",
    "renderer/window":
        "renderer/base renderer/frame_report renderer/scene renderer/gl renderer/draw",
    "renderer/lights": "renderer/base renderer/frame_report renderer/scene renderer/gl",
    "renderer/raytrace":
        "renderer/base renderer/base/processor_forms.h renderer/image renderer/environment"
        " renderer/view.h renderer/scene renderer/lights",
    "renderer/overlay":
        "renderer/base renderer/image renderer/view.h renderer/scene renderer/raytrace",
    "renderer/transparency": "renderer/base renderer/gl renderer/window",
    "renderer/forecast": "",
    "renderer/shadows":
        "renderer/base renderer/frame_report renderer/scene renderer/gl renderer/draw"
        " renderer/window renderer/lights renderer/raytrace renderer/transparency"
        " renderer/forecast",
    "renderer/shading":
        "renderer/base renderer/image renderer/environment renderer/scene/atmosphere_grid.h"
        " renderer/scene/grid_texels.h renderer/scene/haze_glow.h renderer/scene/smoke_lattice.h"
        " renderer/scene/smoke_nodes.h"
        " renderer/gl renderer/window renderer/lights renderer/transparency renderer/shadows",
    "renderer/cost":
        "renderer/base renderer/frame_report renderer/view.h renderer/scene renderer/lights"
        " renderer/forecast renderer/shadows",
    "renderer/plan":
        "renderer/base renderer/frame_report renderer/view.h renderer/scene renderer/gl"
        " renderer/draw renderer/window renderer/lights renderer/raytrace renderer/transparency"
        " renderer/shadows renderer/cost",
    "renderer/renderer.h":
        "renderer/base renderer/image renderer/environment renderer/frame_report renderer/view.h"
        " renderer/scene renderer/gl renderer/raytrace renderer/plan",
    "renderer/frame":
        "renderer/base renderer/image renderer/frame_report renderer/scene renderer/gl"
        " renderer/textures renderer/draw renderer/window renderer/raytrace renderer/overlay"
        " renderer/forecast renderer/shadows renderer/shading renderer/cost renderer/plan"
        " renderer/renderer.h",

    # what every process has
    "server/base": "renderer/base",
    "server/mapping": "renderer",
    # the front: HTTP, store, queue
    "server/http": "server/base renderer/image/image.h",
    "server/front":
        "server/base server/mapping server/http renderer/base renderer/image/image.h"
        " renderer/scene/scene_blob.h renderer/environment/environment_blob.h",
    "server/tradeoffs": "server/base server/mapping server/front",
    "server/jobs":
        "server/base server/mapping server/front server/tradeoffs renderer/image/image.h"
        " renderer/image/image_join.h",
    "server/views":
        "server/base server/http server/front server/tradeoffs renderer/image/image.h",
    "server/routes":
        "server/base server/mapping server/http server/front server/tradeoffs server/jobs"
        " server/views"
        " renderer/import/extensions.h",
    # the decoder
    "server/decoder":
        "server/base server/mapping renderer/environment renderer/image/image.h"
        " renderer/import/import.h renderer/scene/scene.h",
    # the assembler
    "server/assembler": "server/base renderer/image/image_join.h",
    # the worker
    "server/worker": "server/base server/mapping renderer",
    "server/main.c":
        "server/base server/jobs server/routes server/decoder server/worker server/assembler",
}

GL = {"epoxy", "renderer/gl", "renderer/textures", "renderer/draw", "renderer/window",
      "renderer/transparency", "renderer/shadows", "renderer/shading", "renderer/plan",
      "renderer/renderer.h", "renderer/frame"}
HTTP = {"microhttpd.h", "wslay", "server/http"}
FRONT = {"server/front", "server/tradeoffs", "server/jobs", "server/views", "server/routes"}
DECODING = {"server/decoder", "tiny_gltf.h", "renderer/import/import.h",
            "renderer/import/importer.h", "renderer/environment/environment_import.h"}

# rooms of a process -> what is never reached from there: by an include, or by one of an included
# header, or of the file of server/ behind such a header
NEVER_REACHED = {
    "server/http": GL | DECODING | FRONT | {"server/worker"},
    "server/front": GL | DECODING | {"server/worker"},
    "server/tradeoffs": GL | DECODING | {"server/worker"},
    "server/jobs": GL | DECODING | HTTP | {"server/worker"},
    "server/views": GL | DECODING | {"server/worker"},
    "server/routes": GL | DECODING | {"server/worker"},
    "server/decoder": GL | HTTP | FRONT | {"server/worker", "ini.h", "openssl"},
    "server/worker": HTTP | FRONT | DECODING,
    "server/assembler": GL | HTTP | FRONT | DECODING | {"server/worker"},
}

# third-party header -> the only files that may include it; the first pattern that fits decides
HOMES = [
    ("microhttpd.h", ["server/http/http*"]),
    ("tiny_gltf.h", ["renderer/*_shim.cpp"]),
    ("stb_dxt.h", ["renderer/textures/texture_blocks.c"]),
    ("assimp/*", ["renderer/import/assimp/*"]),
    ("*.hxx", ["renderer/import/opencascade/*"]),
    ("openvdb/*", ["renderer/import/openvdb/*", "tests/support/vdb_files/*"]),
    ("oneapi/tbb/*", ["renderer/import/openvdb/*"]),
    ("zlib.h", ["renderer/import/assimp/units_shim.cpp"]),
    ("OpenImageIO/*", ["renderer/*_shim.cpp"]),
    # tests encode what the renderer decodes
    ("draco/*", ["renderer/*_shim.cpp", "tests/support/*_shim.cpp"]),
    ("meshoptimizer.h", ["renderer/import/meshopt_stream.c", "tests/unit/test_import_*",
                          "tests/bench/suite_import.c"]),
    ("curl/*", ["clients/vitrail/http.c"]),
    ("epoxy/*", ["renderer/gl/*", "renderer/textures/*", "renderer/draw/*", "renderer/window/*",
                 "renderer/lights/*", "renderer/transparency/*", "renderer/shadows/*",
                 "renderer/shading/*", "renderer/frame/*", "tests/gpu/*", "tests/bench/*",
                 "tests/drivers/*", "tests/support/gl_*"]),
    ("GL/glu.h", ["renderer/scene/section_resolve.c"]),
    ("GL/*", []),
    ("GLES*/*", []),
    ("EGL/*", []),
    ("jansson.h", ["protocol/*", "glb/*", "server/*", "clients/*", "tests/*"]),
    ("seccomp.h", ["server/decoder/sandbox.c"]),
    ("sqlite3.h", ["server/jobs/job_store.c", "server/jobs/job_backup.c"]),
    ("archive*.h", ["server/routes/job_archive.c"]),
    ("ini.h", ["server/base/config.c"]),
    ("wslay/*", ["server/http/websocket.c"]),
    ("openssl/*", ["server/base/digest.c", "server/http/websocket_accept.c",
                    "clients/vitrail/resource.c"]),
    ("png.h", ["glb/*", "renderer/image/png_codec.c", "tests/*"]),
    ("libdeflate.h", ["renderer/image/png_plain.c"]),
    ("jerror.h", ["renderer/image/jpeg_codec.c"]),
    ("jpeglib.h", ["renderer/image/jpeg_codec.c", "tests/unit/*"]),
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
SHADER_FRAGMENT = re.compile(r"[a-z_]+/[a-z_.]+[.](glsl|h)")
INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')


def may_include(folder, target):
    return any(target == allowed or target.startswith(allowed + "/") for allowed in ARROWS[folder])


def room_of(path):
    """The room that the file lies in, or None."""
    found = [room for room in ROOMS
             if path == room or path.startswith(room + "/") or path.rsplit(".", 1)[0] == room]
    return max(found, key=len, default=None)


def is_part(path, whole):
    """Whether the file is that file, or header without its ending, or lies in that folder."""
    return path in (whole, whole + ".h") or path.startswith(whole + "/")


def arrow_of(room, target):
    """The entry of ROOMS that lets the room include the target, or None."""
    allowed = [entry for entry in ROOMS[room].split() if is_part(target, entry)
               # a single file within a folder is a room of its own
               and not (room_of(target) != entry and is_part(room_of(target), entry)
                        and entry in ROOMS)]
    return max(allowed, key=len, default=None)


def rooms_fault(path, target):
    """Why the file `path` must not include the file `target` of a room, or None."""
    if target.startswith("shaders/") and not path.startswith("shaders/"):
        return None  # ARROWS decide who reads what C and GLSL share
    room, other = room_of(path), room_of(target)
    if not room or not other or room == other or arrow_of(room, target):
        return None
    return f"{room} may not include {target}"


def named_by(path, target):
    """The path of what the file `path` includes as `target`: the composer of GLSL looks fragments
    up from shaders/ on."""
    return f"shaders/{target}" if path.endswith(".glsl") else target


def includes_of(path, text):
    return [named_by(path, found[2])
            for line in text.splitlines() if (found := INCLUDE.match(line))]


def reached_from(path, includes):
    """Every header that the file includes, itself or through others, with the file that does."""
    reached, waiting = {}, [path]
    while waiting:
        at = waiting.pop()
        for target in includes.get(at, []):
            if target in reached:
                continue
            reached[target] = at
            waiting.append(target)
            if target.startswith("server/"):
                waiting.append(target[:-2] + ".c")
    return reached


def include_fault(path, quote, target):
    """Why the file `path` must not include `target`, or None."""
    folder = path.split("/")[0]
    if folder not in FOLDERS:
        return None
    if path.endswith(".glsl") and not SHADER_FRAGMENT.fullmatch(target):
        return f'"{target}" names no folder of shaders/'
    target = named_by(path, target)
    if target.split("/")[0] in FOLDERS:
        if not may_include(folder, target):
            return f"{folder} may not include {target}"
        return rooms_fault(path, target)
    for header, homes in HOMES:
        if fnmatch.fnmatchcase(target, header):
            if not any(fnmatch.fnmatchcase(path, home) for home in homes):
                return f"{target} lives in {', '.join(homes) or 'no file of ours'}"
            return None
    if quote == '"':
        return f'"{target}" names no folder of ours'
    if quote == "<" and not STANDARD.fullmatch(target):
        return f"<{target}> has no home in {pathlib.Path(__file__).name}"
    return None


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


class Rooms(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.includes = {str(path): includes_of(str(path), sources.read(path))
                        for path in sources.files()
                        if path.suffix in sources.C_SUFFIXES | {".glsl"}
                        and path.parts[0] in {"server", "renderer", "shaders"}}

    def test_every_source_has_a_room(self):
        self.assertGreater(len(self.includes), 300, "the scanner must have found the sources")
        self.assertEqual([], [path for path in self.includes
                              if not room_of(path) and path != "shaders/shader_table.h"])

    def test_a_shader_is_known_by_its_name_without_the_folder(self):
        names = [path.rsplit("/", 1)[1] for path in self.includes if path.startswith("shaders/")]
        self.assertGreater(len(names), 80, "the scanner must have found the shaders")
        self.assertEqual(len(set(names)), len(names))

    def test_no_room_lists_one_below_itself(self):
        order = list(ROOMS)
        for room, allowed in ROOMS.items():
            for entry in allowed.split():
                if entry != "renderer":
                    self.assertLess(order.index(room_of(entry + ".h") or room_of(entry + "/")),
                                    order.index(room), f"{room} lists {entry}")

    def test_every_listed_arrow_is_needed(self):
        used = {(room_of(path), arrow_of(room_of(path), target))
                for path, targets in self.includes.items() for target in targets
                if room_of(target) and room_of(target) != room_of(path)
                and arrow_of(room_of(path), target)}
        listed = {(room, entry) for room, allowed in ROOMS.items() for entry in allowed.split()}
        self.assertEqual(set(), listed - used)

    def test_no_process_reaches_the_work_of_another(self):
        faults = []
        for path in self.includes:
            reached = reached_from(path, self.includes)
            for never in sorted(NEVER_REACHED.get(room_of(path), ())):
                faults += [f"{path} reaches {target} through {by}"
                           for target, by in reached.items() if is_part(target, never)]
        self.assertEqual([], faults, "\n" + "\n".join(faults[:40]))


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

    def test_arrows_that_run_back_between_rooms(self):
        self.assert_refused("server/http/a.c", '"server/front/resource_store.h"')
        self.assert_refused("server/routes/a.c", '"server/worker/worker.h"')
        self.assert_refused("server/routes/a.c", '"renderer/renderer.h"')
        self.assert_refused("server/front/a.c", '"renderer/image/tone_map.h"')
        self.assert_refused("server/worker/a.c", '"server/front/render_queue.h"')
        self.assert_refused("server/worker/a.c", '"server/http/negotiate.h"')
        self.assert_refused("server/decoder/a.c", '"renderer/gl/context.h"')
        self.assert_refused("server/base/a.c", '"server/mapping/questions.h"')
        self.assert_refused("renderer/plan/a.c", '"renderer/frame/frame_run.h"')
        self.assert_refused("renderer/gl/a.c", '"renderer/plan/plan.h"')
        self.assert_refused("renderer/gl/a.c", '"renderer/renderer.h"')
        self.assert_refused("renderer/window/a.c", '"renderer/shading/shade.h"')
        self.assert_refused("renderer/shadows/a.h", '"renderer/cost/choice.h"')
        self.assert_refused("renderer/view.h", '"renderer/scene/scene.h"')
        self.assert_refused("shaders/material/a.glsl", '"shading/lighting.glsl"')
        self.assert_refused("shaders/lights/a.glsl", '"shadows/shadow_query.glsl"')

    def test_what_is_reached_through_other_headers(self):
        includes = {"server/front/a.c": ["server/mapping/b.h"], "server/mapping/b.h": [],
                    "server/mapping/b.c": ["renderer/view.h", "renderer/gl/c.h"]}
        self.assertEqual({"server/mapping/b.h", "renderer/view.h", "renderer/gl/c.h"},
                         set(reached_from("server/front/a.c", includes)))

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
        self.assert_refused("shaders/draw/draw.glsl", '"../renderer/view.h"')
        self.assert_refused("shaders/draw/draw.glsl", '"surface.glsl"')

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
        self.assert_allowed("shaders/draw/draw.glsl", '"shared/records.h"')


if __name__ == "__main__":
    sources.run_tests(__name__)
