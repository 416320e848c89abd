# SPDX-License-Identifier: MIT
"""Trade-offs over HTTP, with a renderer whose errors and times are known."""
import csv
import io
import json
import math
import os
import re
import signal
import struct
import time
import unittest
import xml.etree.ElementTree

import support
from support import glb, triangle_document, TRIANGLE, wait_until

support.needs(support.FAKE)

SMALL = {"width": 64, "height": 48}
HAZE = {"atmosphere": {"density": 0.1}}
SVG = "{http://www.w3.org/2000/svg}"


def scene_of(*nodes):
    """A scene whose node names tell the fake renderer what to do."""
    document = triangle_document("fake:tradeoff")
    for index, name in enumerate(nodes):
        document["nodes"].append({"name": name})
        document["scenes"][0]["nodes"].append(index + 1)
    return glb(document, TRIANGLE)


def smoky_scene():
    """Likewise, with a density grid of one value."""
    document = triangle_document("fake:tradeoff")
    at = len(TRIANGLE)
    document["buffers"][0]["byteLength"] = at + 4
    document["bufferViews"].append({"buffer": 0, "byteOffset": at, "byteLength": 4})
    document["accessors"].append({"bufferView": len(document["bufferViews"]) - 1,
                                  "componentType": 5126, "count": 1, "type": "SCALAR"})
    grid = {"name": "smoke", "size": [1, 1, 1], "values": len(document["accessors"]) - 1,
            "min": [0, 0, 0], "max": [1, 1, 1]}
    document["extensionsUsed"] = ["VITRAIL_density_grids"]
    document["extensions"] = {"VITRAIL_density_grids": {"grids": [grid]}}
    document["nodes"].append({"extensions": {"VITRAIL_density_grids": {"grid": 0}}})
    document["scenes"][0]["nodes"].append(len(document["nodes"]) - 1)
    return glb(document, TRIANGLE + struct.pack("<f", 1))


class TradeoffTest(support.ServiceTest):
    def begin(self, scene, expect=202, **members):
        body = {"scene": scene, **SMALL, **members}
        reply = self.daemon.request("POST", "/v1/tradeoffs", body)
        self.assertEqual(expect, reply.status, reply.body)
        return reply.header("Location") if expect == 202 else reply

    def end(self, path):
        def has_ended():
            return self.get(path)["state"] not in ("queued", "running")

        wait_until(has_ended, "the trade-off has ended", 60)
        return self.get(path)

    def get(self, path):
        return self.daemon.request("GET", path).json()

    def measure(self, scene, **members):
        return self.end(self.begin(scene, **members))

    def render(self, scene, members=None, **quality):
        """The report of a frame of the view that begin() measures."""
        reply = self.daemon.render(scene, **SMALL, **(members or {}), quality=quality)
        self.assertEqual(200, reply.status, reply.body)
        link = reply.header("Link")
        return self.get(link[link.index("<") + 1 : link.index(">")]), reply


