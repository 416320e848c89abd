# SPDX-License-Identifier: MIT
"""`shadows: auto` takes the faster technique by measuring the device: what it says, and that the
same request keeps its picture."""
import hashlib
import json
import os
import re
import time
import unittest

import support
from sockets import WebSocket
from test_service_real import lit_floor

REAL = os.path.join(support.BIN, "vitraild")
support.needs(REAL)

SIZE = {"width": 96, "height": 64}


def open_daemon(*flags, state_dir=None):
    """One whose speed is known, which is measured after it is ready."""
    daemon = support.Daemon(*flags, program=REAL, state_dir=state_dir).wait_device()
    support.wait_until(lambda: not is_pending(daemon), "the speed is known", 60)
    return daemon


def is_pending(daemon):
    return automatic(daemon).get("pending", False)


def automatic(daemon):
    return daemon.request("GET", "/v1/capabilities").json()["device"]["auto"]


def render(daemon, scene, quality=None, headers=None, **members):
    """The reply and the frame's report."""
    body = {**SIZE, **members, "quality": quality or {}}
    reply = daemon.render(scene, headers, timeout=300, **body)
    if reply.status == 304:
        return reply, None
    assert reply.status == 200, reply.body[:500]
    link = reply.header("Link")
    return reply, daemon.request("GET", link[link.index("<") + 1 : link.index(">")]).json()


