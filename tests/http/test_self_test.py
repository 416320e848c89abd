# SPDX-License-Identifier: MIT
"""The self-test over real starts: in software it comes before the first picture of its kind, what
was right is not drawn again, and what the file says is not believed when it is damaged."""
import os
import tempfile

import support

REAL = os.path.join(support.BIN, "vitraild")
support.needs(REAL)


class Kept(support.unittest.TestCase):
    def programs_of_start(self, state_dir, *flags, draws=True):
        """How many shader programs a start and a picture take, from wherever."""
        daemon = support.Daemon("--auto", "raster", "--texture-compression=off", "--no-warm-up",
                                *flags, program=REAL, state_dir=state_dir).wait_device()
        with daemon:
            self.assertEqual(200, daemon.request("GET", "/readyz").status)
            if draws:
                scene = daemon.push(support.triangle())
                lamp = {"type": "spot", "position": [0, 2, 4], "direction": [0, -0.4, -1]}
                reply = daemon.render(scene, width=32, height=24, lights=[lamp],
                                      quality={"shadows": "deep"})
                self.assertEqual(200, reply.status)
            programs = daemon.stats()["programs"]
            self.assertEqual(0, daemon.stop())
        return programs["compiled"] + programs["disk"]

    def test_a_second_start_draws_no_scene(self):
        with tempfile.TemporaryDirectory() as state_dir:
            bare = self.programs_of_start(state_dir, draws=False)
            first = self.programs_of_start(state_dir)
            self.assertLess(bare + 8, first)
            kept = os.path.join(state_dir, "cache", "self-test-0")
            self.assertEqual(0o600, os.stat(kept).st_mode & 0o777)
            second = self.programs_of_start(state_dir)
            self.assertLess(second + 8, first)
            self.assertGreater(self.programs_of_start(state_dir, "--self-test=always"), first)
            self.assertEqual(second, self.programs_of_start(state_dir, "--self-test", "auto"))
            with open(kept, "wb") as file:
                file.write(b"vitrail-proof 1 " + b"\0\xff" * 4096)
            self.assertEqual(first, self.programs_of_start(state_dir))
            self.assertEqual(second, self.programs_of_start(state_dir))


support.run_tests()