class Measuring(TradeoffTest):
    def test_every_setting_has_times_error_and_bytes(self):
        document = self.measure(self.daemon.push(scene_of()))
        self.assertEqual(
            ("done", "ended", 1.0), tuple(document[k] for k in ("state", "stage", "progress"))
        )
        self.assertFalse(document["partial"])
        self.assertEqual(32, len(document["settings"]))
        self.assertEqual(
            (2, True),
            (document["counts"]["shadowed_lights"], document["counts"]["transparent_casters"]),
        )
        self.assertEqual(48, document["reference"]["rows_done"])
        for setting in document["settings"]:
            self.assertEqual(3, len(setting["warm_ms"]["runs"]), setting)
            self.assertGreaterEqual(setting["cold_ms"]["median"], setting["warm_ms"]["median"])
            self.assertGreater(setting["bytes"], 0)
            if setting["shadows"] == "deep":  # as the fake renderer makes them
                error = 16 / setting["shadow_resolution"] + 0.01 / setting["shadow_taps"] + 0.02
                self.assertAlmostEqual(error, setting["error"]["rmse"], 5)
                self.assertEqual(setting["shadow_resolution"] ** 2, setting["bytes"])
        said = " ".join(skip["because"] for skip in document["skipped"])
        self.assertIn("1 sample per pixel", said)
        self.assertIn("max_settings is 32", said)

    def test_counts_are_those_of_the_view_whatever_was_drawn_before(self):
        scene = self.daemon.push(scene_of("fake:slow=0", "counts"))
        for _ in range(2):
            self.assertEqual(1, self.measure(scene)["counts"]["triangles"])

    def test_the_front_is_that_of_the_numbers(self):
        settings = self.measure(self.daemon.push(scene_of()))["settings"]
        points = [(s["warm_ms"]["median"], s["error"]["rmse"], s["on_front"]) for s in settings]
        for ms, error, is_on_front in points:
            beaten = any(a <= ms and b <= error and (a, b) != (ms, error) for a, b, _ in points)
            self.assertFalse(beaten and is_on_front, (ms, error))
        self.assertGreater(sum(point[2] for point in points), 3)

    def test_what_quality_says_is_held_fixed(self):
        scene = self.daemon.push(scene_of())
        settings = self.measure(scene, quality={"shadows": "deep", "shadow_taps": 9})["settings"]
        self.assertEqual({("deep", 9)}, {(s["shadows"], s["shadow_taps"]) for s in settings})
        self.assertEqual(
            [256, 512, 1024, 2048, 4096],
            sorted(s["shadow_resolution"] for s in settings if not s["shadow_compression"])
        )
        self.assertEqual(5, sum(1 for s in settings if s["shadow_compression"]))
        settings = self.measure(
            scene, quality={"shadows": "deep", "shadow_taps": 9, "shadow_compression": 0.1}
        )["settings"]
        self.assertEqual({0.1}, {s["shadow_compression"] for s in settings})

    def test_traced_shadows_are_swept_where_their_lists_go_with_them(self):
        scene = self.daemon.push(scene_of())
        for quality, expected in (
            ({}, {0.03}),
            ({"shadows": "raytraced-shadows"}, {0.03}),
            ({"light_lists": "linked"}, set()),
        ):
            document = self.measure(scene, quality=quality)
            traced = [s for s in document["settings"] if s["shadows"] == "raytraced-shadows"]
            self.assertEqual({round(s["error"]["rmse"], 5) for s in traced}, expected, quality)
            if quality.get("shadows"):
                self.assertEqual(traced, document["settings"])

    def test_haze_is_swept_by_its_samples_and_a_clear_view_is_not(self):
        scene = self.daemon.push(scene_of("fake:slow=0", "haze"))
        options = {"max_settings": 128, "repeats": 1, "keep_images": False}
        clear = self.measure(scene, tradeoff=options)["settings"]
        self.assertEqual({None}, {s["atmosphere_samples"] for s in clear})
        said = self.measure(scene, tradeoff=options, quality={"atmosphere_samples": 16})["settings"]

        def settings(rows):  # all but times, which a clock has
            return [{k: v for k, v in row.items() if not k.endswith("_ms") and k != "on_front"}
                    for row in rows]

        self.assertEqual(settings(clear), settings(said))
        path = self.begin(scene, tradeoff=options, **HAZE, quality={"shadows": "deep"})
        hazy = self.end(path)["settings"]
        self.assertEqual({None, 16, 256}, {s["atmosphere_samples"] for s in hazy})
        rmse = {s["atmosphere_samples"]: s["error"]["rmse"] for s in hazy
                if (s["shadow_resolution"], s["shadow_taps"]) == (1024, 4)
                and not s["shadow_compression"]}
        self.assertAlmostEqual(0.03, rmse[16] - rmse[None], 5)  # as the fake renderer makes them
        self.assertAlmostEqual(0.0075, rmse[None] - rmse[256], 5)
        csv_text = self.daemon.request("GET", path + "?format=csv").body.decode()
        rows = list(csv.DictReader(io.StringIO(csv_text)))
        self.assertEqual([str(s["atmosphere_samples"] or "") for s in hazy],
                         [row["atmosphere_samples"] for row in rows])
        svg = self.daemon.request("GET", path + "?format=svg").body.decode()
        page = self.daemon.request("GET", path + "?format=html").body.decode()
        self.assertIn(", media 16: ", svg)
        self.assertIn(", media 256</td>", page)
        threads = [p for p in xml.etree.ElementTree.fromstring(svg).iter(SVG + "path")
                   if p.get("class") == "media"]
        bare = [s for s in hazy if s["atmosphere_samples"] is None]
        self.assertEqual(len(hazy) - len(bare) + 1, len(threads))  # one is the legend's

    def test_smoke_is_swept_by_its_samples_and_by_deep_maps_where_glass_casts_shadows(self):
        document = self.measure(self.daemon.push(smoky_scene()),
                                tradeoff={"max_settings": 128, "repeats": 1, "keep_images": False})
        self.assertTrue(document["counts"]["transparent_casters"])
        samples = {}
        for setting in document["settings"]:
            samples.setdefault(setting["shadows"], set()).add(setting["atmosphere_samples"])
        self.assertEqual({None, 16, 256}, samples["deep"])
        self.assertEqual({None, 4, 32}, samples["raytraced"])
        self.assertNotIn("raytraced-shadows", samples)  # which draws no smoke

    def test_samples_of_haze_that_were_said_are_held_fixed(self):
        scene = self.daemon.push(scene_of("fake:slow=0", "fixed"))
        document = self.measure(scene, **HAZE, quality={"atmosphere_samples": 48},
                                tradeoff={"max_settings": 6, "repeats": 1})
        self.assertEqual({48}, {s["atmosphere_samples"] for s in document["settings"]})

    def test_methods_for_transparent_surfaces_are_swept_where_some_are_in_view(self):
        options = {"max_settings": 128, "repeats": 1, "keep_images": False}
        clear = self.measure(self.daemon.push(scene_of("no layers")), tradeoff=options)
        self.assertEqual({None}, {s["transparency"] for s in clear["settings"]})
        path = self.begin(self.daemon.push(scene_of("fake:layers")), tradeoff=options)
        settings = self.end(path)["settings"]
        drawn = [s for s in settings if s["transparency"]]  # those that take a ground plane
        self.assertEqual({"weighted-blended", "stochastic", "moment-based", "sorted"},
                         {s["transparency"] for s in drawn})
        self.assertEqual(4, len(drawn))
        self.assertEqual({("deep", 1024, 4)}, {
            (s["shadows"], s["shadow_resolution"], s["shadow_taps"]) for s in drawn})
        text = self.daemon.request("GET", path + "?format=csv").body.decode()
        self.assertEqual([s["transparency"] or "" for s in settings],
                         [row["transparency"] for row in csv.DictReader(io.StringIO(text))])
        page = self.daemon.request("GET", path + "?format=html").body.decode()
        self.assertIn("<td>deep 1024, 4 taps, moment-based, 1 sample</td>", page)
        svg = self.daemon.request("GET", path + "?format=svg").body.decode()
        self.assertNotIn("media samples", svg)  # no threads between methods, nor in the legend

    def test_what_cannot_differ_is_skipped_with_its_reason(self):
        document = self.measure(self.daemon.push(support.triangle("plain")))
        self.assertEqual({"none", "raytraced"}, {s["shadows"] for s in document["settings"]})
        self.assertIn(
            "no light casts a shadow in this view", [s["because"] for s in document["skipped"]]
        )

    def test_every_form_can_be_read(self):
        path = self.begin(self.daemon.push(scene_of()), tradeoff={"repeats": 1})
        document = self.end(path)
        for accept, form in (("text/csv", "csv"), ("image/svg+xml", "svg"), ("text/html", "html")):
            by_accept = self.daemon.request("GET", path, headers={"Accept": accept})
            by_name = self.daemon.request("GET", f"{path}?format={form}")
            self.assertEqual(by_accept.body, by_name.body)
            self.assertTrue(by_name.header("Content-Type").startswith(accept))
            self.assertIn("default-src 'none'", by_name.header("Content-Security-Policy"))
        rows = list(
            csv.DictReader(
                io.StringIO(self.daemon.request("GET", path + "?format=csv").body.decode())
            )
        )
        self.assertEqual(
            [s["shadows"] for s in document["settings"]], [row["shadows"] for row in rows]
        )
        for row, setting in zip(rows, document["settings"]):
            self.assertTrue(
                math.isclose(float(row["rmse"]), setting["error"]["rmse"], rel_tol=1e-8)
            )
        root = xml.etree.ElementTree.fromstring(
            self.daemon.request("GET", path + "?format=svg").body
        )
        self.assertEqual(SVG + "svg", root.tag)
        marks = [group for group in root.iter(SVG + "g") if group.get("id")]
        self.assertEqual(len(document["settings"]), len(marks))
        self.check_colors(root)
        page = self.daemon.request("GET", path + "?format=html").body.decode()
        self.assertEqual(1 + len(document["settings"]), page.count("data:image/webp;base64,"))
        self.assertNotIn("<script", page)

    def check_colors(self, root):
        """Programs without CSS draw the plot as browsers do: all colours are attributes."""
        colour = r"#([0-9a-f]{3}){1,2}|none"

        def visit(element, fill, stroke):
            fill, stroke = element.get("fill", fill), element.get("stroke", stroke)
            kind = element.tag.replace(SVG, "")
            if kind in ("rect", "path", "circle", "text"):
                self.assertRegex(fill or "", f"^({colour})$", xml_text(element))
            if kind in ("line", "path"):
                self.assertRegex(stroke or "", f"^({colour})$", xml_text(element))
            for child in element:
                visit(child, fill, stroke)

        def xml_text(element):
            return xml.etree.ElementTree.tostring(element)

        visit(root, None, None)
        fills = {element.get("fill") for element in root.iter(SVG + "text")}
        self.assertNotIn(root.find(SVG + "rect").get("fill"), fills)
        drop = next(g for g in root.iter(SVG + "g") if g.get("class", "").startswith("point t6"))
        arc = re.search(r"v(\S+)a(\S+) (\S+) 0 1 1 (\S+) (\S+)z", drop.find(SVG + "path").get("d"))
        down, rx, ry, x, y = map(float, arc.groups())
        self.assertEqual((rx, ry, -rx, -ry), (down, down, x, y))

    def test_unknown_forms_are_refused(self):
        path = self.begin(self.daemon.push(scene_of()))
        self.end(path)
        self.assertEqual(400, self.daemon.request("GET", path + "?format=gif").status)
        reply = self.daemon.request("GET", path, headers={"Accept": "image/gif"})
        self.assertEqual((406, "not_acceptable"), (reply.status, reply.code))

    def test_bad_requests_are_refused_where_they_are_wrong(self):
        scene = self.daemon.push(scene_of())
        for members, pointer in (
            ({"tradeoff": {"speed": 1}}, "/tradeoff/speed"),
            ({"tradeoff": {"time_budget_s": -1}}, "/tradeoff/time_budget_s"),
            ({"tradeoff": {"repeats": 1e300}}, "/tradeoff/repeats"),
            ({"quality": {"max_error": 0.1}}, "/quality/max_error"),
            ({"output": "depth"}, "/output"),
        ):
            reply = self.begin(scene, 400, **members)
            self.assertEqual(("invalid_request", pointer), (reply.code, reply.json()["pointer"]))
        self.assertEqual("/scene", self.begin("0" * 64, 404).json()["pointer"])
        self.assertEqual("too_large", self.begin(scene, 413, width=16384, height=16384).code)
        reply = self.daemon.request("POST", "/v1/tradeoffs", b"{}", {"Content-Type": "text/plain"})
        self.assertEqual(415, reply.status)
        self.assert_serves()

    def test_unknown_ids_are_404(self):
        for method in ("GET", "DELETE"):
            for path in ("/v1/tradeoffs/" + "0" * 16, "/v1/tradeoffs/..%2f..%2flock"):
                self.assertEqual(404, self.daemon.request(method, path).status)

    def test_a_reference_that_does_not_fit_the_time_is_a_clear_failure(self):
        scene = self.daemon.push(scene_of("fake:slow=300"))
        document = self.measure(scene, tradeoff={"time_budget_s": 1})
        self.assertEqual(
            ("failed", True, "timeout"),
            (document["state"], document["partial"], document["problem"]["code"]),
        )
        self.assertIn("half of time_budget_s, 0.5 s, is for it", document["problem"]["detail"])
        self.assert_serves()

    def test_what_does_not_fit_the_time_is_left_out_and_said(self):
        scene = self.daemon.push(scene_of("fake:slow=20"))
        document = self.measure(scene, tradeoff={"time_budget_s": 3, "repeats": 20})
        self.assertEqual("done", document["state"])
        self.assertTrue(document["partial"])
        self.assertTrue(document["settings"])
        said = [skip["because"] for skip in document["skipped"]] + document["warnings"]
        self.assertTrue(any("time_budget_s" in sentence for sentence in said), said)

    def test_time_that_runs_leave_over_goes_to_what_had_no_room(self):
        scene = self.daemon.push(scene_of("fake:slow=0", "left"))  # quicker than its frames say
        document = self.measure(scene, tradeoff={"time_budget_s": 5})
        self.assertEqual(("done", False), (document["state"], document["partial"]), document)
        self.assertEqual(32, len(document["settings"]))
        self.assertEqual({3}, {len(s["cold_ms"]["runs"]) for s in document["settings"]})
        self.assertLess(document["elapsed_s"], 5)

    def test_one_setting_is_measured_however_little_time_there_is(self):
        scene = self.daemon.push(scene_of("fake:slow=600"))  # a probe and a band: 1.2 s
        document = self.measure(scene, height=1, tradeoff={"time_budget_s": 1})
        self.assertEqual(("done", True), (document["state"], document["partial"]), document)
        self.assertEqual(1, len(document["settings"]))
        self.assertTrue(document["settings"][0]["cold_ms"]["runs"])
        self.assertIn("one was measured nevertheless", " ".join(document["warnings"]))

    def test_elapsed_goes_on_while_a_step_takes_long(self):
        path = self.begin(self.daemon.push(scene_of("fake:slow=1000")))
        wait_until(lambda: self.get(path)["stage"] == "probe", "it has begun", 60)
        wait_until(lambda: self.get(path)["elapsed_s"] > 0.2, "time goes by", 60)
        one = self.get(path)
        self.assertEqual(("probe", 0.0), (one["stage"], one["progress"]))
        self.daemon.request("DELETE", path)

    def test_cancelling_keeps_what_is_measured_as_partial(self):
        path = self.begin(self.daemon.push(scene_of("fake:slow=20")), tradeoff={"repeats": 20})
        wait_until(lambda: self.get(path)["stage"] == "times", "timing has begun", 60)
        cancelled = self.daemon.request("DELETE", path)
        self.assertEqual((200, "cancelled"), (cancelled.status, cancelled.json()["state"]))
        document = self.get(path)
        self.assertTrue(document["partial"])
        self.assertTrue(document["settings"])
        self.assertEqual(200, self.daemon.request("DELETE", path).status)  # changes nothing
        self.assertEqual(document["settings"], self.get(path)["settings"])
        wait_until(
            lambda: self.daemon.request("DELETE", path + "?forget=true").status == 204,
            "it is forgotten",
        )
        self.assertEqual(404, self.daemon.request("GET", path).status)

    def test_one_that_waits_can_be_cancelled_but_not_forgotten(self):
        scene = self.daemon.push(scene_of("fake:slow=50"))
        first, second = self.begin(scene), self.begin(scene)
        self.assertEqual("queued", self.get(second)["state"])
        self.assertEqual(409, self.daemon.request("DELETE", second + "?forget=true").status)
        self.assertEqual(400, self.daemon.request("DELETE", second + "?forget=maybe").status)
        for query in ("?forgot=true", "?forget=true&forget=true", "?forget"):
            self.assertEqual(400, self.daemon.request("DELETE", second + query).status, query)
        self.assertEqual(400, self.daemon.request("GET", second + "?form=csv").status)
        for path in (second, first):
            self.assertEqual("cancelled", self.daemon.request("DELETE", path).json()["state"])
        listed = self.get("/v1/tradeoffs")["tradeoffs"]
        self.assertLess(
            *[
                [item["id"] for item in listed].index(path.split("/")[-1])
                for path in (second, first)
            ]
        )

    def test_too_many_that_wait_are_refused(self):
        scene = self.daemon.push(scene_of("fake:slow=50"))
        paths = [self.begin(scene)]
        wait_until(lambda: self.get(paths[0])["state"] == "running", "the first runs")
        paths += [self.begin(scene) for _ in range(16)]
        self.assertEqual("overloaded", self.begin(scene, 503).code)
        for path in reversed(paths):
            self.daemon.request("DELETE", path)

    def test_renders_go_before_a_measurement(self):
        slow = self.daemon.push(scene_of("fake:slow=30"))
        path = self.begin(slow, tradeoff={"repeats": 20})
        quick = self.daemon.push(support.triangle("quick"))
        waits = []
        for _ in range(10):
            started = time.monotonic()
            self.assertEqual(200, self.daemon.render(quick).status)
            waits.append(time.monotonic() - started)
        self.assertEqual("running", self.get(path)["state"])
        self.assertLess(sorted(waits)[5], 0.5)  # a step is 60 ms, all of them are seconds
        self.daemon.request("DELETE", path)

    def test_a_worker_that_dies_costs_its_steps_only(self):
        scene = self.daemon.push(scene_of("fake:crash-at-2048"))
        document = self.measure(scene, quality={"shadows": "deep", "shadow_taps": 4})
        self.assertEqual("done", document["state"])
        self.assertEqual(
            [256, 512, 1024, 4096],
            sorted(
                s["shadow_resolution"] for s in document["settings"] if not s["shadow_compression"]
            ),
        )
        lost = [skip for skip in document["skipped"] if "2048" in skip["what"]]
        self.assertIn("worker", lost[0]["because"])
        self.assertTrue(document["partial"])
        self.assertEqual(200, self.daemon.render(scene).status)  # the scene is not quarantined

    def test_deleting_the_scene_removes_its_trade_offs(self):
        scene = self.daemon.push(scene_of("fake:slow=1"))
        path = self.begin(scene)
        self.end(path)
        running = self.begin(scene)
        self.assertEqual(204, self.daemon.request("DELETE", "/v1/scenes/" + scene).status)
        for gone in (running, path):  # the first may be in the thread's hands yet, though done
            wait_until(lambda: self.daemon.request("GET", gone).status == 404, f"{gone} is gone")
        names = {path.split("/")[-1], running.split("/")[-1]}
        folder = os.path.join(self.daemon.state_dir, "tradeoffs")
        wait_until(lambda: not names & {name.split(".")[0] for name in os.listdir(folder)},
                   "their files are gone")


