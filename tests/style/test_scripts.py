# SPDX-License-Identifier: MIT
"""The scripts at the root refuse what they cannot do, and count tests as ctest saw them."""

import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

import sources

sys.path.insert(0, str(sources.HERE.parent / "drivers"))
import check_programs

SCRIPTS = ["run", "check", "check-drivers", ".ci/run", "packaging/install-packages",
           "tests/checks.sh", "tests/drivers/with", "tests/drivers/fetch",
           "tests/drivers/container"]

REPORT = """<?xml version="1.0"?>
<testsuite name="x" tests="5">
<testcase name="unit.good" status="run"><system-out>fine</system-out></testcase>
<testcase name="unit.bad" status="fail"><failure message=""/><system-out>no</system-out></testcase>
<testcase name="gpu.absent" status="notrun"><skipped message="SKIP_RETURN_CODE=77"/>
<system-out>some text
skipped: no device
</system-out></testcase>
<testcase name="unit.unbuilt" status="notrun"><skipped message="Unable to find executable"/>
</testcase>
<testcase name="unit.late" status="fail"><failure message="Timeout"/></testcase>
</testsuite>
"""


def call(script, *arguments, environment=None):
    return subprocess.run([str(sources.root() / script), *arguments], capture_output=True,
                          text=True, check=False, timeout=60, env=environment)


class Scripts(unittest.TestCase):
    def test_every_script_is_sound_bash_and_stops_at_errors_or_counts_them(self):
        for script in SCRIPTS:
            text = sources.read(script)
            self.assertTrue(text.startswith("#!/usr/bin/env bash\n"), script)
            self.assertRegex(text, r"(?m)^set -[eu]*u", script)
            done = subprocess.run(["bash", "-n", str(sources.root() / script)], check=False)
            self.assertEqual(0, done.returncode, script)

    def test_run_refuses_a_wrong_command_line_before_it_does_anything(self):
        for arguments in (["--size", "foo"], ["--size", "0x10"], ["--port", "70000"], ["-o"],
                          ["--bogus"], ["-o", "/no/such/folder/a.png"]):
            done = call("run", *arguments)
            self.assertEqual(2, done.returncode, arguments)
            self.assertRegex(done.stderr, r"^run: .*" + arguments[0], arguments)
            self.assertNotIn("==", done.stderr, arguments)

    def test_help_is_given(self):
        for script in ("run", "check", "check-drivers"):
            done = call(script, "--help")
            self.assertEqual(0, done.returncode)
            self.assertIn("usage:", done.stdout)

    def test_drivers_and_sections_that_nobody_knows_are_refused(self):
        for script, arguments in (("check-drivers", ["--short", "nonsense"]),
                                  ("tests/drivers/with", ["nonsense", "true"]),
                                  ("tests/drivers/fetch", ["nonsense"]),
                                  ("tests/drivers/container", ["trixie"])):
            done = call(script, *arguments)
            self.assertEqual(2, done.returncode, script)
            self.assertIn("usage:", done.stderr, script)

    def test_what_is_not_here_is_said(self):
        with tempfile.TemporaryDirectory() as folder:
            environment = dict(os.environ, VITRAIL_DRIVERS_DIR=folder)
            done = call("tests/drivers/with", "zink", "true", environment=environment)
            self.assertEqual(1, done.returncode)
            self.assertIn("tests/drivers/fetch mesa", done.stderr)

    def test_an_unknown_section_of_packages_is_refused(self):
        done = call("packaging/install-packages", "nonsense")
        self.assertEqual(1, done.returncode)
        self.assertIn("no section [nonsense]", done.stderr)

    def test_a_release_that_nobody_listed_is_told_what_it_would_need(self):
        with tempfile.TemporaryDirectory() as folder:
            release = pathlib.Path(folder) / "os-release"
            release.write_text("ID=gentoo\nVERSION_CODENAME=wilma\n")
            tools = pathlib.Path(folder) / "bin"  # where nothing is, least of all dpkg
            tools.mkdir()
            for name in "bash env dirname readlink sed sort grep awk paste".split():
                (tools / name).symlink_to(shutil.which(name))
            done = call("packaging/install-packages", "build", "page",
                        environment={"VITRAIL_OS_RELEASE": str(release), "PATH": str(tools)})
        self.assertEqual(0, done.returncode, done.stderr)
        self.assertIn("'wilma' is not one of bookworm trixie forky noble", done.stderr)
        self.assertIn(" libembree-dev ", done.stderr)
        self.assertIn(" chromium ", done.stderr)