class Measured(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.daemon = open_daemon()
        cls.scene = cls.daemon.push(lit_floor())

    @classmethod
    def tearDownClass(cls):
        with cls.daemon:
            assert cls.daemon.stop() == 0

    def test_capabilities_and_log_tell_the_rates(self):
        told = automatic(self.daemon)
        self.assertEqual("measured", told["policy"])
        self.assertRegex(told["note"], r"^measured at this start in \d+ ms$")
        for group in ("speed", "rates"):
            self.assertTrue(all(value > 0 for value in told[group].values()), told)
        self.assertIn("shadow_ray_ns", told["rates"])
        self.assertRegex(self.daemon.log(), r"shadows auto takes the faster by forecast: .* ns")

    def test_the_choice_is_the_forecast_and_is_told(self):
        _, report = render(self.daemon, self.scene)
        chosen = report["chosen"]
        self.assertEqual("calibrated", chosen["source"])
        number = r"([\d.e+-]+) ms "
        sentence = f"forecast {number}ray traced, {number}rasterised, {number}with traced shadows"
        numbers = re.search(sentence, chosen["because"])
        traced, raster, mixed = (float(numbers.group(i)) for i in (1, 2, 3))
        rays = "raytraced" if traced <= mixed else "raytraced-shadows"
        self.assertEqual(rays if min(traced, mixed) < 0.9 * raster else "deep", chosen["shadows"])
        passes = {one["pass"] for one in report["plan"]}
        self.assertEqual(chosen["shadows"] == "raytraced", "raytrace.trace" in passes)
        body = {"scene": self.scene, **SIZE}
        plan = self.daemon.request("POST", "/v1/renders?explain=json", body).json()
        traced_need = next(one for one in plan["requirements"] if one["name"] == "traced")
        self.assertEqual(chosen["because"], traced_need["because"])

    def test_the_same_request_keeps_picture_and_tag(self):
        for _ in range(8):  # until what is learned of it is settled
            render(self.daemon, self.scene)
        first, report = render(self.daemon, self.scene)
        render(self.daemon, self.scene, {"shadows": "deep"})  # what is kept now decides nothing
        render(self.daemon, self.scene, {"shadows": "raytraced"})
        second, again = render(self.daemon, self.scene)
        self.assertEqual(first.body, second.body)
        self.assertEqual(first.header("ETag"), second.header("ETag"))
        for told in (report["chosen"], again["chosen"]):
            self.assertGreater(told.pop("took_ms"), 0)
            told.pop("missed")
        self.assertEqual(report["chosen"], again["chosen"])
        unchanged, _ = render(
            self.daemon, self.scene, headers={"If-None-Match": first.header("ETag")}
        )
        self.assertEqual(304, unchanged.status)

    def test_the_picture_is_that_of_the_chosen_technique(self):
        reply, report = render(self.daemon, self.scene, provenance=False)
        named, explicit = render(self.daemon, self.scene, {"shadows": report["chosen"]["shadows"]},
                                 provenance=False)  # which tells what was asked for
        self.assertEqual(reply.body, named.body)
        self.assertIsNone(explicit["chosen"])

    def test_what_was_expected_and_taken_is_told_and_counted(self):
        _, report = render(self.daemon, self.scene)
        chosen = report["chosen"]
        self.assertGreater(chosen["took_ms"], 0)
        self.assertLessEqual(chosen["took_ms"], report["timings_ms"]["total"] + 1e-3)
        over = chosen["took_ms"] - chosen["expected_ms"]
        if over <= 4 or over <= 0.5 * chosen["expected_ms"]:
            self.assertIsNone(chosen["missed"])
        else:
            self.assertIn("expected", chosen["missed"])
        text = self.daemon.request("GET", "/metrics").body.decode()
        count = re.search(
            rf'vitrail_forecast_ratio_count{{shadows="{chosen["shadows"]}"}} (\d+)', text
        )
        self.assertGreaterEqual(int(count.group(1)), 1)
        self.assertIn("# TYPE vitrail_forecast_misses_total counter", text)

    def test_what_only_maps_have_is_rasterised(self):
        for quality in ({"shadow_resolution": 256}, {"shadow_taps": 9}, {"light_lists": "linked"}):
            _, report = render(self.daemon, self.scene, quality)
            self.assertIsNone(report["chosen"], quality)
            self.assertIn("shade.opaque", {one["pass"] for one in report["plan"]}, quality)

    def test_what_is_chosen_goes_with_linked_lists(self):
        for target in ({"budget_ms": budget} for budget in (1, 10, 100, 1000, 10000)):
            _, report = render(self.daemon, self.scene, {"light_lists": "linked", **target})
            self.assertNotEqual("raytraced-shadows", report["chosen"]["shadows"], target)

    def test_a_view_at_rest_is_one_picture_however_it_is_asked_for(self):
        body = {"scene": self.scene, **SIZE}
        path = self.daemon.request("POST", "/v1/views", body).header("Location")
        digests = set()
        for _ in range(2):
            reply = self.daemon.request("GET", path + "/image", headers={"Accept": "image/png"})
            self.assertEqual(200, reply.status, reply.body)
            digests.add((hashlib.sha256(reply.body).hexdigest(), reply.header("ETag")))
        self.assertEqual(1, len(digests))
        tag = digests.pop()[1]
        reply = self.daemon.request(
            "GET", path + "/image", headers={"Accept": "image/png", "If-None-Match": tag}
        )
        self.assertEqual(304, reply.status)


class Idle(unittest.TestCase):
    def timings(self, daemon):
        text = daemon.request("GET", "/metrics").body.decode()
        found = re.findall(r'vitrail_idle_timings_total\{end="(\w+)"\} (\d+)', text)
        self.assertEqual(["finished", "stopped"], [end for end, _ in found])
        return sum(int(count) for _, count in found)

    def rest(self, daemon):
        """Pictures of a view, and a second and more in which nobody asks."""
        body = {"scene": daemon.push(lit_floor()), **SIZE}
        path = daemon.request("POST", "/v1/views", body).header("Location")
        for i in range(4):
            patch = {"camera": {"eye": [0, 1 + 0.1 * i, 3], "target": [0, 0, 0]}}
            daemon.request("PATCH", path, patch, {"Content-Type": "application/merge-patch+json"})
            reply = daemon.request("GET", path + "/image", headers={"Accept": "image/png"})
            self.assertEqual(200, reply.status, reply.body)
        time.sleep(2.5)
        again = daemon.request("GET", path + "/image", headers={"Accept": "image/png"})
        self.assertEqual(200, again.status)

    def test_timings_are_counted_and_pictures_come_after_them(self):
        with open_daemon() as daemon:
            self.rest(daemon)
            self.assertLessEqual(self.timings(daemon), 2)
            assert daemon.stop() == 0

    def test_nothing_is_timed_where_the_technique_is_set(self):
        with open_daemon("--auto", "raster") as daemon:
            self.rest(daemon)
            self.assertEqual(0, self.timings(daemon))
            assert daemon.stop() == 0


class MeasuredView(unittest.TestCase):
    def test_a_measurement_of_the_view_takes_the_place_of_the_forecast(self):
        with open_daemon() as daemon:
            scene = daemon.push(lit_floor())
            before, report = render(daemon, scene)
            self.assertEqual("calibrated", report["chosen"]["source"])
            options = {"repeats": 2, "max_settings": 12, "keep_images": False}
            body = {"scene": scene, **SIZE, "tradeoff": options}
            path = daemon.request("POST", "/v1/tradeoffs", body).header("Location")
            ended = ("done", "failed")
            support.wait_until(
                lambda: daemon.request("GET", path).json()["state"] in ended, "it is done", 120
            )
            times = {}
            for one in daemon.request("GET", path).json()["settings"]:
                is_default = one["shadow_resolution"] in (None, 1024) and one["shadow_taps"] in (
                    None,
                    4,
                )
                if one["samples"] == 4 and is_default and one["cold_ms"]:
                    times[one["shadows"]] = one["cold_ms"]["max"]
            reply, report = render(daemon, scene)
            chosen = report["chosen"]
            self.assertEqual("measured", chosen["source"])
            self.assertAlmostEqual(times[chosen["shadows"]], chosen["expected_ms"], 3)
            self.assertEqual("measured", report["error"]["source"])
            again, _ = render(daemon, scene)
            self.assertEqual(reply.body, again.body)
            daemon.request("DELETE", path + "?forget=true")
            after, report = render(daemon, scene)
            self.assertEqual("calibrated", report["chosen"]["source"])
            self.assertEqual(before.body, after.body)
            self.assertEqual(before.header("ETag"), after.header("ETag"))
            assert daemon.stop() == 0


class Pending(unittest.TestCase):
    def test_what_goes_by_the_speed_waits_for_it_and_the_rest_does_not(self):
        asking = ({}, {"shadows": "raytraced", "budget_ms": 60000})
        for quality in asking:
            daemon = support.Daemon(program=REAL).wait_device()
            with daemon:
                if not daemon.request("GET", "/v1/capabilities").json()["device"]["software"]:
                    self.skipTest("a device other than processors is measured before it is ready")
                scene = daemon.push(lit_floor())
                render(daemon, scene, {"shadows": "deep"})
                told = automatic(daemon)
                if told.get("pending"):  # unless something else had the processors for long
                    self.assertEqual(("measured", None, None),
                                     (told["policy"], told["speed"], told["rates"]))
                    self.assertIn("before the first picture", told["note"])
                reply, report = render(daemon, scene, quality)
                self.assertFalse(is_pending(daemon))
                self.assertRegex(automatic(daemon)["note"], "^measured at this start")
                self.assertEqual("calibrated", report["chosen"]["source"])
                again, _ = render(daemon, scene, quality,
                                  {"If-None-Match": reply.header("ETag")})
                self.assertIn(again.status, (200, 304))
                self.assertEqual(0, daemon.stop())

    def test_it_is_measured_when_nothing_is_asked_for(self):
        with support.Daemon(program=REAL).wait_device() as daemon:
            support.wait_until(lambda: not is_pending(daemon), "the speed is known", 60)
            self.assertTrue(all(value > 0 for value in automatic(daemon)["speed"].values()))
            self.assertEqual(0, daemon.stop())


class Kept(unittest.TestCase):
    def test_a_second_start_measures_nothing(self):
        first = open_daemon()
        with first:
            speed = automatic(first)["speed"]
            kept = os.path.join(first.state_dir, "cache", "device-speed-0.json")
            self.assertTrue(os.path.exists(kept))
            with open(kept, encoding="utf-8") as file:
                stored = json.load(file)
            self.assertEqual(speed, {key: stored[key] for key in speed})
            assert first.stop() == 0
            second = open_daemon(state_dir=first.state_dir)
            with second:
                told = automatic(second)
                self.assertEqual("measured at an earlier start", told["note"])
                self.assertEqual(speed, told["speed"])
                assert second.stop() == 0
            with open(kept, "w", encoding="utf-8") as file:
                json.dump({**stored, "key": "another driver"}, file)
            third = open_daemon(state_dir=first.state_dir)
            with third:
                self.assertRegex(automatic(third)["note"], "^measured at this start")
                assert third.stop() == 0

    def test_what_a_view_in_motion_teaches_outlives_the_server(self):
        """Nothing is written on the way, and no picture at rest comes after."""
        with open_daemon() as first:
            folder = os.path.join(first.state_dir, "cache")
            speed, learned = (os.path.join(folder, f"{what}-0.json")
                              for what in ("device-speed", "forecasts"))
            self.assertEqual(0, first.stop())
            with open(speed, encoding="utf-8") as file:
                numbers = json.load(file)
            with open(speed, "w", encoding="utf-8") as file:  # so that frames have much to teach
                json.dump({key: value if key == "key" else 8 * value
                           for key, value in numbers.items()}, file)
            with open_daemon(state_dir=first.state_dir) as daemon:
                scene = daemon.push(lit_floor())
                view = daemon.request("POST", "/v1/views", {
                    "scene": scene, **SIZE, "stream": {"rest_ms": 10000}}).json()["id"]
                with WebSocket(daemon.port, f"/v1/views/{view}/socket", timeout=120) as viewer:
                    viewer.until_type("hello")
                    for seq in range(1, 13):
                        camera = {"eye": [seq / 8, 2, 3], "target": [0, 0, 0]}
                        viewer.send(type="camera", seq=seq, camera=camera)
                        viewer.until_type("frame", seq=seq)
                    self.assertEqual(0, daemon.stop())
            with open(learned, encoding="utf-8") as file:
                self.assertGreaterEqual(json.load(file)["observations"], 3)


class Pinned(unittest.TestCase):
    def test_a_server_can_be_set_to_either(self):
        tags = set()
        for policy, traces in (("raster", False), ("raytraced", True)):
            with open_daemon("--auto", policy) as daemon:
                told = automatic(daemon)
                self.assertEqual(policy, told["policy"])
                self.assertEqual((None, None), (told["speed"], told["rates"]))
                self.assertFalse(
                    os.path.exists(os.path.join(daemon.state_dir, "cache", "device-speed-0.json"))
                )
                scene = daemon.push(lit_floor())
                reply, report = render(daemon, scene)
                tags.add(reply.header("ETag"))
                passes = {one["pass"] for one in report["plan"]}
                self.assertEqual(traces, "raytrace.trace" in passes)
                if traces:
                    self.assertEqual("configured", report["chosen"]["source"])
                    self.assertIsNone(report["chosen"]["expected_ms"])
                    _, deep = render(daemon, scene, {"shadows": "deep"})
                    self.assertIn("shade.opaque", {one["pass"] for one in deep["plan"]})
                else:
                    self.assertIsNone(report["chosen"])
                assert daemon.stop() == 0
        self.assertEqual(2, len(tags))  # other pixels, another tag


support.run_tests()