class Choosing(TradeoffTest):
    def test_max_error_takes_the_fastest_setting_that_keeps_it(self):
        scene = self.daemon.push(scene_of("fake:slow=0"))
        settings = self.measure(scene, tradeoff={"max_settings": 128})["settings"]
        for target in (0.03, 0.05, 0.3):
            frame, _ = self.render(scene, max_error=target)
            fitting = [s for s in settings if s["error"]["rmse"] <= target]
            best = min(s["cold_ms"]["max"] for s in fitting)
            self.assertEqual(best, frame["chosen"]["expected_ms"])
            self.assertEqual(
                ("rmse", "measured"), (frame["error"]["metric"], frame["error"]["source"])
            )
            self.assertLessEqual(frame["error"]["value"], target)
            self.assertEqual([], frame["warnings"])

    def test_budget_takes_the_most_accurate_setting_within_it(self):
        scene = self.daemon.push(scene_of("fake:slow=0", "b"))
        settings = self.measure(scene, tradeoff={"max_settings": 128})["settings"]
        for target in (5, 20, 50, 1000):
            frame, _ = self.render(scene, budget_ms=target)
            fitting = [s for s in settings if s["cold_ms"]["max"] <= target]
            best = min(s["error"]["rmse"] for s in fitting)
            self.assertAlmostEqual(best, frame["error"]["value"], 12)
            self.assertLessEqual(frame["chosen"]["expected_ms"], target)

    def test_an_error_below_all_that_was_measured_takes_more_samples(self):
        scene = self.daemon.push(scene_of("fake:slow=0", "more"))
        self.measure(scene)  # rays: 0.02 and 0.01 at 1 and 4 samples, 100 ms each
        for target, samples, rmse, ms in (
            ({"max_error": 0.003}, 64, 0.01 * 4 / 15.5, 6400),
            ({"max_error": 0.002}, 256, 0.01 * 2.2 / 15.5, 25600),
            ({"max_error": 0.009, "budget_ms": 2000}, 16, 0.01 * 7.5 / 15.5, 1600),
            ({"budget_ms": 7000}, 64, 0.01 * 4 / 15.5, 6400),
        ):
            frame, _ = self.render(scene, **target)
            self.assertEqual([], frame["warnings"])
            chosen, error = frame["chosen"], frame["error"]
            self.assertEqual(("raytraced", samples), (chosen["shadows"], chosen["samples"]), target)
            self.assertAlmostEqual(ms, chosen["expected_ms"], 6)
            self.assertAlmostEqual(rmse, error["value"], 6)
            self.assertEqual(("estimated", "estimated"), (chosen["source"], error["source"]))
            self.assertIn("fewer samples measured for this view", chosen["because"])
        frame, _ = self.render(scene, max_error=0.001)
        self.assertIn("max_error 0.001 is not kept", frame["warnings"][0])
        frame, _ = self.render(scene, max_error=0.006, shadows="deep")
        self.assertEqual("deep", frame["chosen"]["shadows"])

    def test_samples_of_haze_are_chosen_by_what_was_measured(self):
        scene = self.daemon.push(scene_of("fake:slow=0", "hazy"))
        self.measure(scene, **HAZE, quality={"shadows": "deep"}, tradeoff={"max_settings": 128})
        fixed = {"shadows": "deep", "shadow_resolution": 1024, "shadow_taps": 4, "samples": 1}
        for error, samples in ((0.09, 16), (0.06, None), (0.041, 256)):
            quality = {**fixed, "max_error": error}
            frame, chosen = self.render(scene, HAZE, **quality)
            self.assertEqual([], frame["warnings"])
            self.assertEqual(samples, frame["chosen"]["atmosphere_samples"], frame["chosen"])
            self.assertEqual("measured", frame["error"]["source"])
            plain = {**HAZE, "provenance": False}
            _, chosen = self.render(scene, plain, **quality)
            _, said = self.render(scene, plain, **fixed, atmosphere_samples=samples,
                                  shadow_fallback=error)
            self.assertEqual(chosen.header("ETag"), said.header("ETag"))
        frame, _ = self.render(scene, HAZE, **fixed, max_error=0.06, atmosphere_samples=16)
        self.assertEqual(16, frame["chosen"]["atmosphere_samples"])
        self.assertIn("max_error 0.06 is not kept", frame["warnings"][0])

    def test_a_method_that_was_measured_for_the_view_is_chosen_there_alone(self):
        scene = self.daemon.push(scene_of("fake:layers", "chosen"))
        self.measure(scene, tradeoff={"max_settings": 128})
        frame, _ = self.render(scene, budget_ms=10, shadows="deep", shadow_resolution=1024,
                               shadow_taps=4)
        self.assertEqual("sorted", frame["chosen"]["transparency"], frame["chosen"])
        other_view = {"clip_planes": [[0, 0, 1, 9]]}
        for members, quality in (({}, {"transparency": "lists"}), (other_view, {})):
            frame, _ = self.render(scene, members, budget_ms=10, shadows="deep",
                                   shadow_resolution=1024, shadow_taps=4, **quality)
            self.assertIsNone(frame["chosen"]["transparency"], frame["chosen"])

    def test_what_cannot_be_kept_is_warned_of_with_numbers(self):
        scene = self.daemon.push(scene_of("fake:slow=0", "c"))
        self.measure(scene)
        for quality, words in (
            ({"max_error": 1e-6}, ["max_error 1e-06 is not kept"]),
            ({"budget_ms": 0.01}, ["budget_ms 0.01 is not kept", "2 ms"]),
            (
                {"max_error": 1e-6, "budget_ms": 0.01},
                ["neither max_error 1e-06 nor budget_ms 0.01"],
            ),
        ):
            frame, _ = self.render(scene, **quality)
            for word in words:
                self.assertIn(word, frame["warnings"][0])

    def test_what_was_said_stays(self):
        scene = self.daemon.push(scene_of("fake:slow=0", "d"))
        self.measure(scene, tradeoff={"max_settings": 128})
        frame, _ = self.render(scene, max_error=1, shadows="deep", shadow_taps=9)
        self.assertEqual(("deep", 9), (frame["chosen"]["shadows"], frame["chosen"]["shadow_taps"]))
        frame, _ = self.render(scene, max_error=1, shadows="map", shadow_resolution=700)
        self.assertEqual(
            ("map", 700), (frame["chosen"]["shadows"], frame["chosen"]["shadow_resolution"])
        )
        self.assertEqual("estimated", frame["error"]["source"])

    def test_other_views_and_bare_scenes_are_estimated(self):
        scene = self.daemon.push(scene_of("fake:slow=0", "e"))
        frame, _ = self.render(scene, max_error=0.1)
        self.assertEqual("estimated", frame["error"]["source"])
        self.assertIn("forecast from counts", frame["chosen"]["because"])
        self.measure(scene, exposure_ev=1)
        frame, _ = self.render(scene, max_error=1)
        self.assertEqual("estimated", frame["error"]["source"])
        self.assertIn("another view", frame["chosen"]["because"])

    def test_the_image_is_that_of_the_chosen_setting(self):
        scene = self.daemon.push(scene_of("fake:slow=0", "f"))
        self.measure(scene)
        plain = {"provenance": False}  # which tells the error of the one and not of the other
        frame, chosen = self.render(scene, plain, max_error=0.03)
        wanted = {
            k: v
            for k, v in frame["chosen"].items()
            if k in ("shadows", "samples", "shadow_resolution", "shadow_taps",
                     "shadow_compression", "shadow_prefilter")
        }
        if wanted["shadows"] in ("auto", "deep"):
            wanted["shadow_fallback"] = 0.03
        other, said = self.render(scene, plain, **wanted)
        self.assertIsNone(other["chosen"])
        self.assertEqual((chosen.body, chosen.header("ETag")), (said.body, said.header("ETag")))

    def test_the_image_says_the_error_and_what_was_chosen(self):
        scene = self.daemon.push(scene_of("fake:slow=0", "says"))
        self.measure(scene)
        frame, chosen = self.render(scene, max_error=0.03)
        found = support.provenance(chosen.body)
        self.assertAlmostEqual(frame["error"].pop("value"), found["error"].pop("value"), 12)
        self.assertEqual(frame["error"], found["error"])
        self.assertIsNone(found["request"]["quality"]["max_error"])
        self.assertEqual(frame["chosen"]["shadows"], found["request"]["quality"]["shadows"])
        _, said = self.render(scene, **found["request"]["quality"])
        self.assertNotEqual(chosen.header("ETag"), said.header("ETag"))
        self.assertEqual(found["request"], support.provenance(said.body)["request"])

    def test_a_picture_for_a_target_is_not_sent_twice(self):
        scene = self.daemon.push(scene_of("fake:slow=0", "twice"))
        self.measure(scene)
        target = {"max_error": 0.03}
        _, reply = self.render(scene, **target)
        known = {"If-None-Match": reply.header("ETag")}

        def rendered():
            return self.daemon.request("GET", "/v1/stats").json()["renders"]["rendered"]

        before = rendered()
        again = self.daemon.request("POST", "/v1/renders",
                                    {"scene": scene, **SMALL, "quality": target}, known)
        self.assertEqual((304, b"", before), (again.status, again.body, rendered()))
        view = self.daemon.request(
            "POST", "/v1/views", {"scene": scene, **SMALL, "quality": target}
        ).header("Location")
        image = self.daemon.request("GET", view + "/image")
        for known, status in ((image.header("ETag"), 304), ('"another"', 200)):
            again = self.daemon.request("GET", view + "/image", headers={"If-None-Match": known})
            self.assertEqual((status, image.header("ETag")), (again.status, again.header("ETag")))
            self.assertEqual(status == 200, again.body == image.body)

    def test_a_request_without_a_target_chooses_nothing(self):
        scene = self.daemon.push(scene_of("fake:slow=0", "g"))
        self.measure(scene)
        frame, _ = self.render(scene)
        self.assertIsNone(frame["chosen"])

    def test_a_view_goes_by_warm_frames(self):
        scene = self.daemon.push(scene_of("fake:slow=0", "h"))
        settings = self.measure(scene, tradeoff={"max_settings": 128})["settings"]
        view = self.daemon.request(
            "POST", "/v1/views", {"scene": scene, **SMALL, "quality": {"budget_ms": 20}}
        )
        image = self.daemon.request("GET", view.header("Location") + "/image")
        link = image.header("Link")
        frame = self.get(link[link.index("<") + 1 : link.index(">")])
        fitting = [s for s in settings if s["warm_ms"]["max"] <= 20]
        best = min(s["error"]["rmse"] for s in fitting)
        self.assertAlmostEqual(best, frame["error"]["value"], 12)
        self.assertIn("warm", frame["chosen"]["because"])


