# SPDX-License-Identifier: MIT
"""The accuracy report tells what the log says: failures as failures, pictures, and broken lines."""

import base64
import html.parser
import json
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

SOURCE = pathlib.Path(__file__).resolve().parents[2]
MAKE_REPORT = SOURCE / "tests" / "accuracy" / "make_report.py"
PNG = base64.b64decode("iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR4nGNgYPj/HwADAgH/"
                       "p9oYxwAAAABJRU5ErkJggg==")


def result(**changes):
    return {"suite": "views", "scene": "panes", "technique": "deep", "metric": "rmse",
            "error": 1e-5, "tolerance": 1e-3, "ms": 12.5, "pass": True, "image": None,
            "difference": None, **changes}


class Page(html.parser.HTMLParser):
    """Cells by class, pictures, and whatever would be loaded from elsewhere."""

    def __init__(self, text):
        super().__init__()
        self.cells, self.images, self.addresses, self.open = [], [], [], []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        attrs = dict(attrs)
        self.addresses += [attrs[name] for name in ("src", "href") if name in attrs]
        if tag == "img":
            self.images.append(attrs)
        if tag not in ("img", "meta"):
            self.open.append(tag)
        if tag == "td":
            self.cells.append([attrs.get("class", ""), ""])

    def handle_endtag(self, tag):
        assert self.open.pop() == tag, f"</{tag}> closes nothing"

    def handle_data(self, data):
        if "td" in self.open:
            self.cells[-1][1] += data + " "


