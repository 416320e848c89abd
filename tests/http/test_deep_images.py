# SPDX-License-Identifier: MIT
"""Deep EXR: the samples of each pixel over one another are the plain EXR of the same request."""
import math
import os
import subprocess
import sys
import tempfile

import support
from exr_reader import Exr, flattened
from test_service_real import REAL, lit_floor

support.needs(REAL)
VITRAIL = os.path.join(support.BIN, "vitrail")
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../clients/python"))
sys.dont_write_bytecode = True

import vitrail  # its folder is known only now

LOOK = {"width": 48, "height": 32, "camera": {"eye": [0, 2.5, 2.5], "target": [0, 0.5, 0]},
        "quality": {"shadows": "deep", "samples": 1, "refraction": "off"}}


class DeepImages(support.ServiceTest):
    @classmethod
    def setUpClass(cls):
        cls.daemon = support.Daemon(program=REAL).wait_device()

    def setUp(self):
        self.scene = self.daemon.push(lit_floor())

    def render(self, **members):
        return self.daemon.render(self.scene, **{**LOOK, **members})

    def test_samples_over_one_another_are_the_plain_image(self):
        background = [0.2, 0.4, 0.8, 0.5]
        reply = self.render(format="exr-deep", background=background)
        self.assertEqual((200, "image/x-exr"), (reply.status, reply.header("Content-Type")))
        deep = Exr(reply.body)
        flat = Exr(self.render(format="exr", background=background).body)
        self.assertTrue(deep.is_deep and not flat.is_deep)
        self.assertEqual(["A", "AB", "AG", "AR", "B", "G", "R", "Z", "ZBack"], deep.channels)
        self.assertEqual((48, 32, 48 * 32), (deep.width, deep.height, len(deep.pixels)))
        self.assertEqual({1, 2}, {len(samples) for samples in deep.pixels})
        for samples, pixel in zip(deep.pixels, flat.pixels):
            found = flattened(samples)
            for channel in "RGBA":
                self.assertAlmostEqual(pixel[channel], found[channel], delta=2e-6)
            for sample in samples:
                mean = (sample["AR"] + sample["AG"] + sample["AB"]) / 3
                self.assertAlmostEqual(mean, sample["A"], delta=1e-6)
        glass = next(samples for samples in deep.pixels
                     if len(samples) == 2 and samples[1]["Z"] < math.inf)
        self.assertLess(glass[0]["Z"], glass[1]["Z"])
        self.assertLess(glass[0]["AR"], glass[0]["AG"])  # it is red
        self.assertEqual([1, 1, 1], [glass[1][name] for name in ("AR", "AG", "AB")])

    def test_a_deep_image_says_how_it_was_made_and_is_another_than_the_plain_one(self):
        reply = self.render(format="exr-deep")
        self.assertIn(b'"format":"exr-deep"', Exr(reply.body).attributes["vitrail"])
        self.assertNotEqual(reply.header("ETag"), self.render(format="exr").header("ETag"))
        self.assertEqual(reply.body, self.render(format="exr-deep").body)
        self.assertNotIn("vitrail", Exr(self.render(format="exr-deep", provenance=False).body)
                         .attributes)
        frame = self.daemon.request("GET", reply.header("Link")[1:].split(">")[0]).json()
        self.assertIn("deep-image", [line["pass"] for line in frame["plan"]])

    def test_the_default_is_one_sample(self):
        quality = {"shadows": "map", "refraction": "off"}
        both = [self.render(format="exr-deep", quality={**quality, **more}, provenance=False).body
                for more in ({}, {"samples": 1})]
        self.assertEqual(*both)

    def test_what_cannot_be_deep_is_refused_with_what_can(self):
        for members, said in (
                ({"quality": {}}, "none, map, deep, deep-linked, raytraced-shadows"),
                ({"quality": {"shadows": "raytraced"}}, "quality.shadows must be none"),
                ({"quality": {"shadows": "deep", "samples": 4}}, "samples must be 1"),
                ({"quality": {"shadows": "deep", "max_error": 0.1}}, "leave max_error"),
                ({"outputs": ["color", "depth"]}, "the color output alone"),
                ({"output": "depth"}, "the color output alone"),
                ({"edges": {}}, "edges and highlights"),
                ({"atmosphere": {"density": 1}}, "no haze")):
            reply = self.render(format="exr-deep", **members)
            self.assertEqual((422, "/format"), (reply.status, reply.json().get("pointer")), members)
            self.assertIn(said, reply.json()["detail"])
        reply = self.render(format="exr-deep", quality_percent=50)
        self.assertEqual((400, "/quality_percent"), (reply.status, reply.json()["pointer"]))
        body = {"materials": {"Glass": {"thickness": 0.1, "ior": 1.5}}}
        reply = self.render(format="exr-deep", overrides=body,
                            quality={"shadows": "deep", "samples": 1})
        self.assertEqual(422, reply.status)
        self.assertIn("quality.refraction must be off", reply.json()["detail"])

    def job(self, **members):
        view = {name: LOOK[name] for name in ("width", "height", "camera", "quality")}
        body = {"scene": self.scene, "view": view, **members}
        return self.daemon.request("POST", "/v1/jobs", body)

    def test_jobs_have_deep_files_beside_others(self):
        reply = self.job(outputs=[
            "color", {"name": "deep", "format": "exr-deep"},
            {"name": "glass", "file": "glass.%04d.exr", "format": "exr-deep"}])
        self.assertEqual(202, reply.status, reply.body)
        path = f"/v1/jobs/{reply.json()['id']}"
        support.wait_until(lambda: self.daemon.request("GET", path).json()["state"] == "done",
                           "the job is done", timeout_s=60)
        files = self.daemon.request("GET", path + "/frames").json()["frames"][0]["files"]
        self.assertEqual(["color.0001.png", "deep.0001.exr", "glass.0001.exr"],
                         [file["file"] for file in files])
        reply = self.daemon.request("GET", path + "/frames/1/deep")
        self.assertEqual("image/x-exr", reply.header("Content-Type"))
        self.assertTrue(Exr(reply.body).is_deep)

    def test_jobs_refuse_what_cannot_be_deep(self):
        deep = {"name": "deep", "format": "exr-deep"}
        view = {"width": 48, "height": 32}
        for members, said in (({"outputs": [deep], "view": view}, "must be none, map"),
                              ({"outputs": [{**deep, "outputs": ["depth"]}]}, "color output alone"),
                              ({"outputs": [deep], "tiles": 256}, "in tiles")):
            reply = self.job(**members)
            self.assertEqual((422, "/outputs/0"), (reply.status, reply.json()["pointer"]))
            self.assertIn(said, reply.json()["detail"])
        reply = self.job(outputs=[{**deep, "file": "deep.%04d.png"}])
        self.assertEqual(400, reply.status)

    def test_the_command_line_and_the_python_client_ask_for_it(self):
        url = f"http://127.0.0.1:{self.daemon.port}"
        with tempfile.TemporaryDirectory() as folder:
            def run(*words):
                subprocess.run([VITRAIL, *words, "--server", url, "--quiet"], check=True,
                               cwd=folder, stdout=subprocess.DEVNULL)
            run("render", self.scene, "-o", "deep.exr", "--format", "exr-deep",
                "--shadows", "deep", "--refraction", "off", "--size", "48x32")
            run("job", "submit", self.scene, "--watch", "--shadows", "deep", "--refraction", "off",
                "--size", "48x32", "--file", "job.%04d.exr=exr-deep", "--name", "deep")
            job = self.daemon.request("GET", "/v1/jobs").json()["jobs"][0]["id"]
            run("job", "fetch", job, "-o", ".")
            for name in ("deep.exr", "job.0001.exr"):
                with open(os.path.join(folder, name), "rb") as file:
                    self.assertTrue(Exr(file.read()).is_deep)
            run("verify", "deep.exr")
        with vitrail.Client(url) as client:
            image = client.render(self.scene, format="exr-deep", **LOOK)
        self.assertTrue(Exr(image.data).is_deep)
        self.assertEqual("exr-deep", image.provenance["request"]["format"])


if __name__ == "__main__":
    support.run_tests()
