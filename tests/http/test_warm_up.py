# SPDX-License-Identifier: MIT
"""Scenes that were posted are warmed up while the worker idles, never at the cost of a render."""
import functools
import os
import subprocess
import tempfile
import time
import unittest

import support

REAL = os.path.join(support.BIN, "vitraild")
DEVICE_S = 180  # to have one, and to measure it
GLB = {"Content-Type": "model/gltf-binary"}


@functools.cache
def demo_scene():
    """The demo scene, whose textures are small: warm-ups do not depend on them."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "demo.glb")
        subprocess.run([os.path.join(support.BIN, "vitrail"), "demo-scene", "-o", path,
                        "--texture-size", "64"], check=True, stdout=subprocess.DEVNULL,
                       env={k: v for k, v in os.environ.items() if not k.startswith("VITRAIL_")})
        with open(path, "rb") as stream:
            return stream.read()


class Case(unittest.TestCase):
    AUTO = "raster"

    def setUp(self):
        self.daemon = support.Daemon("--auto", self.AUTO, program=REAL, warms_up=True)
        self.addCleanup(self.daemon.__exit__)
        self.daemon.wait_ready(DEVICE_S)

    def post(self, content):
        return self.daemon.request("POST", "/v1/scenes", content, GLB).json()["id"]

    def frame(self, reply):
        """What the stats say of an image."""
        self.assertEqual(200, reply.status, reply.body[:300])
        link = reply.header("Link")
        return self.daemon.request("GET", link[1:link.index(">")]).json()

    def render(self, scene, **members):
        return self.frame(self.daemon.request("POST", "/v1/renders", {"scene": scene, **members}))

    def counts(self, scene, **members):
        return self.render(scene, **{"width": 320, "height": 240, **members})["counts"]

    def metric(self, name):
        for line in self.daemon.raw("GET", "/metrics").body.decode().splitlines():
            if line.startswith(name + " "):
                return float(line.rsplit(" ", 1)[1])
        return self.fail("no metric " + name)

    def wait_for_warm_ups(self, count):
        deadline = time.monotonic() + 120
        while self.metric("vitrail_warm_ups_total") < count:
            self.assertLess(time.monotonic(), deadline, self.daemon.log())
            time.sleep(0.1)
        self.assertEqual(count, self.daemon.stats()["warm_ups"]["done"])
        return self.daemon.stats()["warm_ups"]


class WarmUp(Case):
    def test_the_first_frame_of_a_warm_scene_compiles_and_builds_nothing(self):
        scene = self.post(demo_scene())
        self.wait_for_warm_ups(1)
        built = self.metric("vitrail_shader_programs_built_total")
        self.assertGreater(built, 0)
        done = self.daemon.stats()["warm_ups"]
        self.assertEqual(2, done["pictures"])  # at rest, and in motion
        self.assertEqual(0, done["ray_structures_built"])
        self.assertLessEqual(done["programs_built"], built)
        counts = self.counts(scene)
        self.assertEqual(0, counts["programs_built"])
        self.assertGreater(counts["programs_reused"], 0)
        self.assertEqual(0, counts["shadow_maps_built"])
        self.assertGreater(counts["shadow_maps_reused"], 0)
        self.assertEqual(built, self.metric("vitrail_shader_programs_built_total"))
        self.assertGreater(self.metric("vitrail_shader_programs_reused_total"), 0)

    def test_no_picture_of_a_warm_scene_compiles_at_rest_or_in_motion(self):
        scene = self.post(demo_scene())
        self.wait_for_warm_ups(1)
        built = self.metric("vitrail_shader_programs_built_total")
        for samples, size in ((4, 96), (1, 64), (1, 48)):
            for eye in ([0, 1.5, 6], [3, 4, -5], [0.5, 0.4, 0.5]):
                for target in ([0, 0.5, 0], [9, 9, 9]):
                    counts = self.counts(scene, width=size, height=48,
                                         camera={"eye": eye, "target": target},
                                         quality={"samples": samples, "shadow_taps": samples,
                                                  "shadow_resolution": 64})
                    self.assertEqual(0, counts["programs_built"], (samples, eye, target))
        self.assertEqual(built, self.metric("vitrail_shader_programs_built_total"))

    def test_a_render_at_once_comes_first_and_leaves_the_programs_of_others(self):
        scene = self.post(support.triangle())
        self.assertEqual(0, self.metric("vitrail_warm_ups_total"))
        counts = self.counts(scene)
        self.assertGreater(counts["programs_built"], 0)
        rendered = self.daemon.stats()["renders"]["rendered"]
        self.assertEqual(0, self.wait_for_warm_ups(1)["pictures"])
        self.assertEqual(rendered, self.daemon.stats()["renders"]["rendered"])
        quick = {"samples": 1, "shadow_taps": 1}
        self.assertEqual(0, self.counts(scene, quality=quick)["programs_built"])
        self.assertEqual(1, self.counts(scene)["gbuffers_drawn"])

    def test_a_render_that_comes_in_between_does_not_end_it(self):
        scene = self.post(demo_scene())
        support.wait_until(
            lambda: self.metric("vitrail_shader_programs_built_total") > 0
            or self.metric("vitrail_warm_ups_total") > 0, "the warm-up", 60)
        other = self.post(support.triangle())
        self.counts(other, width=16, height=16)
        self.wait_for_warm_ups(2)
        self.assertEqual(0, self.counts(scene, quality={"samples": 1})["programs_built"])

    def test_what_an_image_at_once_did_not_need_is_built_afterwards(self):
        scene = self.post(demo_scene())
        self.counts(scene, quality={"shadows": "none"})
        done = self.wait_for_warm_ups(1)
        self.assertEqual(0, done["pictures"])
        self.assertGreater(done["shadow_maps_built"], 0)
        counts = self.counts(scene)
        self.assertEqual(0, counts["shadow_maps_built"])
        self.assertEqual(done["shadow_maps_built"], counts["shadow_maps_reused"])
        self.assertEqual(0, counts["programs_built"])

    def test_a_render_that_fails_leaves_all_of_it(self):
        scene = self.post(support.triangle())
        reply = self.daemon.request("POST", "/v1/renders", {
            "scene": scene, "materials": {"overrides": [{"material": "nothing", "opacity": 0.5}]}})
        self.assertGreaterEqual(reply.status, 400, reply.body[:300])
        self.assertEqual(2, self.wait_for_warm_ups(1)["pictures"])

    def test_a_scene_that_is_gone_is_not_warmed_up(self):
        scene = self.post(support.triangle())
        self.daemon.request("DELETE", "/v1/scenes/" + scene)
        time.sleep(1)
        self.assertEqual(0, self.metric("vitrail_warm_ups_total"))


class WarmAuto(Case):
    """By what auto takes at the default size, on the device as it was measured."""
    AUTO = "measured"

    def check(self, frame):
        self.assertTrue(frame["chosen"]["because"].startswith("auto: forecast"), frame["chosen"])
        self.assertEqual(0, frame["counts"]["programs_built"])
        self.assertEqual(0, frame["counts"]["shadow_maps_built"])
        self.assertNotIn("raytrace.build", [step["pass"] for step in frame["plan"]])

    def test_whatever_auto_takes_is_there_for_the_first_frame(self):
        scene = self.post(demo_scene())
        done = self.wait_for_warm_ups(1)
        self.assertGreater(done["shadow_maps_built"] + done["ray_structures_built"], 0)
        self.check(self.render(scene))
        view = self.daemon.request("POST", "/v1/views", {"scene": scene}).json()["id"]
        self.check(self.frame(self.daemon.request("GET", f"/v1/views/{view}/image")))


class WarmRays(Case):
    AUTO = "raytraced"

    def test_where_all_is_traced_no_map_is_built_and_no_program_compiled(self):
        scene = self.post(demo_scene())
        done = self.wait_for_warm_ups(1)
        self.assertEqual({"done": 1, "dropped": 0, "interrupted": 0, "pictures": 1,
                          "shadow_maps_built": 0, "ray_structures_built": 1, "programs_built": 0},
                         done)
        frame = self.render(scene, width=64, height=48)
        self.assertIn("raytrace.build", frame["reused"])


class WarmStart(unittest.TestCase):
    """Over one state directory, with one daemon after the other."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.state_dir = os.path.join(folder.name, "state")

    def start(self, *flags, warms_up=True):
        return support.Daemon("--auto", "raster", *flags, program=REAL, state_dir=self.state_dir,
                              warms_up=warms_up)

    def post_and_use(self, count):
        """Posts scenes; all but the first give an image. Returns their ids."""
        with self.start(warms_up=False) as daemon:
            daemon.wait_ready(DEVICE_S)
            scenes = [support.triangle(f"Triangle {i}") for i in range(count)]
            ids = [daemon.request("POST", "/v1/scenes", scene, GLB).json()["id"]
                   for scene in scenes]
            for scene in ids[1:]:
                reply = daemon.request("POST", "/v1/renders", {"scene": scene, "width": 8,
                                                               "height": 8})
                self.assertEqual(200, reply.status)
        return ids

    def warmed(self, daemon, expected):
        """How many, once there are as many, and a while after."""
        def count():
            for line in daemon.raw("GET", "/metrics").body.decode().splitlines():
                if line.startswith("vitrail_warm_ups_total "):
                    return int(float(line.split()[1]))
            return self.fail("no metric")
        daemon.wait_ready(DEVICE_S)
        support.wait_until(lambda: count() >= expected, "the warm-ups", 120)
        time.sleep(2)
        return count()

    def counts(self, daemon, scene):
        reply = daemon.request("POST", "/v1/renders", {"scene": scene, "width": 64, "height": 48})
        link = reply.header("Link")
        return daemon.request("GET", link[1:link.index(">")]).json()["counts"]

    def test_the_scenes_last_used_are_warm_after_a_start(self):
        ids = self.post_and_use(4)
        with self.start() as daemon:
            self.assertEqual(2, self.warmed(daemon, 2))
            counts = self.counts(daemon, ids[-1])
            self.assertEqual(0, counts["programs_built"])
            self.assertEqual(4, daemon.stats()["warm_ups"]["pictures"])
        with self.start("--warm-at-start", "4") as daemon:
            self.assertEqual(3, self.warmed(daemon, 3))  # the first gave no image
        with self.start("--warm-at-start", "0") as daemon:
            self.assertEqual(0, self.warmed(daemon, 0))
        with self.start("--warm-at-start", "4", warms_up=False) as daemon:
            self.assertEqual(0, self.warmed(daemon, 0))

    def test_a_render_comes_before_them(self):
        ids = self.post_and_use(2)
        with self.start() as daemon:
            daemon.wait_ready(DEVICE_S)
            counts = self.counts(daemon, ids[1])
            self.assertGreater(counts["programs_built"] + counts["programs_loaded"], 0)
            self.assertEqual(1, self.warmed(daemon, 1))  # what the render left

    def test_a_scene_that_was_deleted_is_not_there_to_warm_up(self):
        ids = self.post_and_use(2)
        with self.start("--no-warm-up") as daemon:
            self.assertEqual(204, daemon.request("DELETE", "/v1/scenes/" + ids[1]).status)
        with self.start() as daemon:
            self.assertEqual(0, self.warmed(daemon, 0))
        self.assertFalse(os.path.exists(os.path.join(self.state_dir, "scenes", ids[1])))


class Rest(unittest.TestCase):
    def test_an_idle_worker_gives_back_what_its_last_frame_did_not_use(self):
        daemon = support.Daemon("--auto", "raster", "--rest-s", "1", program=REAL)
        self.addCleanup(daemon.__exit__)
        daemon.wait_ready(DEVICE_S)
        scene = daemon.request("POST", "/v1/scenes", demo_scene(), GLB).json()["id"]

        def render(**quality):
            body = {"scene": scene, "width": 64, "height": 48, "quality": quality}
            reply = daemon.request("POST", "/v1/renders", body)
            self.assertEqual(200, reply.status, reply.body[:300])
            return reply.body

        def held():
            return daemon.stats()["worker"]["gpu_used_bytes"]

        deep = render(shadows="deep", shadow_resolution=256)
        with_deep = held()
        time.sleep(3)
        self.assertGreater(held(), 0.9 * with_deep)  # the last frame used them
        render(shadows="none")
        support.wait_until(lambda: held() < 0.8 * with_deep, "memory given back", 30)
        self.assertEqual(deep, render(shadows="deep", shadow_resolution=256))


if __name__ == "__main__":
    support.needs(REAL)
    support.run_tests()
