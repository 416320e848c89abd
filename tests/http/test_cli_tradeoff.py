# SPDX-License-Identifier: MIT
"""`vitrail tradeoff`, and what `vitrail render` says of its choice, against the fake renderer."""
import csv
import json
import os
import signal
import subprocess
import tempfile
import xml.etree.ElementTree

import support
from support import glb, triangle_document, TRIANGLE, wait_until

VITRAIL = os.path.join(support.BIN, "vitrail")
support.needs(support.FAKE)
support.needs(VITRAIL)


def scene_of(*nodes):
    document = triangle_document("fake:tradeoff")
    for index, name in enumerate(nodes):
        document["nodes"].append({"name": name})
        document["scenes"][0]["nodes"].append(index + 1)
    return glb(document, TRIANGLE)


class Tradeoff(support.ServiceTest):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory(prefix="vitrail-cli-")
        self.addCleanup(self.folder.cleanup)

    def path(self, name):
        return os.path.join(self.folder.name, name)

    def scene(self, *nodes):
        with open(self.path("scene.glb"), "wb") as file:
            file.write(scene_of(*nodes))
        return self.path("scene.glb")

    def start(self, *arguments):
        return subprocess.Popen(
            [VITRAIL, *arguments, "--server", f"http://127.0.0.1:{self.daemon.port}"],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def run_cli(self, *arguments, code=0):
        process = self.start(*arguments)
        out, err = process.communicate(timeout=60)
        self.assertEqual(code, process.returncode, out + err)
        return out, err

    def measure(self, *arguments, code=0, nodes=()):
        return self.run_cli(
            "tradeoff", self.scene(*nodes), "--size", "64x48", *arguments, code=code
        )

    def read(self, name):
        with open(self.path(name), encoding="utf-8") as file:
            return file.read()

    def test_the_front_is_printed(self):
        out, err = self.measure("--repeats", "1")
        self.assertIn(", done: fake", out)
        self.assertIn("raytraced", out)
        self.assertEqual("", err)

    def test_each_extension_is_its_form(self):
        for name in ("t.json", "t.csv", "t.svg", "t.html"):
            self.measure("--repeats", "1", "--max-settings", "4", "-o", self.path(name))
        self.assertEqual(4, len(json.loads(self.read("t.json"))["settings"]))
        self.assertEqual(5, len(list(csv.reader(self.read("t.csv").splitlines()))))
        self.assertTrue(xml.etree.ElementTree.fromstring(self.read("t.svg")).tag.endswith("svg"))
        self.assertTrue(self.read("t.html").startswith("<!doctype html>"))

    def test_json_goes_to_stdout(self):
        out, _ = self.measure("--json", "--max-settings", "3", "--no-images")
        document = json.loads(out)
        self.assertEqual(3, len(document["settings"]))
        self.assertFalse(document["tradeoff"]["keep_images"])
        out, _ = self.measure("-o", "-", "--max-settings", "2")
        self.assertEqual(2, len(json.loads(out)["settings"]))

    def test_wrong_command_lines_are_refused_before_anything_is_sent(self):
        for arguments, word in (
            (["-o", self.path("t.png")], ".html"),
            (["--repeats", "2.5"], "whole number"),
            (["--size", "64"], "64"),
        ):
            _, err = self.measure(*arguments, code=2)
            self.assertIn(word, err)

    def test_refusals_of_the_server_are_told(self):
        _, err = self.measure("--time-budget", "0", code=1)
        self.assertIn("/tradeoff/time_budget_s", err)
        _, err = self.measure("--set", "/quality/max_error=1", code=1)
        self.assertIn("/quality/max_error", err)

    def test_a_failed_measurement_exits_with_1_and_its_reason(self):
        _, err = self.measure("--time-budget", "1", code=1, nodes=["fake:slow=300"])
        self.assertIn("the trade-off failed: the reference", err)

    def test_an_interrupt_cancels_and_writes_what_there_is(self):
        process = self.start(
            *("tradeoff", self.scene("fake:slow=20"), "--size", "64x48", "--repeats", "20"),
            *("-o", self.path("part.json"), "--progress", "json"),
        )
        while True:  # progress comes as lines of JSON
            line = json.loads(process.stderr.readline())
            if line["stage"] == "measuring" and line["progress"] > 72:
                break
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=30)
        self.assertEqual(128 + signal.SIGINT, process.returncode, err)
        document = json.loads(self.read("part.json"))
        self.assertEqual(("cancelled", True), (document["state"], document["partial"]))
        self.assertTrue(document["settings"])
        listed = self.daemon.request("GET", "/v1/tradeoffs").json()["tradeoffs"]
        self.assertEqual("cancelled", listed[0]["state"])
        wait_until(lambda: self.daemon.stats()["renders"]["in_flight"] == 0, "nothing is left")

    def test_a_render_says_what_was_chosen(self):
        exposed = ("--size", "64x48", "--exposure", "0")
        self.measure("--repeats", "1", "--exposure", "0", nodes=["n"])
        out, _ = self.run_cli(
            *("render", self.scene("n"), *exposed, "-o", self.path("a.png")),
            *("--max-error", "0.05"),
        )
        self.assertRegex(out, r"chosen: deep \d+, \d+ taps?.*measured for this view")
        out, _ = self.run_cli(
            *("render", self.scene("n"), *exposed, "-o", self.path("a.png")),
            *("--budget-ms", "20", "--json"),
        )
        result = json.loads(out)
        self.assertLessEqual(result["chosen"]["expected_ms"], 20)
        self.assertEqual("measured", result["error"]["source"])


if __name__ == "__main__":
    support.run_tests()
