# SPDX-License-Identifier: MIT
"""Environment maps over HTTP: what is taken, what is told of it, what is refused, what is kept."""
import math
import os
import struct

import support
from support import sha256

support.needs(support.FAKE)

HDR, EXR = "image/vnd.radiance", "image/x-exr"


def rgbe(rgb):
    """A texel of a Radiance picture; exact where the numbers have eight bits."""
    most = max(rgb)
    if most <= 0:
        return bytes(4)
    exponent = math.frexp(most)[1]
    return bytes(int(c * 2.0 ** (8 - exponent)) for c in rgb) + bytes([exponent + 128])


def hdr(width, height, texel):
    body = b"".join(rgbe(texel(i % width, i // width)) for i in range(width * height))
    return b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n" % (height, width) + body


def exr(width, height, texel, data_window=None):
    """Uncompressed scan lines of 32-bit floats (OpenEXR file layout)."""
    window = struct.pack("<4i", 0, 0, *(data_window or (width - 1, height - 1)))

    def attribute(name, kind, value):
        return name + b"\0" + kind + b"\0" + struct.pack("<i", len(value)) + value
    channels = b"".join(name + b"\0" + struct.pack("<iiii", 2, 0, 1, 1)
                        for name in (b"B", b"G", b"R"))
    header = (struct.pack("<ii", 20000630, 2)
              + attribute(b"channels", b"chlist", channels + b"\0")
              + attribute(b"compression", b"compression", b"\0")
              + attribute(b"dataWindow", b"box2i", window)
              + attribute(b"displayWindow", b"box2i", window)
              + attribute(b"lineOrder", b"lineOrder", b"\0")
              + attribute(b"pixelAspectRatio", b"float", struct.pack("<f", 1))
              + attribute(b"screenWindowCenter", b"v2f", struct.pack("<ff", 0, 0))
              + attribute(b"screenWindowWidth", b"float", struct.pack("<f", 1)) + b"\0")
    lines = []
    for y in range(height):
        row = [texel(x, y) for x in range(width)]
        lines.append(struct.pack(f"<ii{3 * width}f", y, 12 * width,
                                 *(c[i] for i in (2, 1, 0) for c in row)))
    first = len(header) + 8 * height
    offsets = [first + i * len(lines[0]) for i in range(height)]
    return header + struct.pack(f"<{height}Q", *offsets) + b"".join(lines)


def halves(x, y):
    return (2.0, 1.0, 0.5) if y < 4 else (0.25, 0.25, 0.25)


class Environments(support.ServiceTest):
    def post(self, content, media_type=HDR, query=""):
        return self.daemon.request("POST", "/v1/environments" + query, content,
                                   {"Content-Type": media_type})

    def assert_refused(self, status, code, content, media_type=HDR, words=""):
        reply = self.post(content, media_type)
        self.assertEqual((status, code), (reply.status, reply.code), reply.body[:400])
        self.assertIn(words, reply.json()["detail"])
        self.assertEqual(404, self.daemon.request(
            "GET", "/v1/environments/" + sha256(content)).status)

    def test_a_map_has_the_sha256_of_its_bytes_as_id(self):
        for content, media_type in ((hdr(16, 8, halves), HDR), (exr(16, 8, halves), EXR),
                                    (hdr(18, 9, halves), "application/octet-stream"),
                                    (exr(18, 9, halves), "application/octet-stream")):
            reply = self.post(content, media_type)
            self.assertEqual((201, sha256(content)), (reply.status, reply.json()["id"]))
            self.assertEqual("/v1/environments/" + sha256(content), reply.header("Location"))
            self.assertEqual(200, self.post(content, media_type).status)

    def test_the_mean_is_that_over_all_directions(self):
        for content, media_type in ((hdr(32, 8, halves), HDR), (exr(32, 8, halves), EXR)):
            told = self.post(content, media_type).json()
            for mean, top in zip(told["mean_radiance"], (2.0, 1.0, 0.5)):
                self.assertAlmostEqual((top + 0.25) / 2, mean, 9)
            self.assertEqual((2.0, len(content), 32, 8, {"width": 32, "height": 8}),
                             (told["peak_radiance"], told["bytes"]["upload"], told["width"],
                              told["height"], told["source"]))

    def test_a_map_is_named_listed_and_forgotten(self):
        content = hdr(4, 2, halves)
        path = "/v1/environments/" + self.post(content, query="?name=sky").json()["id"]
        listed = self.daemon.request("GET", "/v1/environments").json()["environments"]
        self.assertIn((sha256(content), "sky"), [(one["id"], one["name"]) for one in listed])
        renamed = self.daemon.request("PATCH", path, b'{"name": "dusk"}',
                                      {"Content-Type": "application/merge-patch+json"})
        self.assertEqual("dusk", renamed.json()["name"])
        tag = self.daemon.request("GET", path).header("ETag")
        self.assertEqual(304, self.daemon.request("GET", path, None,
                                                  {"If-None-Match": tag}).status)
        self.assertEqual("dawn", self.post(content, query="?name=dawn").json()["name"])
        stored = self.daemon.stats()["environments"]
        levels = sum((512 >> i) * (256 >> i) for i in range(6))
        decoded = 32 + 8 * (3 + 2 * 5) + 12 * (4 * 2 + 64 * 32 + levels)
        self.assertEqual(decoded, renamed.json()["bytes"]["decoded"])
        self.assertEqual(204, self.daemon.request("DELETE", path).status)
        self.assertEqual({"stored": stored["stored"] - 1,
                          "decoded_bytes": stored["decoded_bytes"] - decoded},
                         self.daemon.stats()["environments"])
        for method in ("GET", "DELETE"):
            gone = self.daemon.request(method, path)
            self.assertEqual((404, "not_found"), (gone.status, gone.code))
            self.assertIn(sha256(content), gone.json()["detail"])

    def test_a_restart_keeps_maps(self):
        content = hdr(6, 3, halves)
        with support.Daemon() as first:
            self.assertEqual(201, first.request("POST", "/v1/environments?name=kept", content,
                                                {"Content-Type": HDR}).status)
            before = first.request("GET", "/v1/environments").body
            first.stop()
            with support.Daemon(state_dir=first.state_dir) as second:
                self.assertEqual(before, second.request("GET", "/v1/environments").body)
                second.stop()
                blob = os.path.join(first.state_dir, "environments", sha256(content), "blob")
                os.truncate(blob, 0)
            with support.Daemon(state_dir=first.state_dir) as third:
                self.assertEqual([], third.request("GET",
                                                   "/v1/environments").json()["environments"])
                self.assertIn("environment map '%s' is removed" % sha256(content), third.log())

    def test_a_large_map_is_reduced_with_a_warning(self):
        told = self.post(hdr(2050, 2, lambda x, y: (1.0, 0.5, 0.25))).json()
        self.assertEqual((2048, 2), (told["width"], told["height"]))
        self.assertIn("the map of 2050 x 2 texels is reduced to 2048 x 2", told["warnings"])
        self.assertTrue(any("twice as wide as high" in one for one in told["warnings"]))
        for mean, one in zip(told["mean_radiance"], (1.0, 0.5, 0.25)):
            self.assertAlmostEqual(one, mean, 6)

    def test_negative_channels_are_warned_of(self):
        told = self.post(exr(4, 2, lambda x, y: (-1.0 if x == y else 1.0, 1.0, 1.0)), EXR).json()
        self.assertIn("2 texels have channels below 0, which count as 0", told["warnings"])

    def test_what_is_no_radiance_is_refused_with_its_texel(self):
        for bad in (math.nan, math.inf, -math.inf, 2e10):
            self.assert_refused(
                422, "invalid_environment",
                exr(8, 4, lambda x, y, bad=bad: (1.0, bad if (x, y) == (5, 2) else 1.0, 1.0)), EXR,
                "channel G of the texel in column 5 of row 2")

    def test_sizes_that_lie_and_sizes_that_are_too_large_are_refused(self):
        tall = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n"
        for height, width in ((65535, 65535), (4097, 16), (16, 8193), (16, 65535)):
            self.assert_refused(413, "too_large", tall % (height, width), HDR,
                                f"{width} x {height} texels, the limit is 8192 x 4096")
        self.assert_refused(413, "too_large", exr(4, 2, halves, (65534, 65534)), EXR,
                            "65535 x 65535 texels, the limit is 8192 x 4096")
        self.assert_refused(422, "invalid_environment", exr(4, 2, halves, (-5, -5)), EXR)
        self.assert_refused(422, "invalid_environment", exr(4, 2, halves, (8191, 4095)), EXR)
        self.assert_refused(422, "invalid_environment", tall % (4096, 8192) + bytes(64), HDR)
        self.assert_refused(422, "invalid_environment", tall % (0, 8), HDR)
        self.assert_serves()

    def test_a_file_that_is_cut_off_is_refused(self):
        for content, media_type in ((hdr(16, 8, halves), HDR), (exr(16, 8, halves), EXR)):
            for size in (12, 60, len(content) // 2, len(content) - 1):
                self.assert_refused(422, "invalid_environment", content[:size], media_type)
        self.assert_refused(422, "invalid_environment", b"", HDR, "empty")

    def test_other_files_are_refused(self):
        for content in (b"GIF89a", b"\x89PNG\r\n\x1a\n" + bytes(40), support.triangle(), b"\x76"):
            self.assert_refused(415, "unsupported_media_type", content, HDR, "Radiance HDR")
        reply = self.post(hdr(4, 2, halves), "image/png")
        self.assertEqual((415, "unsupported_media_type"), (reply.status, reply.code))
        self.assertIn("image/vnd.radiance", reply.json()["detail"])
        self.assertEqual(400, self.post(hdr(4, 2, halves), query="?scene=0").status)

    def test_a_map_is_no_scene(self):
        content = hdr(10, 5, halves)
        self.assertEqual(201, self.post(content).status)
        self.assertEqual(404, self.daemon.request("GET", "/v1/scenes/" + sha256(content)).status)
        self.assertEqual(415, self.daemon.post_scene(content, HDR).status)


class Lit(support.ServiceTest):
    """Renders and views that name a map."""

    def post(self, content):
        reply = self.daemon.request("POST", "/v1/environments", content, {"Content-Type": HDR})
        self.assertIn(reply.status, (200, 201))
        return reply.json()["id"]

    def render(self, **environment):
        return self.daemon.render(self.daemon.push(support.triangle()), environment=environment)

    def assert_missing(self, reply, image):
        self.assertEqual((404, "not_found"), (reply.status, reply.code), reply.body[:400])
        self.assertEqual("/environment/image", reply.json()["pointer"])
        self.assertIn(image, reply.json()["detail"])

    def test_maps_that_are_here_are_brought_to_the_renderer(self):
        """The double refuses maps that nobody attached, and keeps two."""
        ids = [self.post(hdr(4 + 2 * i, 2, halves)) for i in range(4)]
        for image in [*ids, "studio", *ids]:
            reply = self.render(image=image, rotation_deg=-90, intensity=0.5, background=True)
            self.assertEqual(200, reply.status, reply.body[:400])
        self.assertEqual(200, self.render(sky=[1, 1, 1]).status)

    def test_a_map_that_is_not_here_is_404_and_points_at_it(self):
        for image in ("0" * 64, "sky.hdr", "Studio", "A" * 64):
            self.assert_missing(self.render(image=image), image[:40])
        gone = self.post(hdr(4, 2, halves))
        self.assertEqual(200, self.render(image=gone).status)
        self.assertEqual(204, self.daemon.request("DELETE", "/v1/environments/" + gone).status)
        self.assert_missing(self.render(image=gone), gone)
        self.assertEqual(gone, self.post(hdr(4, 2, halves)))
        self.assertEqual(200, self.render(image=gone).status)

    def test_views_show_a_map_and_tell_that_one_is_gone(self):
        scene, image = self.daemon.push(support.triangle()), self.post(hdr(12, 6, halves))
        made = self.daemon.request("POST", "/v1/views", support.json.dumps(
            {"scene": scene, "environment": {"image": "0" * 64}}).encode(),
            {"Content-Type": "application/json"})
        self.assert_missing(made, "0" * 64)
        view = self.daemon.request("POST", "/v1/views", support.json.dumps(
            {"scene": scene, "environment": {"image": image}}).encode(),
            {"Content-Type": "application/json"}).json()["id"]

        def patch(environment):
            return self.daemon.request(
                "PATCH", "/v1/views/" + view,
                support.json.dumps({"environment": environment}).encode(),
                {"Content-Type": "application/merge-patch+json"})
        picture = f"/v1/views/{view}/image"
        first = self.daemon.request("GET", picture)
        self.assertEqual(200, first.status)
        self.assertEqual(200, patch({"rotation_deg": 90}).status)
        self.assertNotEqual(first.header("ETag"),
                            self.daemon.request("GET", picture).header("ETag"))
        self.assert_missing(patch({"image": "1" * 64}), "1" * 64)
        self.assertEqual(204, self.daemon.request("DELETE", "/v1/environments/" + image).status)
        self.assert_missing(self.daemon.request("GET", picture), image)
        self.assertEqual(200, patch({"image": "studio"}).status)
        self.assertEqual(200, self.daemon.request("GET", picture).status)
        self.assertEqual(200, patch({"image": None}).status)
        self.assertEqual(200, self.daemon.request("GET", picture).status)

    def test_a_map_comes_beside_the_scenes_of_parts(self):
        scenes = [self.daemon.push(support.triangle(f"n{i}")) for i in range(6)]
        reply = self.daemon.render(
            scenes[0], environment={"image": self.post(hdr(20, 10, halves))},
            parts={f"p{i}": {"scene": scene} for i, scene in enumerate(scenes[1:])})
        self.assertEqual(200, reply.status, reply.body[:400])


if __name__ == "__main__":
    support.run_tests()
