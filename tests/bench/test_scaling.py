# SPDX-License-Identifier: MIT
"""The scaling suite measures every series, and the plotter draws each with points and exponent."""

import copy
import json
import math
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree as xml

PROGRAM = pathlib.Path(sys.argv.pop(1)) / "vitrail-bench"
PLOTTER = pathlib.Path(__file__).with_name("plot_scaling.py")
SVG = "{http://www.w3.org/2000/svg}"
FORMS = {"deep", "deep-linked", "linked-faithful"}
SUBJECTS = {("panes", "build"): {f"build cpu, {form}" for form in FORMS},
            ("panes", "lookup"): {f"lookup cpu, {form}" for form in FORMS},
            ("quads", "build"): {f"build cpu, {form}" for form in FORMS},
            ("quads", "lookup"): {f"lookup cpu, {form}" for form in FORMS},
            ("demo", "map side"): {f"build cpu, {form}" for form in FORMS},
            ("demo", "lights"): {"light list cpu", "frame cpu", "cpu that lights add"},
            ("assembly", "objects"): {
                f"frame cpu, {kind}" for kind in ("all in view", "from amid", "shadows rebuilt",
                                                  "one part moves", "25 standing shadows")}}


def plot(document, folder):
    return subprocess.run([sys.executable, str(PLOTTER), "-", "-o", folder], text=True,
                          input=document, capture_output=True, check=False, timeout=60)


def made_up(points, exponent):
    """A document of one series of these points."""
    series = {"suite": "scaling", "scene": "demo", "subject": "map side", "name": "a <b> & c",
              "of": "texels", "unit": "ms", "points": points, "exponent": exponent}
    return {"machine": {"device": "a device", "processor": "a processor", "cores": 2,
                        "load_begin": 0.5, "load_end": 1.5, "date": "2001-02-03T04:05:06Z",
                        "protocol": "5 to 9 rounds"},
            "results": [], "series": [series],
            "checks": [dict(series, name="exponent of a <b> & c", value=exponent,
                            target="<= 2.1", is_met=exponent <= 2.1)]}


class Figures(unittest.TestCase):
    """Of points that are known."""

    def draw(self, document):
        with tempfile.TemporaryDirectory() as folder:
            done = plot(json.dumps(document), folder)
            self.assertEqual(0, done.returncode, done.stderr)
            path = pathlib.Path(folder) / "scaling-demo-map-side.svg"
            return path.read_text(encoding="utf-8"), xml.parse(path).getroot()

    def test_a_power_law_has_its_exponent_and_its_points_lie_on_its_line(self):
        points = [[x, 0.5 * x ** 1.5] for x in (4, 16, 64)]
        text, root = self.draw(made_up(points, 1.5))
        line = root.find(f".//{SVG}path[@data-exponent]")
        self.assertAlmostEqual(1.5, float(line.get("data-exponent")), places=4)
        x0, y0, x1, y1 = map(float, re.findall(r"[\d.]+", line.get("d")))
        dots = root.findall(f".//{SVG}g[@class='series s0']/{SVG}circle")
        self.assertEqual(4, len(dots))  # one of them in the legend
        for dot in dots[:3]:
            share = (float(dot.get("cx")) - x0) / (x1 - x0)
            self.assertAlmostEqual(y0 + share * (y1 - y0), float(dot.get("cy")), delta=0.2)
        self.assertIn("a &lt;b&gt; &amp; c: exponent 1.50 (≤ 2.10, met)", text)
        for words in ("a device", "a processor", "2001-02-03T04:05:06Z", "5 to 9 rounds",
                      "load 0.5 to 1.5"):
            self.assertIn(words, text)

    def test_it_has_colours_for_light_and_for_dark(self):
        text, _ = self.draw(made_up([[1, 1], [2, 2]], 1))
        light, dark = text.split("@media(prefers-color-scheme:dark)")
        self.assertIn(".paper{fill:#ffffff}", light)
        self.assertRegex(dark, r"\.paper\{fill:#1\w+\}")

    def test_points_lost_in_noise_are_left_out_and_counted(self):
        text, root = self.draw(made_up([[1, None], [2, 2], [4, 8]], 2))
        self.assertIn("; 1 lost in noise", text)
        self.assertEqual("2", root.find(f".//{SVG}g[@data-points]").get("data-points"))

    def test_a_series_without_points_is_named_beside_the_others(self):
        document = made_up([[1, 1], [2, 2]], 1)
        document["series"].append(dict(document["series"][0], name="lost", exponent=None,
                                       points=[[1, None], [2, None]]))
        text, root = self.draw(document)
        self.assertIn("lost: too few points for an exponent; 2 lost in noise", text)
        self.assertEqual(2, len(root.findall(f".//{SVG}g[@data-points]")))

    def test_more_lines_than_colours_differ_in_marker_and_dash(self):
        document = made_up([[1, 1], [2, 2]], 1)
        document["series"] = [dict(document["series"][0], name=f"line {i}") for i in range(9)]
        _, root = self.draw(document)
        looks = set()
        for group in root.findall(f".//{SVG}g[@data-points]"):
            fit, mark = group.find(f"{SVG}path[@class='fit']"), group.find(f".//*[@class='mark']")
            shape = re.sub(r"[\d.]+", "", mark.get("d", "circle"))
            looks.add((group.get("class"), fit.get("stroke-dasharray"), shape))
        self.assertEqual(9, len(looks))

    def test_missed_bounds_are_said(self):
        text, _ = self.draw(made_up([[1, 1], [2, 8]], 3))
        self.assertIn("exponent 3.00 (≤ 2.10, missed)", text)

    def test_what_is_not_a_document_with_series_is_refused(self):
        empty = copy.deepcopy(made_up([[1, 1], [2, 2]], 1))
        empty["series"] = []
        for text in ("", "{}", "[]", json.dumps(empty)):
            with tempfile.TemporaryDirectory() as folder:
                done = plot(text, folder)
                self.assertNotEqual(0, done.returncode, text)
                self.assertRegex(done.stderr, r"^plot_scaling\.py: -: ", text)
                self.assertEqual([], list(pathlib.Path(folder).iterdir()))


