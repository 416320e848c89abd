# SPDX-License-Identifier: MIT
"""Compressed textures as capabilities tell them: what was asked for, what was measured of the
device and what follows; and tags of images that differ by it."""
import os
import unittest

import support

REAL = os.path.join(support.BIN, "vitraild")
support.needs(REAL)


def open_daemon(*flags, program=REAL, state_dir=None):
    daemon = support.Daemon("--auto=raster", *flags, program=program, state_dir=state_dir)
    return daemon.wait_device()


def told(*flags, **more):
    """The device's capabilities of a daemon with these flags, and its log."""
    daemon = open_daemon(*flags, **more)
    with daemon:
        device = daemon.request("GET", "/v1/capabilities").json()["device"]
        log = daemon.log()
        assert daemon.stop() == 0
    return device, log


class Measured(unittest.TestCase):
    def test_auto_goes_by_what_was_measured_once(self):
        with support.tempfile.TemporaryDirectory() as folder:
            first, log = told(state_dir=folder)
            again, _ = told(state_dir=folder)
        blocks = first["texture_blocks"]
        self.assertEqual("auto", blocks["policy"])
        self.assertIn("compressed textures: auto", log)
        speed = blocks["speed"]
        if first["software"]:
            self.assertEqual((None, None), (speed, blocks["from_levels"]))
            self.assertIn("not measured", blocks["note"])
            self.assertFalse(first["texture_compression"])
            return
        if speed is None:
            self.assertIsNone(blocks["from_levels"])
            self.assertIn("samples no compressed", blocks["note"])
            return
        self.assertTrue(all(value > 0 for value in speed.values()), speed)
        gains = (
            max(speed["bc1_ns"], speed["bc3_ns"]) <= 1.1 * speed["whole_ns"]
            and speed["encode_bytes_per_ms"] >= 22e3
        )
        self.assertEqual(5 if gains else None, blocks["from_levels"])
        self.assertEqual(gains, first["texture_compression"])
        self.assertRegex(blocks["note"], r"^measured at this start in \d+ ms$")
        self.assertEqual("measured at an earlier start", again["texture_blocks"]["note"])
        self.assertEqual(speed, again["texture_blocks"]["speed"])

    def test_on_and_off_measure_nothing(self):
        for word, levels in (("on", 1), ("off", None)):
            device, _ = told("--texture-compression", word)
            blocks = device["texture_blocks"]
            self.assertEqual(word, blocks["policy"])
            self.assertEqual((None, None), (blocks["speed"], blocks["note"]))
            if word == "off" or device["texture_compression"]:
                self.assertEqual(levels, blocks["from_levels"])


class Tags(unittest.TestCase):
    def test_images_made_otherwise_have_another_tag(self):
        tags = {}
        for word in ("off", "on", "auto"):
            daemon = open_daemon("--texture-compression=" + word, program=support.FAKE)
            with daemon:
                scene = daemon.push(support.triangle())
                tags[word] = daemon.render(scene, width=8, height=8).header("ETag")
                self.assertEqual(0, daemon.stop())
        self.assertEqual(3, len(set(tags.values())), tags)


if __name__ == "__main__":
    support.run_tests()
