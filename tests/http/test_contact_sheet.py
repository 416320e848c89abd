#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Every model by others beside the sources renders as a user would render it, or is refused in the
words documented for it. Writes all pictures on one sheet: contact-sheet.png in the build folder."""
import os
import subprocess
import tempfile
import unittest

import support
from image_files import png_bytes, read_png

REAL = os.path.join(support.BIN, "vitraild")
CLIENT = os.path.join(support.BIN, "vitrail")
ASSETS = os.path.realpath(os.path.join(os.path.dirname(os.path.abspath(__file__)),
                                       "../../../shared/assets"))
SHEET = os.path.join(support.BIN, "..", "contact-sheet.png")
WIDTH, HEIGHT, COLUMNS, GAP = 160, 120, 10, 2
REFUSED = {"CesiumBalloonKTX2/CesiumBalloonKTX2.glb": "KHR_texture_basisu"}

support.needs(REAL)
support.needs(CLIENT)


def models():
    """Names of all models, relative to the folder."""
    found = []
    for folder, _, files in os.walk(ASSETS):
        found += [os.path.relpath(os.path.join(folder, name), ASSETS)
                  for name in files if name.endswith((".gltf", ".glb"))]
    return sorted(found)


def covered(picture):
    """Share of pixels that something covers, and the brightest value among them."""
    width, height, channels, pixels = picture
    assert (width, height, channels) == (WIDTH, HEIGHT, 4)
    alphas = pixels[3::4]
    brightest = max(max(pixels[k::4]) for k in range(3))
    return sum(alpha > 0 for alpha in alphas) / len(alphas), brightest


def sheet_of(pictures):
    """A PNG with all of them on white."""
    rows = -(-len(pictures) // COLUMNS)
    width, height = COLUMNS * (WIDTH + GAP), rows * (HEIGHT + GAP)
    sheet = bytearray(b"\xff" * (width * height * 3))
    for index, (_, _, _, pixels) in enumerate(pictures):
        left, top = index % COLUMNS * (WIDTH + GAP), index // COLUMNS * (HEIGHT + GAP)
        for y in range(HEIGHT):
            row = pixels[y * WIDTH * 4:(y + 1) * WIDTH * 4]
            at = ((top + y) * width + left) * 3
            for k in range(3):
                sheet[at + k:at + 3 * WIDTH:3] = bytes(
                    255 - a + c * a // 255 for c, a in zip(row[k::4], row[3::4]))
    return png_bytes(width, height, bytes(sheet))


@unittest.skipUnless(os.path.isdir(ASSETS), "the models are not there")
class ContactSheet(unittest.TestCase):
    def render(self, daemon, folder, name):
        """The picture, or None after the refusal that is expected."""
        out = os.path.join(folder, "picture.png")
        done = subprocess.run(
            [CLIENT, "render", os.path.join(ASSETS, name), "-q", "-o", out,
             "--server", f"http://127.0.0.1:{daemon.port}", "--size", f"{WIDTH}x{HEIGHT}",
             "--camera", "fit:three-quarter", "--exposure", "auto"],
            capture_output=True, text=True, timeout=300)
        if name in REFUSED:
            self.assertEqual(1, done.returncode, done.stderr)
            self.assertIn(REFUSED[name], done.stderr)
            return None
        self.assertEqual(0, done.returncode, done.stderr)
        with open(out, "rb") as file:
            return read_png(file.read())

    def test_every_model_renders_or_is_refused_as_documented(self):
        pictures = []
        with support.Daemon(program=REAL) as daemon, tempfile.TemporaryDirectory() as folder:
            if daemon.raw("GET", "/readyz").code == "no_device":
                self.skipTest("no graphics device")
            daemon.wait_ready()
            for name in models():
                with self.subTest(name):
                    picture = self.render(daemon, folder, name)
                    if not picture:
                        continue
                    pictures.append(picture)
                    share, brightest = covered(picture)
                    self.assertGreater(share, 0.005, "next to nothing is seen")
                    self.assertGreater(brightest, 60, "all is dark")
        self.assertGreater(len(pictures), 60)
        with open(SHEET, "wb") as file:
            file.write(sheet_of(pictures))


if __name__ == "__main__":
    support.run_tests()
