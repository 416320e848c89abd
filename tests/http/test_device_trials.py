# SPDX-License-Identifier: MIT
"""Drivers that end their process cost a device, not the service: it is passed over, and said so;
where none is left, or it was asked for, the daemon ends with the reason."""
import os
import tempfile
import time

import support

HOSTILE = os.path.join(support.BIN, "vitraild-hostile")
support.needs(HOSTILE)
QUICK = ("--auto", "raster", "--texture-compression=off")


def start(entries, *flags, quick=QUICK):
    return support.Daemon(*quick, *flags, program=HOSTILE,
                          environment={"HOSTILE_DEVICES": entries})


class Trials(support.unittest.TestCase):
    def test_one_crash_is_forgiven(self):
        with tempfile.TemporaryDirectory() as folder:
            with start(f"any:self-test:once={folder}/crashed") as daemon:
                daemon.wait_device()
                self.assertNotIn("passed_over", daemon.request("GET", "/readyz").json())
                self.assertEqual(1, daemon.stats()["worker"]["crashes"])
                self.assertIn("is tried once more", daemon.log())
                self.assertEqual(0, daemon.stop())

    def assert_passed_over(self, entries, reason):
        with start(entries) as daemon:
            scene = daemon.push(support.triangle())  # meanwhile
            support.wait_until(
                lambda: daemon.raw("GET", "/readyz").code != "overloaded" or not daemon.is_alive(),
                "a device or none", 180)
            if not daemon.is_alive():
                self.skipTest("there is one device alone")
            ready = daemon.request("GET", "/readyz")
            self.assertEqual(200, ready.status)
            lines = ready.json()["passed_over"]
            self.assertEqual(1, len(lines), lines)
            self.assertIn(": passed over: " + reason, lines[0])
            device = daemon.request("GET", "/v1/capabilities").json()["device"]
            self.assertEqual(lines, device["passed_over"])
            self.assertIn(lines[0], device["devices"])
            name = lines[0].split(": passed over")[0]
            self.assertIn(f"a device is passed over: {name}: {reason}", daemon.log())
            self.assertEqual(2, daemon.stats()["worker"]["crashes"])
            self.assertEqual(3, daemon.stats()["worker"]["starts"])
            self.assertEqual(200, daemon.render(scene).status)
            self.assertEqual(0, daemon.stop())

    def test_a_driver_that_crashes_in_the_self_test_is_passed_over(self):
        self.assert_passed_over("0:self-test:segv",
                                "its driver crashed twice in the self-test: signal 11")

    def test_a_driver_that_aborts_when_it_is_opened_is_passed_over(self):
        self.assert_passed_over("0:open:abort",
                                "its driver crashed twice when it was opened: signal 6")

    def test_a_driver_that_crashes_when_its_speed_is_measured_is_passed_over(self):
        with start("0:measure:segv", quick=()) as daemon:
            daemon.wait_device()  # software is measured while it serves
            scene = daemon.push(support.triangle())
            self.assertEqual(200, daemon.render(scene).status)
            support.wait_until(
                lambda: not daemon.is_alive() or (
                    daemon.raw("GET", "/readyz").status == 200 and
                    "speed" in str(daemon.request("GET", "/readyz").json().get("passed_over"))),
                "it is passed over", 180)
            if not daemon.is_alive():
                self.skipTest("there is one device alone")
            self.assertIn("its driver crashed twice when its speed was measured: signal 11",
                          daemon.request("GET", "/readyz").json()["passed_over"][0])
            self.assertEqual(200, daemon.render(scene).status)
            self.assertEqual(0, daemon.stop())

    def end_of(self, entries, *flags):
        """Status and last words of a daemon that must end by itself."""
        began = time.monotonic()
        with start(entries, *flags) as daemon:
            status = daemon.process.wait(support.START_S)
            log = daemon.log()
        self.assertLess(time.monotonic() - began, support.START_S)
        return status, log.strip().split("\n")[-1]

    def test_where_none_is_left_the_daemon_ends_and_lists_them_all(self):
        status, words = self.end_of("any:self-test:segv")
        self.assertEqual(1, status)
        self.assertRegex(words, "^vitraild: no device is left: ")
        lines = words.split("no device is left: ")[1].split("; ")
        self.assertGreater(len(lines), 0)
        for line in lines:
            self.assertRegex(line, "^EGL.*: passed over: its driver crashed twice in the "
                             r"self-test: signal 11 \(Segmentation fault\)$")

    def test_one_that_was_asked_for_ends_the_daemon(self):
        status, words = self.end_of("any:open:exit", "--device", "software")
        self.assertEqual(1, status)
        self.assertRegex(words, "^vitraild: device 'software', which was asked for, cannot be "
                                "taken: EGL.*: its driver crashed twice when it was opened: "
                                "exit status 3$")


support.run_tests()
