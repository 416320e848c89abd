# SPDX-License-Identifier: MIT
"""Jobs under a system's clock that goes back a day and ahead by ten years."""
import os
import struct
import threading

import support
from test_jobs import JobTest, body_of, moving

support.needs(support.FAKE)

SHIFT = os.path.join(os.path.dirname(support.FAKE), "clock_shift.so")
support.needs(SHIFT)
DAY, YEARS = 86400, 10 * 365 * 86400


class ClockTest(JobTest):
    def setUp(self):
        folder = support.tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.shift = os.path.join(folder.name, "shift")
        self.set_clock(0)

    def set_clock(self, seconds):
        """What the daemon's clock is off by."""
        with open(self.shift, "r+b" if os.path.exists(self.shift) else "wb") as file:
            file.write(struct.pack("<q", seconds))

    def run_daemon(self, *flags):
        return support.Daemon(*flags, environment={"LD_PRELOAD": SHIFT,
                                                   "CLOCK_SHIFT_FILE": self.shift})

    def submit_to(self, daemon, scene, frames="1-2", **members):
        return daemon.request("POST", "/v1/jobs", body_of(scene, frames, **members)).json()["id"]

    def ended(self, daemon, scene, frames="1-2", **members):
        return self.wait(self.submit_to(daemon, scene, frames, **members), daemon=daemon)

    def kept(self, daemon):
        return [job["id"] for job in reversed(daemon.request("GET", "/v1/jobs").json()["jobs"])]

    def assert_in_order(self, job):
        self.assertLessEqual(job["created"], job["started"])
        self.assertLessEqual(job["started"], job["ended"])
        self.assertGreaterEqual(job["busy_s"], 0)


class JobClock(ClockTest):
    def test_stated_times_stay_in_order_and_no_job_goes_early(self):
        with self.run_daemon("--job-retention-days", "1") as daemon:
            scene = daemon.push(moving("fake:slow=20"))
            first = self.ended(daemon, scene)
            year = int(first["created"][:4])
            for jump in (-DAY, YEARS, 0):
                before = self.submit_to(daemon, scene, "1-20")
                path = f"/v1/jobs/{before}"
                support.wait_until(
                    lambda path=path: daemon.request("GET", path).json()["frames"]["done"] > 1,
                    "it runs")
                self.set_clock(jump)
                shown = daemon.request("GET", path).json()
                self.assertGreaterEqual(shown["remaining_s"] or 0, 0)
                self.assert_in_order(self.wait(before, daemon=daemon))
                after = self.ended(daemon, scene)
                self.assert_in_order(after)
                self.assertIn(int(after["created"][:4]),
                              {-DAY: (year - 1, year), YEARS: (year + 9, year + 10),
                               0: (year, year + 1)}[jump], "the clock did jump")
                self.assertGreater(after["expires"], after["ended"])
            kept = self.kept(daemon)
            self.assertEqual(7, len(kept), "nothing was forgotten")
            self.assertEqual(first["id"], kept[0], "in the order of their coming")

    def test_the_order_of_ends_is_the_true_one(self):
        view, outputs = {"width": 256, "height": 256}, [{"outputs": ["depth"], "format": "exr"}]
        with self.run_daemon("--job-results-bytes", "1M") as daemon:
            scene = daemon.push(moving())
            first = self.ended(daemon, scene, view=view, outputs=outputs)
            size = daemon.request("GET", "/v1/stats").json()["jobs"]["kept_bytes"] // 2
            self.set_clock(-DAY)
            second = self.ended(daemon, scene, view=view, outputs=outputs)
            self.assertLess(second["ended"], first["ended"])
            last = self.ended(daemon, scene, f"1-{(1 << 20) // size - 3}", view=view,
                              outputs=outputs)
            self.assertEqual([second["id"], last["id"]], self.kept(daemon))

    def test_waits_end_by_their_own_time(self):
        with self.run_daemon() as daemon:
            scene = daemon.push(moving())
            job = self.submit_to(daemon, scene, paused=True)
            answers = {}
            def wait(seconds):
                answers[seconds] = daemon.request("GET", f"/v1/jobs/{job}", timeout=60, headers={
                    "Prefer": f"wait={seconds}"}).json()["state"]
            threads = [threading.Thread(target=wait, args=(seconds,)) for seconds in (1, 50)]
            for thread in threads:
                thread.start()
            support.wait_until(lambda: daemon.request("GET", "/v1/stats").json()["http"][
                "in_flight"] >= 3, "both wait")
            self.set_clock(-DAY)  # the shorter wait still ends, and the longer one does not yet
            threads[0].join()
            self.set_clock(YEARS)
            daemon.request("PATCH", f"/v1/jobs/{job}", {"paused": False})
            threads[1].join()
            self.assertEqual({1: "queued", 50: "done"}, answers)


if __name__ == "__main__":
    support.run_tests()
