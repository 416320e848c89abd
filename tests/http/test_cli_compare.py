#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""`vitrail compare`: metrics of files, difference pictures, exit codes, and what it refuses."""
import json
import math
import os
import random
import shutil
import struct
import subprocess

import flip_model
from cli_support import BIN, VITRAIL, CliTest, main
from image_files import exr_bytes, exr_color, png_bytes, png_chunk, read_png

WIDTH, HEIGHT = 21, 14
FAST_PPD = "24"  # smaller filters: the plain model in Python is quadratic in them


def linear(code):
    x = code / 255
    return x / 12.92 if x <= 0.04045 else ((x + 0.055) / 1.055) ** 2.4


def wavy(x, y, c):
    """A picture with edges, colours and fine detail; [0, 1]."""
    value = 0.5 + 0.5 * math.sin(0.9 * x + 1.7 * c) * math.cos(0.6 * y - c)
    return value * (0.3 if (x // 5 + y // 4) % 2 else 1)


def reference_pixel(x, y):
    return tuple(wavy(x, y, c) for c in range(3))


def image_pixel(x, y):
    return tuple(v * (1 - 0.3 * (x > 10)) + 0.05 * (c == y % 3)
                 for c, v in enumerate(reference_pixel(x, y)))


def bright(pixel):
    return lambda x, y: tuple(0.02 + 30 * v ** 5 for v in pixel(x, y))


def rows_of(pixel):
    """As a file of 32-bit floats holds them."""
    def rounded(values):
        return struct.unpack("3f", struct.pack("3f", *values))
    return [[rounded(pixel(x, y)) for x in range(WIDTH)] for y in range(HEIGHT)]


class CompareTest(CliTest):
    def exr(self, name, pixel, alpha=False, size=(WIDTH, HEIGHT)):
        return self.write(name, exr_color(*size, pixel, alpha))

    def pair(self):
        self.exr("image.exr", image_pixel)
        self.exr("reference.exr", reference_pixel)
        return "image.exr", "reference.exr"

    def compare(self, *arguments, code=0):
        out, err = self.run_cli("compare", "--json", *arguments, code=code)
        self.assertEqual(err, "")
        return json.loads(out)

    def refused(self, *arguments, code=1):
        out, err = self.run_cli("compare", *arguments, code=code)
        self.assertEqual(out, "")
        self.assertNotIn("Traceback", err)
        return err

    # Numbers

    def test_plain_metrics_are_those_of_their_definitions(self):
        result = self.compare(*self.pair(), "--no-flip")
        pairs = [(a, b) for rows in zip(rows_of(image_pixel), rows_of(reference_pixel))
                 for pixels in zip(*rows) for a, b in zip(*pixels)]
        differences = sorted(abs(a - b) for a, b in pairs)
        count = len(differences)
        self.assertEqual(result["compared"], count)
        self.assertAlmostEqual(result["rmse"], math.sqrt(sum(d * d for d in differences) / count),
                               delta=1e-12)
        self.assertAlmostEqual(result["mae"], sum(differences) / count, delta=1e-12)
        self.assertAlmostEqual(result["max"], differences[-1], delta=1e-12)
        rank = math.ceil(0.999 * count)
        self.assertAlmostEqual(result["p999"], differences[rank - 1], delta=1e-8)
        self.assertAlmostEqual(result["mean_image"], sum(a for a, _ in pairs) / count, delta=1e-12)
        self.assertEqual(result["differing_share"], sum(a != b for a, b in pairs) / count)
        self.assertEqual(sorted(result["channels"]), ["B", "G", "R"])
        self.assertIsNone(result["flip"])

    def test_flip_is_that_of_a_plain_model_of_the_paper(self):
        result = self.compare(*self.pair(), "--ppd", FAST_PPD)
        image, reference = ([[tuple(min(max(v, 0), 1) for v in rgb) for rgb in row]
                             for row in rows_of(pixel)] for pixel in (image_pixel, reference_pixel))
        model = flip_model.ldr_flip(reference, image, float(FAST_PPD))
        self.assertAlmostEqual(result["flip"]["mean"], flip_model.mean(model), delta=2e-5)
        self.assertAlmostEqual(result["flip"]["max"], max(map(max, model)), delta=1e-4)
        self.assertEqual(result["flip"]["pixels_per_degree"], 24)

    def test_hdr_flip_is_that_of_a_plain_model_of_the_paper(self):
        self.exr("image.exr", bright(image_pixel))
        self.exr("reference.exr", bright(reference_pixel))
        result = self.compare("image.exr", "reference.exr", "--ppd", "12")
        model = flip_model.hdr_flip(rows_of(bright(reference_pixel)), rows_of(bright(image_pixel)),
                                    12)
        self.assertAlmostEqual(result["hdr_flip"]["mean"], flip_model.mean(model), delta=1e-4)
        self.assertGreater(result["hdr_flip"]["exposures"], 4)

    def test_png_is_compared_in_linear_light(self):
        grey = bytes(range(0, 240, 20))
        self.write("image.png", png_bytes(12, 1, bytes(v for g in grey for v in (g, g, g))))
        self.exr("reference.exr", lambda x, y: (linear(grey[x]),) * 3, size=(12, 1))
        result = self.compare("image.png", "reference.exr")
        self.assertLess(result["max"], 1e-7)
        self.assertEqual(result["image"]["format"], "png")
        self.assertIsNone(result["hdr_flip"], "exposures of a finished picture mean nothing")

    def test_alpha_of_a_png_is_multiplied_in_and_compared_apart(self):
        self.write("image.png", png_bytes(2, 1, bytes((255, 255, 255, 51, 0, 0, 0, 255))))
        self.exr("reference.exr", lambda x, y: ((0.2, 0.2, 0.2, 0.2), (0, 0, 0, 0.5))[x], True,
                 (2, 1))
        result = self.compare("image.png", "reference.exr", "--no-flip")
        self.assertLess(result["max"], 1e-7)
        self.assertEqual(result["compared"], 6)
        self.assertAlmostEqual(result["channels"]["A"]["max"], 0.5)

    def test_grey_is_not_compared_with_colour(self):
        self.write("grey.png", png_bytes(2, 2, bytes((10, 20, 30, 40))))
        self.write("veil.png", png_bytes(2, 2, bytes((10, 255, 20, 255, 30, 255, 40, 51))))
        self.write("deep.png", png_bytes(2, 2, bytes(range(8)), 16))
        self.write("rgb.png", png_bytes(2, 2, bytes(v for g in (10, 20, 30, 40) for v in 3 * (g,))))
        self.write("rgba.png", png_bytes(2, 2, bytes(16)))
        self.exr("color.exr", lambda x, y: (0, 0, 0), size=(2, 2))
        for grey in ("grey.png", "veil.png", "deep.png"):
            for color in ("rgb.png", "rgba.png", "color.exr"):
                for pair in ((grey, color), (color, grey)):
                    self.assertRegex(self.refused(*pair),
                                     "the image has . channels, the reference|holds numbers")
        result = self.compare("grey.png", "grey.png")
        self.assertEqual((result["rmse"], result["compared"], list(result["channels"])),
                         (0, 4, ["Y"]))
        self.assertEqual(result["flip"]["mean"], 0)
        result = self.compare("veil.png", "grey.png")  # alpha is multiplied in, and left out
        self.assertAlmostEqual(result["max"], 0.8 * linear(40), delta=1e-7)
        self.assertEqual(sorted(self.compare("veil.png", "veil.png")["channels"]), ["A", "Y"])
        key = png_chunk(b"tRNS", struct.pack(">H", 255))  # white is transparent
        white, black = png_bytes(2, 2, bytes(4 * (255,))), png_bytes(2, 2, bytes(4))
        self.write("keyed.png", white[:33] + key + white[33:])
        self.write("plain.png", black[:33] + key + black[33:])
        result = self.compare("keyed.png", "plain.png")["channels"]
        self.assertEqual((result["Y"]["max"], result["A"]["max"]), (0, 1))
        self.exr("grey.exr", lambda x, y: (linear((10, 20, 30, 40)[x + 2 * y]),) * 3, size=(2, 2))
        self.assertLess(self.compare("rgb.png", "grey.exr")["max"], 1e-7)

    def test_a_png_of_16_bits_is_compared_with_all_of_them(self):
        self.write("a.png", png_bytes(2, 1, struct.pack(">2H", 1000, 60000), 16))
        self.write("b.png", png_bytes(2, 1, struct.pack(">2H", 1001, 60000), 16))
        result = self.compare("a.png", "b.png")
        self.assertEqual((result["differing"], result["image"]["format"]), (1, "png"))
        self.assertIsNone(result["flip"])
        self.write("coarse.png", png_bytes(2, 1, bytes((4, 234))))
        self.assertRegex(self.refused("a.png", "coarse.png"), "holds numbers, .* holds color")
        self.assertAlmostEqual(result["max"], 1 / 65535, delta=1e-9)
        color = struct.pack(">8H", 65535, 0, 32768, 65535, 65535, 257, 0, 13107)
        self.write("rgba.png", png_bytes(2, 1, color, 16))
        self.exr("want.exr", lambda x, y: ((1, 0, linear(255 * 32768 / 65535), 1),
                                           (0.2, 0.2 * linear(1), 0, 0.2))[x], True, (2, 1))
        self.assertLess(self.compare("rgba.png", "want.exr")["max"], 1e-7)

    def test_transmittances_are_compared_by_ratio_too(self):
        size = WIDTH * HEIGHT

        def write(name, *values):
            channels = {f"transmittance.{c}": [values[0]] + [0.5] * (size - 2) + [values[1]]
                        for c in "RGB"}
            return self.write(name, exr_bytes(WIDTH, HEIGHT, channels))

        write("a.exr", 2e-3, 3e-30)
        write("b.exr", 1e-3, 1e-30)
        result = self.compare("a.exr", "b.exr")["transmittance"]
        self.assertAlmostEqual(result["max_relative"], 1, delta=1e-6)
        self.assertEqual(result["max_relative_at"], {"x": 0, "y": 0, "channel": "R"})
        self.assertEqual(result["relative_compared"], 3 * (size - 1))
        self.assertAlmostEqual(result["max_tau"], math.log(3), delta=1e-6)
        self.assertEqual(result["max_tau_at"], {"x": WIDTH - 1, "y": HEIGHT - 1, "channel": "R"})
        out, _ = self.run_cli("compare", "a.exr", "b.exr", "--output", "transmittance")
        self.assertRegex(out, r"\nrelative +at most 1 at 0, 0 R, of 879 values with T > 0.0001\n")
        self.assertRegex(out, r"\n\|d ln T\| +at most 1\.099 at 20, 13 R\n")
        for metric, limit, code in (("relative", "0.99", 3), ("relative", "1.01", 0),
                                    ("tau", "1.09", 3), ("tau", "1.1", 0)):
            self.compare("a.exr", "b.exr", "--metric", metric, "--max-error", limit, code=code)
        write("c.exr", 2e-3, 0)
        result = self.compare("c.exr", "b.exr", "--metric", "tau", "--max-error", "9", code=3)
        self.assertEqual(result["transmittance"]["opaque_mismatch"], 3)
        self.assertIsNone(result["verdict"]["value"])
        self.assertIsNone(self.compare(*self.pair(), "--no-flip")["transmittance"])
        self.assertIn("--metric tau: there is none of these images",
                      self.refused(*self.pair(), "--metric", "tau", "--max-error", "1"))

    def test_alpha_that_only_one_has_is_left_out(self):
        self.exr("image.exr", lambda x, y: (0.5, 0.5, 0.5, 0.25), True)
        self.exr("reference.exr", lambda x, y: (0.5, 0.5, 0.5))
        result = self.compare("image.exr", "reference.exr")
        self.assertEqual((result["max"], sorted(result["channels"])), (0, ["B", "G", "R"]))

    def test_the_same_file_is_no_error_and_the_same_hash(self):
        image, _ = self.pair()
        result = self.compare(image, image, "--edge-level", "0.3")
        for name in ("rmse", "mae", "p999", "max", "energy", "differing"):
            self.assertEqual(result[name], 0, name)
        self.assertEqual(result["flip"]["max"], 0)
        self.assertEqual(result["hdr_flip"]["max"], 0)
        self.assertAlmostEqual(result["edges"]["hausdorff_px"], 0, delta=1e-9)
        self.assertEqual(result["image"]["hash"], result["reference"]["hash"])
        self.assertRegex(result["image"]["hash"], r"\A[0-9a-f]{16}\Z")

    def test_a_shifted_shadow_is_found_to_a_hundredth_of_a_pixel(self):
        def edge(shift):
            return lambda x, y: (min(max(0.5 + (x - 10 - shift) / 4, 0), 1),) * 3
        self.exr("image.exr", edge(0.25))
        self.exr("reference.exr", edge(0))
        result = self.compare("image.exr", "reference.exr", "--edge-level", "0.5", "--no-flip")
        self.assertAlmostEqual(result["edges"]["hausdorff_px"], 0.25, delta=0.01)
        self.assertAlmostEqual(result["edges"]["mean_px"], 0.25, delta=0.01)

    def test_nan_and_infinity_are_told_and_left_out(self):
        self.pair()
        bad = {(3, 2): math.nan, (4, 2): math.inf, (5, 2): -math.inf}
        self.exr("bad.exr", lambda x, y: (bad.get((x, y), reference_pixel(x, y)[0]),) +
                 reference_pixel(x, y)[1:])
        result = self.compare("bad.exr", "reference.exr")
        self.assertEqual(result["nonfinite"], {"image": 3, "reference": 0, "mismatch": 3})
        self.assertEqual(result["max"], 0)
        self.assertEqual(result["flip"]["nonfinite_pixels"], 3)
        out, _ = self.run_cli("compare", "bad.exr", "reference.exr")
        self.assertIn("not finite 3 values of the image, 0 of the reference", out)
        self.compare("bad.exr", "reference.exr", "--max-error", "1e9", code=3)

    # Layers

    def layered(self, name, depth=2.0):
        size = WIDTH * HEIGHT
        return self.write(name, exr_bytes(WIDTH, HEIGHT, {
            "R": [0.1] * size, "G": [0.2] * size, "B": [0.3] * size, "A": [1] * size,
            "Z": [depth] * (size - 1) + [math.inf], "normal.X": [0] * size,
            "normal.Y": [1] * size, "normal.Z": [0] * size, "node.id": [7] * size}))

    def test_outputs_of_a_layered_exr_are_chosen_by_name(self):
        self.layered("a.exr", 2.5)
        self.layered("b.exr")
        self.assertEqual(self.compare("a.exr", "b.exr")["max"], 0)
        result = self.compare("a.exr", "b.exr", "--output", "depth")
        self.assertEqual((result["max"], result["compared"]), (0.5, WIDTH * HEIGHT - 1))
        self.assertEqual(result["nonfinite"]["mismatch"], 0, "both see nothing there")
        self.assertEqual(list(result["channels"]), ["Z"])
        result = self.compare("a.exr", "b.exr", "--output", "normal")
        self.assertEqual(sorted(result["channels"]), ["X", "Y", "Z"])
        self.assertIsNone(result["flip"], "a normal is no colour")
        self.assertEqual(self.compare("a.exr", "b.exr", "--output", "node")["mean_image"], 7)

    def test_a_missing_output_is_refused_with_those_that_are_there(self):
        self.layered("a.exr")
        self.pair()
        self.assertIn("'a.exr' has no output 'albedo', only: color, depth, node, normal",
                      self.refused("a.exr", "a.exr", "--output", "albedo"))
        self.assertIn("'image.exr' has no output 'depth', only: color",
                      self.refused("a.exr", "image.exr", "--output", "depth"))
        self.write("p.png", png_bytes(1, 1, b"\0\0\0"))
        self.assertIn("a png file holds one picture",
                      self.refused("p.png", "p.png", "--output", "depth"))

    def test_a_file_without_color_is_compared_by_its_only_output(self):
        size = WIDTH * HEIGHT
        self.write("z.exr", exr_bytes(WIDTH, HEIGHT, {"Z": [3.0] * size}))
        self.write("n.exr", exr_bytes(WIDTH, HEIGHT, {f"normal.{c}": [0] * size for c in "XYZ"}))
        self.write("zn.exr", exr_bytes(WIDTH, HEIGHT, {"Z": [0] * size, "normal.X": [0] * size}))
        self.assertEqual(self.compare("z.exr", "z.exr")["image"]["output"], "depth")
        self.assertIn("'z.exr' holds depth, 'n.exr' holds normal", self.refused("z.exr", "n.exr"))
        self.assertIn("several outputs: depth, normal; choose with --output",
                      self.refused("zn.exr", "z.exr"))

    # Pictures

    def test_pictures_show_the_difference_in_the_documented_colours(self):
        self.exr("image.exr", lambda x, y: (0.5 + 0.25 * (x == 3) - 0.25 * (x == 9),) * 3)
        self.exr("reference.exr", lambda x, y: (0.5, 0.5, 0.5))
        colours = {"absolute": {3: (252, 253, 191), 9: (252, 253, 191), 15: (0, 0, 4)},
                   "signed": {3: (110, 0, 30), 9: (10, 50, 110), 15: (250, 250, 250)}}
        for kind, expected in colours.items():
            result = self.compare("image.exr", "reference.exr", "-o", "d.png", "--map", kind)
            self.assertEqual(result["picture"], {"file": "d.png", "map": kind, "scale": 0.25})
            width, height, channels, pixels = read_png(self.read("d.png"))
            self.assertEqual((width, height, channels), (WIDTH, HEIGHT, 3))
            for x, colour in expected.items():
                self.assertEqual(tuple(pixels[3 * (5 * WIDTH + x):][:3]), colour, (kind, x))
        result = self.compare("image.exr", "reference.exr", "-o", "d.png", "--map", "absolute",
                              "--scale", "0.5")
        pixels = read_png(self.read("d.png"))[3]
        self.assertEqual(tuple(pixels[9:12]), (181, 54, 122), "the middle of the scale")

    def test_the_default_picture_is_flip(self):
        result = self.compare(*self.pair(), "-o", "d.png")
        self.assertEqual((result["picture"]["map"], result["picture"]["scale"]), ("flip", 1))
        pixels = read_png(self.read("d.png"))[3]
        lightest = max(range(WIDTH * HEIGHT), key=lambda i: sum(pixels[3 * i:3 * i + 3]))
        at = result["hdr_flip"]["max_at"]
        self.assertEqual((lightest % WIDTH, lightest // WIDTH), (at["x"], at["y"]))

    def test_a_picture_on_stdout_is_just_the_picture(self):
        self.pair()
        process = self.start("compare", "image.exr", "reference.exr", "-o", "-")
        out, err = process.communicate(timeout=60)
        self.assertEqual((process.returncode, err), (0, b""))
        self.assertEqual(read_png(out)[:2], (WIDTH, HEIGHT))

    def test_a_failed_call_leaves_an_earlier_picture(self):
        self.pair()
        self.write("d.png", b"before")
        self.refused("image.exr", "missing.exr", "-o", "d.png", code=66)
        self.assertEqual(self.read("d.png"), b"before")
        self.assert_only("image.exr", "reference.exr", "d.png")

    # Exit codes

    def test_max_error_decides_the_exit_code(self):
        pair = self.pair()
        result = self.compare(*pair, "--edge-level", "0.4")
        values = {"rmse": result["rmse"], "mae": result["mae"], "p999": result["p999"],
                  "max": result["max"], "energy": abs(result["energy"]),
                  "differing": result["differing_share"], "flip": result["flip"]["mean"],
                  "flip_p99": result["flip"]["p99"], "hdr_flip": result["hdr_flip"]["mean"],
                  "hdr_flip_p99": result["hdr_flip"]["p99"],
                  "edge": result["edges"]["hausdorff_px"], "edge_mean": result["edges"]["mean_px"]}
        for metric, value in values.items():
            self.assertGreater(value, 0, metric)
            limits = [(0.999, 3)] + [(1.001, 0)] * (metric in ("rmse", "edge"))
            for factor, code in limits:
                verdict = self.compare(*pair, "--metric", metric, "--edge-level", "0.4",
                                       "--max-error", repr(value * factor), code=code)["verdict"]
                self.assertEqual((verdict["metric"], verdict["passed"]), (metric, code == 0))
                self.assertEqual(verdict["value"], value)

    def test_a_failed_verdict_is_said_on_stdout_and_is_no_error(self):
        out, err = self.run_cli("compare", *self.pair(), "--max-error", "0.001", code=3)
        self.assertRegex(out, r"\nFAILED +rmse 0\.[0-9]+, limit 0\.001\n\Z")
        self.assertEqual(err, "")
        self.assertEqual(self.run_cli("compare", *self.pair(), "--max-error", "0.001", "-q",
                                      code=3), ("", ""))
        out, _ = self.run_cli("compare", *self.pair(), "--max-error", "9")
        self.assertRegex(out, r"\npassed +rmse ")

    def test_wrong_command_lines_are_refused_by_name(self):
        pair = self.pair()
        for arguments, words in (
                (["--metric", "psnr", "--max-error", "1"], "--metric: 'psnr' is none of rmse, mae"),
                (["--metric", "mae"], "--metric needs --max-error"),
                (["--max-error", "-1"], "--max-error: an error, from 0"),
                (["--max-error", "nan"], "'nan' is not a number"),
                (["--map", "heat", "-o", "d.png"], "'heat' is none of flip, absolute, signed"),
                (["--map", "signed"], "need a picture"),
                (["--scale", "0", "-o", "d.png"], "--scale: a difference above 0"),
                (["--ppd", "0"], "--ppd: pixels per degree, from 1 to 1000"),
                (["--edge-level", "0"], "--edge-level: a luminance, not 0"),
                (["--metric", "edge", "--max-error", "1"], "--metric edge needs --edge-level"),
                (["--no-flip", "-o", "d.png"], "--no-flip leaves out"),
                (["--no-flip", "--metric", "flip", "--max-error", "1"], "--no-flip leaves out"),
                (["-o", "d.exr"], "the picture is .png, .jpg or .webp"),
                (["-o", "d.gif"], "the picture is .png, .jpg or .webp"),
                (["third.exr"], "'third.exr' is one too many")):
            self.assertIn(words, self.refused(*pair, *arguments, code=2), arguments)
        self.assertIn("usage: vitrail compare", self.refused("image.exr", code=2))
        self.assertIn("only one of the images can be stdin", self.refused("-", "-", code=2))
        self.assert_only("image.exr", "reference.exr")

    def test_metrics_that_a_pair_lacks_are_refused(self):
        self.write("p.png", png_bytes(2, 2, bytes(12)))
        self.layered("a.exr")
        self.assertIn("--metric hdr_flip: there is none of these images",
                      self.refused("p.png", "p.png", "--metric", "hdr_flip", "--max-error", "1"))
        self.assertIn("choose --map absolute",
                      self.refused("a.exr", "a.exr", "--output", "depth", "-o", "d.png"))

    # Hostile files

    def test_images_of_other_sizes_or_channels_are_refused_with_both(self):
        self.pair()
        self.exr("small.exr", reference_pixel, size=(4, 3))
        self.assertIn("the image is 21 x 14 pixels, the reference 4 x 3",
                      self.refused("image.exr", "small.exr"))
        size = WIDTH * HEIGHT
        self.write("n3.exr", exr_bytes(WIDTH, HEIGHT, {f"v.{c}": [0] * size for c in "XYZ"}))
        self.write("n2.exr", exr_bytes(WIDTH, HEIGHT, {f"v.{c}": [0] * size for c in "XY"}))
        self.assertIn("the image has 3 channels, the reference 2",
                      self.refused("n3.exr", "n2.exr"))

    def test_files_that_are_no_images_are_refused_by_name(self):
        image, _ = self.pair()
        self.write("empty.exr", b"")
        self.write("text.png", b"not an image at all, whatever it is called")
        self.write("scene.glb", b"glTF\2\0\0\0" + bytes(64))
        os.mkdir(self.path("folder"))
        for name in ("empty.exr", "text.png", "scene.glb", "folder", "missing.exr"):
            self.assertIn(f"'{name}'", self.refused(image, name, code=66))
            self.assertIn(f"'{name}'", self.refused(name, image, code=66))
        error = json.loads(self.refused("--json", image, "missing.exr", code=66))
        self.assertEqual(error["exit_code"], 66)

    def test_every_truncation_of_a_file_is_refused(self):
        image, _ = self.pair()
        noise = random.Random(5)
        content = {"cut.exr": self.read(image),
                   "cut.png": png_bytes(9, 9, noise.randbytes(243))}
        for name, whole in content.items():
            step = max(1, len(whole) // 8)
            for length in list(range(0, len(whole), step)) + [len(whole) - 1]:
                self.write(name, whole[:length])
                process = self.start("compare", name, name, "-q")
                _, err = process.communicate(timeout=60)
                # the last bytes of a PNG are its end mark, which decoders may forgive
                accepted = {66} if name == "cut.exr" or length < len(whole) - 20 else {0, 66}
                self.assertIn(process.returncode, accepted, (name, length, err))

    def test_damaged_bytes_never_crash(self):
        image, _ = self.pair()
        noise = random.Random(7)
        content = [("bent.exr", self.read(image)), ("bent.png", png_bytes(9, 9, bytes(243)))]
        for turn in range(20):
            name, whole = content[turn % 2]
            bent = bytearray(whole)
            for _ in range(noise.choice((1, 3, 20))):
                bent[noise.randrange(min(len(bent), 400))] = noise.randrange(256)
            self.write(name, bytes(bent))
            process = self.start("compare", name, name, "-q")
            _, err = process.communicate(timeout=60)
            self.assertIn(process.returncode, (0, 1, 66), (name, turn, err))

    def test_a_size_that_a_file_only_claims_is_refused(self):
        for side in (30000, 100000, 1 << 30):
            claim = bytearray(png_bytes(1, 1, b"\0\0\0"))
            struct.pack_into(">II", claim, 16, side, side)
            self.write("claim.png", bytes(claim))
            self.assertIn("'claim.png'", self.refused("claim.png", "claim.png", code=66))

    def test_control_characters_of_a_name_do_not_reach_the_terminal(self):
        name = "a\x1b[2J.exr"
        shutil.copy(self.path(self.pair()[0]), self.path(name))
        out, _ = self.run_cli("compare", name, name)
        self.assertNotIn("\x1b", out)
        self.assertIn("a?[2J.exr", out)

    # The program

    def test_one_image_may_come_from_stdin(self):
        self.pair()
        with open(self.path("image.exr"), "rb") as stream:
            done = subprocess.run([VITRAIL, "compare", "-", "reference.exr", "--json"],
                                  cwd=self.folder, stdin=stream, capture_output=True, timeout=60,
                                  check=True)
        self.assertEqual(json.loads(done.stdout)["image"]["file"], "-")

    def test_the_table_is_readable(self):
        out, err = self.run_cli("compare", *self.pair(), "--edge-level", "0.4")
        self.assertEqual(err, "")
        for words in ("image      image.exr: 21 x 14, exr, color, hash ", "rmse", "p99.9", "\nall ",
                      "\nR ", "\nmean ", "\nFLIP ", "\nHDR-FLIP ", "67.02 pixels per degree",
                      "exposures from", "\nedges "):
            self.assertIn(words, out)
        self.assertLessEqual(max(map(len, out.splitlines())), 130)

    def test_without_its_program_the_command_says_so(self):
        alone = shutil.copy(VITRAIL, self.path("vitrail"))
        self.environment["PATH"] = self.folder
        _, err = self.run_cli("compare", "a", "b", program=alone, code=71)
        self.assertIn("no vitrail-compare beside this program, and none in PATH", err)

    def test_no_client_is_linked_with_gl_and_vitrail_not_with_an_image_library(self):
        readelf = shutil.which("readelf")
        self.assertIsNotNone(readelf, "binutils come with the compiler")
        for name, foreign in (("vitrail", ("GL", "epoxy", "embree", "OpenImageIO", "webp")),
                              ("vitrail-compare", ("GL", "epoxy", "embree", "curl"))):
            shown = subprocess.run([readelf, "-d", os.path.join(BIN, name)], check=True,
                                   capture_output=True, text=True).stdout
            needed = [line for line in shown.splitlines() if "(NEEDED)" in line]
            self.assertGreater(len(needed), 1)
            self.assertEqual([line for line in needed if any(f in line for f in foreign)], [])


if __name__ == "__main__":
    main()