class Kept(unittest.TestCase):
    def folder(self, daemon):
        return os.path.join(daemon.state_dir, "tradeoffs")

    def measure(self, daemon, scene, **members):
        reply = daemon.request("POST", "/v1/tradeoffs", {"scene": scene, **SMALL, **members})
        path = reply.header("Location")
        wait_until(
            lambda: daemon.request("GET", path).json()["state"] not in ("queued", "running"),
            "the trade-off has ended",
        )
        return path

    def test_results_survive_a_daemon_that_is_killed_and_are_chosen_from(self):
        with support.Daemon() as daemon:
            scene = daemon.wait_ready().push(scene_of())
            path = self.measure(daemon, scene)
            before = daemon.request("GET", path).json()
            running = daemon.request(
                "POST", "/v1/tradeoffs", {"scene": daemon.push(scene_of("fake:slow=50")), **SMALL}
            ).header("Location")
            wait_until(lambda: daemon.request("GET", running).json()["state"] == "running", "runs")
            daemon.stop(signal.SIGKILL)
            with support.Daemon(state_dir=daemon.state_dir) as again:
                again.wait_ready()
                self.assertEqual(before, again.request("GET", path).json())
                lost = again.request("GET", running).json()
                self.assertEqual(("failed", True), (lost["state"], lost["partial"]))
                page = again.request("GET", path + "?format=html").body
                self.assertEqual(33, page.count(b"data:image/webp"))
                reply = again.render(scene, **SMALL, quality={"max_error": 0.05})
                link = reply.header("Link")
                frame = again.request("GET", link[link.index("<") + 1 : link.index(">")]).json()
                self.assertEqual("measured", frame["error"]["source"])

    def test_what_frames_for_a_time_took_is_kept(self):
        with support.Daemon() as daemon:
            scene = daemon.wait_ready().push(scene_of())
            reply = daemon.render(scene, **SMALL, quality={"budget_ms": 1000})
            self.assertEqual(200, reply.status, reply.body)
            self.assertEqual(0, daemon.stop())
            kept = os.path.join(daemon.state_dir, "cache", "budgets-0.json")
            self.assertTrue(os.path.exists(kept))

    def test_a_measurement_of_a_daemon_that_is_killed_keeps_what_it_had(self):
        with support.Daemon() as daemon:
            scene = daemon.wait_ready().push(scene_of("fake:slow=150"))
            path = daemon.request(
                "POST", "/v1/tradeoffs", {"scene": scene, **SMALL}
            ).header("Location")

            def document():
                return daemon.request("GET", path).json()

            wait_until(lambda: document()["settings"], "a setting is measured", 60)
            first = document()
            wait_until(lambda: document()["elapsed_s"] > first["elapsed_s"] + 3, "time goes", 60)
            daemon.stop(signal.SIGKILL)
            with support.Daemon(state_dir=daemon.state_dir) as again:
                lost = again.wait_ready().request("GET", path).json()
                self.assertEqual(
                    ("failed", True, "interrupted"),
                    (lost["state"], lost["partial"], lost["problem"]["code"]),
                )
                self.assertEqual(first["settings"], lost["settings"][: len(first["settings"])])
                self.assertGreater(lost["elapsed_s"], first["elapsed_s"])
                self.assertEqual(first["reference"], lost["reference"])
                page = again.request("GET", path + "?format=html").body
                self.assertEqual(1 + len(lost["settings"]), page.count(b"data:image/webp"))

    def test_damaged_files_are_set_aside_and_half_written_ones_removed(self):
        with support.Daemon() as daemon:
            scene = daemon.wait_ready().push(scene_of())
            good, bad, torn = [
                self.measure(daemon, scene, tradeoff={"repeats": 1, "max_settings": n})
                for n in (1, 2, 3)
            ]
            self.assertEqual(0, daemon.stop())
            names = [path.split("/")[-1] for path in (good, bad, torn)]
            folder = self.folder(daemon)
            with open(os.path.join(folder, names[1] + ".json"), "r+b") as file:
                file.seek(200)
                file.write(b"#")
            os.truncate(os.path.join(folder, names[2] + ".json"), 100)
            for stray in ("0123456789abcdef.tmp", "0123456789abcdef.images", "x.json", "e.json"):
                with open(os.path.join(folder, stray), "wb") as file:
                    file.write(b"" if stray == "e.json" else b"x" * 80)
            with support.Daemon(state_dir=daemon.state_dir) as again:
                again.wait_ready()
                listed = again.request("GET", "/v1/tradeoffs").json()["tradeoffs"]
                self.assertEqual([names[0]], [item["id"] for item in listed])
                left = set(os.listdir(folder))
                self.assertTrue(
                    {
                        names[1] + ".json.corrupt",
                        names[2] + ".json.corrupt",
                        "x.json.corrupt",
                        "e.json.corrupt",
                    }
                    <= left
                )
                self.assertFalse({"0123456789abcdef.tmp", "0123456789abcdef.images"} & left)
                self.assertIn("is set aside: its digest is not that of its content", again.log())

    def test_a_signed_file_that_the_server_cannot_have_written_is_set_aside(self):
        with support.Daemon() as daemon:
            scene = daemon.wait_ready().push(scene_of())
            path = self.measure(daemon, scene, tradeoff={"max_settings": 1})
            self.assertEqual(0, daemon.stop())
            file_path = os.path.join(self.folder(daemon), path.split("/")[-1] + ".json")
            with open(file_path, "rb") as file:
                document = json.loads(file.read().split(b"\n", 1)[1])
            document["settings"][0]["warm_ms"]["runs"] = [-1, "x"]
            text = json.dumps(document).encode()
            with open(file_path, "wb") as file:
                file.write(support.sha256(text).encode() + b"\n" + text)
            with support.Daemon(state_dir=daemon.state_dir) as again:
                again.wait_ready()
                self.assertEqual([], again.request("GET", "/v1/tradeoffs").json()["tradeoffs"])
                self.assertTrue(os.path.exists(file_path + ".corrupt"))

    def test_a_result_of_another_device_promises_nothing(self):
        with support.Daemon() as daemon:
            scene = daemon.wait_ready().push(scene_of())
            path = self.measure(daemon, scene)
            self.assertEqual(0, daemon.stop())
            file_path = os.path.join(self.folder(daemon), path.split("/")[-1] + ".json")
            with open(file_path, "rb") as file:
                document = json.loads(file.read().split(b"\n", 1)[1])
            document["device"] = "a faster one"
            text = json.dumps(document).encode()
            with open(file_path, "wb") as file:
                file.write(support.sha256(text).encode() + b"\n" + text)
            with support.Daemon(state_dir=daemon.state_dir) as again:
                again.wait_ready()
                reply = again.render(scene, **SMALL, quality={"max_error": 0.05})
                link = reply.header("Link")
                frame = again.request("GET", link[link.index("<") + 1 : link.index(">")]).json()
                self.assertEqual("estimated", frame["error"]["source"])

    def test_stopping_ends_a_measurement_at_once(self):
        with support.Daemon() as daemon:
            scene = daemon.wait_ready().push(scene_of("fake:slow=500"))
            reply = daemon.request("POST", "/v1/tradeoffs", {"scene": scene, **SMALL})
            path = reply.header("Location")
            wait_until(lambda: daemon.request("GET", path).json()["state"] == "running", "runs")
            started = time.monotonic()
            self.assertEqual(0, daemon.stop())
            self.assertLess(time.monotonic() - started, 10)
            with support.Daemon(state_dir=daemon.state_dir) as again:
                again.wait_ready()
                document = again.request("GET", path).json()
                self.assertEqual(
                    ("failed", "interrupted"), (document["state"], document["problem"]["code"])
                )


support.run_tests()