class Scaling(unittest.TestCase):
    """Of the real program."""

    @classmethod
    def setUpClass(cls):
        done = subprocess.run([str(PROGRAM), "scaling", "--quick", "--json", "--size", "96x64",
                               "--seconds", "1"], capture_output=True, text=True, check=False,
                              timeout=110)
        if done.returncode == 77:
            print(done.stderr, file=sys.stderr)
            sys.exit(77)
        assert done.returncode == 0, done.stderr
        cls.document = json.loads(done.stdout)
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        drawn = plot(done.stdout, cls.folder.name)
        assert drawn.returncode == 0, drawn.stderr

    def figure(self, scene, subject):
        name = f"scaling-{scene}-{subject}.svg".replace(" ", "-")
        return pathlib.Path(self.folder.name) / name

    def test_every_series_is_measured(self):
        names = {}
        for series in self.document["series"]:
            names.setdefault((series["scene"], series["subject"]), set()).add(series["name"])
        self.assertEqual(SUBJECTS, names)

    def test_exponents_are_those_of_the_points_and_are_checks(self):
        checks = {(c["scene"], c["subject"], c["name"]): c for c in self.document["checks"]}
        for series in self.document["series"]:
            check = checks[series["scene"], series["subject"], f"exponent of {series['name']}"]
            self.assertEqual(series["exponent"], check["value"])
            if "linked" not in series["name"] or series["subject"] == "map side":
                self.assertRegex(check["target"], r"^<= \d")
            first, last = series["points"][0], series["points"][-1]
            if len(series["points"]) == 2 and first[1] and last[1]:
                self.assertAlmostEqual(math.log(last[1] / first[1]) / math.log(last[0] / first[0]),
                                       series["exponent"], places=3)

    def test_every_series_is_drawn_with_its_points_and_its_exponent(self):
        for (scene, subject), names in SUBJECTS.items():
            root = xml.parse(self.figure(scene, subject)).getroot()
            drawn = {g.get("data-name"): g for g in root.iter(f"{SVG}g")}
            text = " ".join(t.text or "" for t in root.iter(f"{SVG}text"))
            self.assertEqual(names, set(drawn))
            for series in self.document["series"]:
                if (series["scene"], series["subject"]) != (scene, subject):
                    continue
                group = drawn[series["name"]]
                points = [p for p in series["points"] if p[1] is not None]
                marks = [m for m in group.iter() if m.get("class") == "mark"]
                self.assertEqual(len(points), len(marks) - 1)  # the last is the legend's
                if series["exponent"] is None:
                    continue
                line = group.find(f"{SVG}path[@data-exponent]")
                self.assertAlmostEqual(series["exponent"], float(line.get("data-exponent")),
                                       places=2)
                self.assertIn(f"{series['name']}: exponent {series['exponent']:.2f}", text)
            self.assertIn(self.document["machine"]["device"], text)
            self.assertIn(self.document["machine"]["date"], text)
            self.assertIn(self.document["machine"]["protocol"], text)

    def test_the_page_has_all_figures_and_needs_nothing_else(self):
        page = (pathlib.Path(self.folder.name) / "scaling.html").read_text(encoding="utf-8")
        self.assertEqual(len(SUBJECTS), page.count("<svg "))
        for scene, subject in SUBJECTS:
            self.assertIn(self.figure(scene, subject).read_text(encoding="utf-8"), page)
        self.assertNotRegex(page, r"<(script|link|img|iframe)|\b(src|href)=|url\(|@import")


if __name__ == "__main__":
    unittest.main()