class Report(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.build = pathlib.Path(folder.name)
        (self.build / "accuracy").mkdir()

    def make(self, lines, code=0):
        """Runs the generator; returns the page, its text, the JSON and stderr."""
        text = "".join((line if isinstance(line, str) else json.dumps(line)) + "\n"
                       for line in lines)
        (self.build / "accuracy" / "results.jsonl").write_text(text, encoding="utf-8")
        return self.run_generator(code)

    def run_generator(self, code=0):
        done = subprocess.run([sys.executable, str(MAKE_REPORT), str(self.build), str(SOURCE)],
                              capture_output=True, text=True, check=False, timeout=60)
        self.assertEqual(done.returncode, code, done.stderr)
        self.assertNotIn("Traceback", done.stderr)
        text = (self.build / "accuracy" / "report.html").read_text(encoding="utf-8")
        report = json.loads((self.build / "accuracy" / "report.json").read_text(encoding="utf-8"))
        return Page(text), text, report, done.stderr

    def test_scenes_are_rows_and_techniques_are_columns(self):
        page, text, report, _ = self.make([
            result(), result(technique="map", error=5e-4, ms=3.25),
            result(scene="<rose> & lancets"), result(suite="extremes", metric="tau")])
        self.assertEqual([cell[0] for cell in page.cells], ["pass", "pass", "pass", "", "pass"])
        self.assertIn("1.0e-5", page.cells[0][1])
        self.assertIn("12 ms", page.cells[0][1])
        self.assertIn("3.2 ms", page.cells[1][1])
        self.assertIn("&lt;rose&gt; &amp; lancets", text)
        self.assertNotIn("<rose>", text)
        self.assertEqual((report["passed"], report["failed"]), (4, 0))
        self.assertIn("4 of 4 results within their tolerance", text)
        self.assertEqual(page.open, ["html"][:len(page.open)], "every element is closed")

    def test_a_failing_row_shows_as_failing_and_fails_nothing_a_second_time(self):
        page, text, report, error = self.make([
            result(), result(technique="map", error=0.5, **{"pass": False})])
        self.assertEqual([cell[0] for cell in page.cells], ["pass", "fail"])
        self.assertIn("FAIL 0.5", page.cells[1][1])
        self.assertIn('<p class="verdict fail">1 of 2 results out of tolerance', text)
        self.assertIn('<li class="fail">views: panes, map: rmse 0.5, limit 0.001</li>', text)
        self.assertEqual(report["failed"], 1)
        self.assertEqual(error, "")

    def test_the_worst_of_several_results_stands_for_them(self):
        page, _, _, _ = self.make([result(error=1e-4), result(error=9e-4), result(error=2e-4)])
        self.assertEqual(len(page.cells), 1)
        self.assertIn("9.0e-4", page.cells[0][1])
        self.assertIn("worst of 3", page.cells[0][1])
        page, _, _, _ = self.make([result(error=1e-9, **{"pass": False}), result(error=9e-4)])
        self.assertEqual(page.cells[0][0], "fail")

    def test_values_that_are_not_finite_are_said(self):
        page, _, _, _ = self.make([result(error=None, ms=None, **{"pass": False})])
        self.assertIn("FAIL not finite", page.cells[0][1])

    def test_pictures_are_inside_and_nothing_is_loaded_from_elsewhere(self):
        (self.build / "accuracy" / "a.png").write_bytes(PNG)
        page, text, _, _ = self.make([
            result(image="accuracy/a.png", difference="accuracy/a.png"),
            result(technique="map", image="accuracy/gone.png")])
        self.assertEqual(len(page.images), 2)
        data = page.images[0]["src"].partition("base64,")[2]
        self.assertEqual(base64.b64decode(data), PNG)
        self.assertIn("panes, deep: difference", page.images[1]["alt"])
        self.assertIn("no picture: accuracy/gone.png", text)
        self.assertTrue(all(address.startswith("data:") for address in page.addresses))
        self.assertNotRegex(text, r"https?://|@import|url\(")

    def test_no_file_outside_the_build_folder_gets_into_the_page(self):
        outside = self.build.parent / (self.build.name + ".secret")
        outside.write_bytes(PNG)
        self.addCleanup(outside.unlink)
        page, text, _, _ = self.make([result(image=f"../{outside.name}"),
                                      result(image=str(outside))])
        self.assertEqual(page.images, [])
        self.assertIn("no picture", text)

    def test_large_pictures_are_linked_beside_the_report(self):
        (self.build / "accuracy" / "big.png").write_bytes(PNG + bytes(3 << 20))
        page, _, _, _ = self.make([result(image="accuracy/big.png")])
        self.assertEqual(page.images[0]["src"], "../accuracy/big.png")

    def test_broken_lines_are_told_and_the_others_are_still_reported(self):
        page, text, report, error = self.make([
            result(), "{not json", "[1]", {"suite": "x"}, result(error="much"), ""], code=1)
        self.assertEqual(len(page.cells), 1)
        self.assertEqual(len(report["faults"]), 4)
        for number, why in ((2, "is no JSON"), (3, "is no object"), (4, "has no scene"),
                            (5, "error is no number")):
            self.assertIn(f"results.jsonl:{number}: {why}", error)
        self.assertIn('class="verdict fail"', text)

    def test_an_empty_or_missing_log_is_a_failure(self):
        _, text, _, _ = self.make([], code=1)
        self.assertIn("nothing was logged", text)
        (self.build / "accuracy" / "results.jsonl").unlink()
        self.run_generator(code=1)

    def test_device_date_and_commit_are_named(self):
        (self.build / "accuracy" / "device.txt").write_text("llvmpipe\n", encoding="utf-8")
        _, text, report, _ = self.make([result()])
        self.assertEqual(report["device"], "llvmpipe")
        self.assertRegex(report["date"], r"\A\d{4}-\d\d-\d\d \d\d:\d\d UTC\Z")
        for fact in (report["device"], report["date"], report["commit"]):
            self.assertIn(fact, text)

    def test_the_page_is_fit_for_light_and_dark(self):
        _, text, _, _ = self.make([result()])
        self.assertIn("prefers-color-scheme: dark", text)
        defined = set(re.findall(r"(--[a-z-]+):", text))
        self.assertEqual(set(re.findall(r"var\((--[a-z-]+)\)", text)) - defined, set())


class Check(unittest.TestCase):
    def test_check_makes_the_report_after_the_tests_and_fails_only_if_it_cannot(self):
        check = (SOURCE / "check").read_text(encoding="utf-8")
        tests = re.search(r"^run_tests .*\baccuracy\b", check, re.M)
        self.assertIsNotNone(tests)
        self.assertGreater(check.index("tests/accuracy/make_report.py"), tests.start())
        self.assertIn('count_failure "accuracy report"', check)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
