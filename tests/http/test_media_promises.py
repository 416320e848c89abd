# SPDX-License-Identifier: MIT
"""`max_error` is kept on random media: smoke in haze, behind and across stained glass, with lamps
in it. `vitrail-bench promises --media` asks 200 of them, and more."""
import os
import sys
import unittest

import support

BENCH = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "bench")
DAEMON = os.path.join(support.BIN, "vitraild")
FIRST_SEED, SEEDS = 3001, 5  # what a minute holds; their errors go from 0.08 to 0.012

support.needs(DAEMON)
sys.path.insert(0, BENCH)
sys.dont_write_bytecode = True

import promises  # their folder is known only now
import random_media


class MediaPromises(unittest.TestCase):
    def test_a_seed_makes_the_same_scene(self):
        self.assertEqual(random_media.make(7), random_media.make(7))
        self.assertNotEqual(random_media.make(7)[1], random_media.make(8)[1])

    def test_the_error_that_was_asked_for_is_kept(self):
        wanted = promises.WANTED.parse_args(
            [support.BIN, "--media", "--wish", "max_error", "--json"])
        results = promises.run(wanted, range(FIRST_SEED, FIRST_SEED + SEEDS))
        self.assertEqual(SEEDS, len(results))
        for one in results:
            with self.subTest(scene=one["scene"]):
                self.assertTrue(one["kept"], one)
                self.assertGreater(one["got"], 0)  # else nothing was seen


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
