# SPDX-License-Identifier: MIT
"""While a frame is on the device the worker makes the next one: each client gets its own picture,
in less time than the two take in turn, and a failure of either is that one's alone."""
import concurrent.futures
import time

import support
from support import triangle

support.needs(support.FAKE)


def nodes(*names):
    """A scene in which the double finds all of these names."""
    return triangle(
        nodes=[{"name": name, "mesh": 0} for name in names],
        scenes=[{"nodes": list(range(len(names)))}],
    )


class FramesAhead(support.ServiceTest):
    flags = ("--render-timeout-s", "3")

    def setUp(self):
        self.daemon.worker_pid()

    def renders(self):
        return self.daemon.stats()["renders"]

    def render_all(self, jobs):
        """Replies to (scene, width) and the seconds that all of them took; distinct views."""
        with concurrent.futures.ThreadPoolExecutor(len(jobs)) as pool:
            began = time.monotonic()
            replies = [
                pool.submit(self.daemon.render, scene, width=width, height=9)
                for scene, width in jobs
            ]
            replies = [reply.result(60) for reply in replies]
            return replies, time.monotonic() - began

    def expect_pictures(self, jobs, replies):
        for (_, width), reply in zip(jobs, replies):
            self.assertEqual(200, reply.status, reply.body[:200])
            self.assertEqual((width, 9), size_of(reply.body))

    def test_the_processor_and_the_device_work_side_by_side(self):
        scene = self.daemon.push(nodes("fake:slow=100", "fake:device=100"))
        times = []
        for width in (20, 120, 220):
            before = self.renders()["ahead"]
            jobs = [(scene, width + i) for i in range(8)]
            replies, seconds = self.render_all(jobs)
            self.expect_pictures(jobs, replies)
            self.assertGreaterEqual(self.renders()["ahead"] - before, 6)
            times.append(seconds)
        self.assertLess(min(times), 0.8 * 8 * 0.2)

    def test_a_lone_frame_is_ahead_of_none_and_waits_for_its_device_only(self):
        scene = self.daemon.push(nodes("fake:device=120"))
        before = self.renders()["ahead"]
        times = []
        for i in range(5):
            replies, seconds = self.render_all([(scene, 40 + i)])
            self.assertEqual(200, replies[0].status)
            times.append(seconds)
        self.assertGreater(min(times), 0.12)
        self.assertLess(min(times), 1)
        self.assertEqual(before, self.renders()["ahead"])

    def test_a_picture_that_is_there_does_not_wait_for_the_end_of_the_next_frame(self):
        quick = self.daemon.push(nodes("fake:device=200"))
        slow = self.daemon.push(nodes("fake:slow=1800"))
        self.render_all([(quick, 3), (slow, 3)])  # both scenes are at hand
        with concurrent.futures.ThreadPoolExecutor(2) as pool:
            first = pool.submit(self.daemon.render, quick, width=50, height=9)
            time.sleep(0.05)
            second = pool.submit(self.daemon.render, slow, width=51, height=9)
            self.assertEqual(200, first.result(60).status)
            self.assertFalse(second.done())
            self.assertEqual(200, second.result(60).status)

    def test_an_error_on_the_device_fails_its_render_only(self):
        pid = self.daemon.worker_pid()
        good = self.daemon.push(nodes("fake:slow=20", "fake:device=60"))
        bad = self.daemon.push(nodes("fake:device=61", "fake:error-on-device"))
        jobs = [(bad if i % 3 == 1 else good, 60 + i) for i in range(9)]
        replies, _ = self.render_all(jobs)
        for (scene, width), reply in zip(jobs, replies):
            if scene == bad:
                self.assertEqual((500, "internal"), (reply.status, reply.code))
                self.assertIn("failed on the device", reply.json()["detail"])
            else:
                self.expect_pictures([(scene, width)], [reply])
        self.assertEqual(pid, self.daemon.worker_pid())

    def expect_charged(self, jobs, bad, detail):
        replies, _ = self.render_all(jobs)
        for (scene, width), reply in zip(jobs, replies):
            if scene == bad:
                self.assertEqual((500, "render_failed"), (reply.status, reply.code))
                self.assertIn(detail, reply.json()["detail"])
            else:
                self.expect_pictures([(scene, width)], [reply])

    def test_a_context_lost_on_the_device_is_charged_to_the_frame_there(self):
        good = self.daemon.push(nodes("fake:slow=60", "fake:device=30"))
        bad = self.daemon.push(nodes("fake:device=150", "fake:lost-on-device"))
        self.expect_charged(
            [(bad if i == 2 else good, 80 + i) for i in range(6)], bad, "failed on the device"
        )

    def test_a_crash_is_charged_to_the_frame_on_the_processor(self):
        good = self.daemon.push(nodes("fake:device=150"))
        bad = self.daemon.push(nodes("fake:slow=30", "fake:crash"))
        self.expect_charged(
            [(bad if i == 2 else good, 100 + i) for i in range(6)], bad, "Segmentation fault"
        )

    def test_a_device_that_hangs_is_charged_to_the_frame_there(self):
        good = self.daemon.push(nodes("fake:slow=30", "fake:device=30"))
        bad = self.daemon.push(nodes("fake:device=20", "fake:hang-on-device"))
        self.expect_charged(
            [(bad if i == 1 else good, 120 + i) for i in range(4)], bad, "deadline of 3 s"
        )

    def test_time_behind_another_frame_is_not_counted_against_a_deadline(self):
        long = self.daemon.push(nodes("fake:device=2200"))
        jobs = [(long, 140 + i) for i in range(3)]  # the last waits 4.4 s for the device
        replies, _ = self.render_all(jobs)
        self.expect_pictures(jobs, replies)

    def test_questions_wait_for_what_is_on_the_device(self):
        scene = self.daemon.push(nodes("fake:device=150"))
        with concurrent.futures.ThreadPoolExecutor(3) as pool:
            renders = [
                pool.submit(self.daemon.render, scene, width=160 + i, height=9) for i in range(2)
            ]
            plan = self.daemon.request("POST", "/v1/renders?explain=1", {"scene": scene})
            self.assertEqual(200, plan.status, plan.body[:200])
            self.assertEqual({200}, {render.result(60).status for render in renders})

    def test_frames_on_the_device_are_delivered_at_the_end(self):
        with support.Daemon() as daemon, concurrent.futures.ThreadPoolExecutor(2) as pool:
            scene = daemon.wait_ready().push(nodes("fake:device=500"))
            replies = [pool.submit(daemon.render, scene, width=7 + i) for i in range(2)]
            support.wait_until(
                lambda: daemon.stats()["renders"]["in_flight"] == 2, "they are in flight"
            )
            self.assertEqual(0, daemon.stop())
            self.assertEqual([200] * 2, [reply.result(1).status for reply in replies])


def size_of(png):
    return int.from_bytes(png[16:20], "big"), int.from_bytes(png[20:24], "big")


if __name__ == "__main__":
    support.run_tests()