class Packages(unittest.TestCase):
    @unittest.skipUnless(shutil.which("dpkg-query"), "not a Debian system")
    def test_every_library_that_cmake_looks_for_comes_from_a_listed_package(self):
        cmake = "".join(sources.read(path) for path in sources.files()
                        if path.name == "CMakeLists.txt")
        modules = re.findall(r"pkg_check_modules\(\w+ REQUIRED IMPORTED_TARGET (\w+)", cmake)
        configs = re.findall(r"find_package\((\w+) [\d.]+ REQUIRED", cmake)
        listed = set(sources.read("packaging/packages.txt").split())
        # libjpeg-dev is empty, and depends on the library of the release
        for packages in re.findall(r"^Depends: (.*)$", subprocess.run(
                ["dpkg-query", "-s", "libjpeg-dev"], text=True, capture_output=True).stdout, re.M):
            listed |= {package.split()[0] for package in packages.split(",")}
        self.assertGreater(len(modules), 5)
        for module in modules:
            folder = subprocess.run(["pkg-config", "--variable=pcfiledir", module], text=True,
                                    capture_output=True, check=True).stdout.strip()
            owner = subprocess.run(["dpkg-query", "-S", f"{folder}/{module}.pc"], text=True,
                                   capture_output=True, check=True).stdout.split(":")[0]
            self.assertIn(owner, listed, module)
        for name in configs:
            self.assertTrue([package for package in listed if name in package], name)


class Programs(unittest.TestCase):
    SAID = ["device\tsome",
            "said\tkey0-a\tFS SIMD8 shader: 40 inst, 0 loops, 9 cycles, 1:2 spills:fills, 3 sends",
            "said\tkey0-a\tVS SIMD8 shader: 22 inst, 0 loops, 9 cycles, 0:0 spills:fills, 1 sends",
            "linked\t0123456789abcdef-a.vert.glsl\t0123456789abcdef-b.frag.glsl",
            "said\tkey1-c\tShader Stats: VGPRS: 8 Code Size: 212 LDS: 0 Spilled SGPRs: 4 "
            "Spilled VGPRs: 5 DivergentLoop: 0 (CS, W64)",
            "linked\t0123456789abcdeX-c.comp.glsl\t"]

    def test_the_most_of_all_programs_of_a_shader_counts(self):
        costs, count = check_programs.costs_of(self.SAID)
        self.assertEqual({"a.vert.glsl": [22, 0], "b.frag.glsl": [40, 3], "c.comp.glsl": [212, 5]},
                         costs)
        self.assertEqual(2, count)

    def test_heavy_variants_have_limits_of_their_own(self):
        head = "#version 450 core\n#extension some : enable\n#define SAMPLES 4\n"
        self.assertEqual("", check_programs.variant_of(head + "// text\n#define HAS_MEDIA 1\n"))
        self.assertEqual("+cut+media", check_programs.variant_of(
            head + "#define SHADOW_HAS_MEDIA 1\n#define CUT_PLANES 1\n#define HAS_MEDIA 1\n"))
        self.assertEqual("+moments", check_programs.variant_of(
            head + "#define SHADOW_LISTS moments:13\n"))
        self.assertEqual("", check_programs.variant_of(head + "#define SHADOW_LISTS deep:1\n"))
        self.assertEqual("+net16", check_programs.variant_of(head + "#define NET 16\n"))
        costs, _ = check_programs.costs_of(self.SAID, lambda name: name[17:] + "+" + name[:1])
        self.assertEqual({"a.vert.glsl+0", "b.frag.glsl+0", "c.comp.glsl+0"}, set(costs))

    def test_what_grows_over_its_limit_or_has_none_is_a_fault(self):
        table = check_programs.read_table("# head\nskl a.vert.glsl 22 0\nskl b.frag.glsl 39 2\n")
        faults = check_programs.faults_of("skl", check_programs.costs_of(self.SAID)[0], table)
        self.assertEqual(3, len(faults), faults)
        self.assertIn("size 40, limit 39", faults[0])
        self.assertIn("3 spills, limit 2", faults[1])
        self.assertIn("c.comp.glsl: 212, 5 spills: no line", faults[2])

    def test_a_limit_that_no_program_answers_to_is_a_fault(self):
        table = check_programs.read_table("skl a.vert.glsl 22 0\nskl sort.comp.glsl 39 2\n"
                                          "tgl other.comp.glsl 39 2\n")
        faults = check_programs.absent_of("skl", check_programs.costs_of(self.SAID)[0], table)
        self.assertEqual(1, len(faults), faults)
        self.assertIn("skl sort.comp.glsl: has a limit", faults[0])


class Verdicts(unittest.TestCase):
    def test_only_what_asked_to_be_skipped_counts_as_skipped(self):
        with tempfile.TemporaryDirectory() as folder:
            report = pathlib.Path(folder) / "report.xml"
            report.write_text(REPORT)
            done = subprocess.run([sys.executable, str(sources.HERE / "junit_verdicts.py"),
                                   str(report)], capture_output=True, text=True, check=True)
        self.assertEqual(["passed\tunit.good", "failed\tunit.bad: ",
                          "skipped\tgpu.absent: skipped: no device",
                          "failed\tunit.unbuilt: Unable to find executable",
                          "failed\tunit.late: Timeout"], done.stdout.splitlines())


if __name__ == "__main__":
    sources.run_tests(__name__)
