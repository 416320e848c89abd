# SPDX-License-Identifier: MIT
"""Workers and decoders that die, hang or lose their context cost one request, no more."""
import base64
import concurrent.futures
import os
import re
import signal
import threading
import time

import support
from image_files import png_bytes
from support import triangle

support.needs(support.FAKE)


class Worker(support.ServiceTest):
    flags = ("--render-timeout-s", "2")

    def render_in_background(self, scene, **members):
        done = concurrent.futures.Future()
        threading.Thread(
            target=lambda: done.set_result(self.daemon.render(scene, **members))
        ).start()
        return done

    def kill_worker_mid_render(self):
        """Kills the worker once it has begun; returns its pid."""
        support.wait_until(
            lambda: self.daemon.stats()["renders"]["in_flight"] > 0, "a render is under way"
        )
        time.sleep(0.2)
        pid = self.daemon.stats()["worker"]["pid"]
        os.kill(pid, signal.SIGKILL)
        support.wait_until(
            lambda: self.daemon.stats()["worker"]["pid"] not in (pid, None), "a new worker"
        )
        return pid

    def test_a_worker_killed_mid_render_is_replaced_and_the_render_retried(self):
        before = self.daemon.stats()
        scene = self.daemon.push(triangle("fake:slow=800"))
        self.daemon.worker_pid()
        done = self.render_in_background(scene)
        self.kill_worker_mid_render()
        self.assertEqual(200, done.result(60).status)
        after = self.daemon.stats()
        self.assertEqual(1, after["renders"]["retried"] - before["renders"]["retried"])
        self.assertEqual(1, after["worker"]["crashes"] - before["worker"]["crashes"])

    def test_a_render_whose_worker_is_killed_twice_is_refused_and_the_next_works(self):
        scene = self.daemon.push(triangle("fake:slow=900"))
        self.daemon.worker_pid()
        done = self.render_in_background(scene)
        self.kill_worker_mid_render()
        self.daemon.worker_pid()
        self.kill_worker_mid_render()
        reply = done.result(60)
        self.assertEqual((500, "render_failed"), (reply.status, reply.code))
        self.assertIn("2 times", reply.json()["detail"])
        self.assertIn("signal 9", reply.json()["detail"])
        self.assert_serves()

    def test_a_scene_that_ends_two_workers_is_quarantined_until_it_is_posted_again(self):
        content = triangle("fake:crash")
        scene = self.daemon.push(content)
        before = self.daemon.stats()["worker"]["quarantined_scenes"]
        reply = self.daemon.render(scene)
        self.assertEqual((500, "render_failed"), (reply.status, reply.code))
        self.assertIn("Segmentation fault", reply.json()["detail"])
        crashes = self.daemon.stats()["worker"]["crashes"]
        reply = self.daemon.render(scene, width=7)
        self.assertEqual((500, "render_failed"), (reply.status, reply.code))
        self.assertIn("quarantined", reply.json()["detail"])
        parts = {"bad": {"scene": scene}}
        reply = self.daemon.render(self.daemon.push(triangle("fake:whole")), parts=parts)
        self.assertEqual((500, "render_failed"), (reply.status, reply.code))
        self.assertIn("quarantined", reply.json()["detail"], "nor as a part of another scene")
        self.assertEqual(
            crashes, self.daemon.stats()["worker"]["crashes"], "no worker may die for it again"
        )
        self.assertEqual(before + 1, self.daemon.stats()["worker"]["quarantined_scenes"])
        self.assertEqual(200, self.daemon.post_scene(content).status)
        self.assertEqual(before, self.daemon.stats()["worker"]["quarantined_scenes"])
        self.assertNotIn("quarantined", self.daemon.render(scene).json()["detail"])
        self.daemon.request("DELETE", "/v1/scenes/" + scene)
        self.assert_serves()

    def test_renders_behind_a_crash_lose_nothing(self):
        bad, good = self.daemon.push(triangle("fake:crash")), self.daemon.push(triangle())
        self.daemon.request("DELETE", "/v1/scenes/" + bad)
        bad = self.daemon.push(triangle("fake:crash"))
        with concurrent.futures.ThreadPoolExecutor(21) as pool:
            replies = pool.map(
                lambda i: self.daemon.render(bad if i == 3 else good, width=i + 1).status, range(21)
            )
            self.assertEqual([500 if i == 3 else 200 for i in range(21)], list(replies))

    def test_a_worker_that_hangs_is_replaced_after_its_deadline(self):
        before = self.daemon.stats()["worker"]["timeouts"]
        scene = self.daemon.push(triangle("fake:hang"))
        began = time.monotonic()
        reply = self.daemon.render(scene)
        self.assertEqual((500, "render_failed"), (reply.status, reply.code))
        self.assertIn("deadline of 2 s", reply.json()["detail"])
        self.assertLess(time.monotonic() - began, 20)
        self.assertEqual(2, self.daemon.stats()["worker"]["timeouts"] - before)
        self.assert_serves()

    def test_a_gl_error_fails_its_render_only(self):
        pid = self.daemon.worker_pid()
        reply = self.daemon.render(self.daemon.push(triangle("fake:error")))
        self.assertEqual((500, "internal"), (reply.status, reply.code))
        self.assertIn("0x0502", reply.json()["detail"])
        self.assertEqual(pid, self.daemon.worker_pid())
        self.assert_serves()

    def test_a_lost_context_replaces_the_worker(self):
        pid = self.daemon.worker_pid()
        reply = self.daemon.render(self.daemon.push(triangle("fake:lost")))
        self.assertEqual((500, "render_failed"), (reply.status, reply.code))
        self.assertIn("context is lost", reply.json()["detail"])
        self.assertNotEqual(pid, self.daemon.worker_pid())
        self.assert_serves()

    def test_an_idle_worker_that_is_killed_is_replaced(self):
        pid = self.daemon.worker_pid()
        os.kill(pid, signal.SIGKILL)
        support.wait_until(
            lambda: self.daemon.stats()["worker"]["pid"] not in (pid, None), "a new worker"
        )
        self.assert_serves()

    def test_a_stopped_worker_is_replaced_after_its_deadline(self):
        pid = self.daemon.worker_pid()
        os.kill(pid, signal.SIGSTOP)
        scene = self.daemon.push(triangle())
        self.assertEqual(200, self.daemon.render(scene).status)
        self.assertNotEqual(pid, self.daemon.worker_pid())


class Decoder(support.ServiceTest):
    flags = ("--decode-timeout-s", "2", "--decode-memory-bytes", "256M")

    def tearDown(self):
        self.assert_serves()

    def refuse(self, fault):
        reply = self.daemon.post_scene(triangle(fault))
        self.assertEqual((422, "invalid_scene"), (reply.status, reply.code), reply.body)
        self.assertEqual(
            404, self.daemon.request("GET", "/v1/scenes/" + support.sha256(triangle(fault))).status
        )
        return reply.json()["detail"]

    def test_a_decoder_that_crashes_is_a_422_that_says_so(self):
        before = self.daemon.stats()["decodes"]["crashes"]
        self.assertIn("signal 6 (Aborted)", self.refuse("fake:decoder-crash"))
        self.assertEqual(1, self.daemon.stats()["decodes"]["crashes"] - before)

    def test_a_decoder_that_hangs_is_a_422_that_names_the_limit(self):
        self.assertIn("longer than 2 s", self.refuse("fake:decoder-hang"))

    def test_a_decoder_cannot_open_files(self):
        self.assertIn("open answered -1, Operation not permitted", self.refuse("fake:decoder-open"))

    def test_a_decoder_that_executes_or_connects_is_killed(self):
        self.assertIn("signal 31 (Bad system call)", self.refuse("fake:decoder-exec"))
        self.assertIn("signal 31 (Bad system call)", self.refuse("fake:decoder-socket"))

    def test_a_decoder_that_takes_all_memory_is_refused_more(self):
        with open(support.FAKE, "rb") as program:
            if re.search(rb"__[at]san_init", program.read()):
                self.skipTest("sanitizers need address space without limit")
        self.assertIn("268435456 bytes", self.refuse("fake:decoder-memory"))

    def test_a_spare_decoder_that_is_killed_is_missed_by_no_one(self):
        support.wait_until(
            lambda: children_of(self.daemon.process.pid, "decoder"), "a spare decoder"
        )
        for pid in children_of(self.daemon.process.pid, "decoder"):
            os.kill(pid, signal.SIGKILL)
        self.assertEqual(201, self.daemon.post_scene(triangle("spare")).status)


class Images(support.ServiceTest):
    def push_pane(self, name):
        """A triangle with a texture."""
        uri = "data:image/png;base64," + base64.b64encode(png_bytes(1, 1, bytes(4))).decode()
        look = {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}
        content = triangle(name, images=[{"uri": uri}], textures=[{"source": 0}], materials=[look])
        self.assertEqual(201, self.daemon.post_scene(content).status)

    def test_uploads_one_upon_the_other_find_decoders_that_read_images(self):
        for turn in range(3):
            self.push_pane(f"pane {turn}")
            self.daemon.push(triangle(f"no pane {turn}"))


class Children(support.unittest.TestCase):
    def test_no_child_outlives_a_daemon_that_is_killed(self):
        with support.Daemon() as daemon:
            daemon.wait_ready()
            support.wait_until(
                lambda: children_of(daemon.process.pid, "decoder"), "a spare decoder"
            )
            children = children_of(daemon.process.pid, "decoder") + children_of(
                daemon.process.pid, "worker"
            )
            self.assertGreaterEqual(len(children), 2)
            daemon.stop(signal.SIGKILL)
            support.wait_until(
                lambda: not any(is_running(pid) for pid in children), "they are gone"
            )

    def test_without_a_device_renders_are_refused_and_the_rest_serves(self):
        with support.Daemon("--device", "64") as daemon:
            scene = daemon.push(triangle())
            support.wait_until(
                lambda: daemon.raw("GET", "/readyz").code == "no_device", "the failure is known"
            )
            reply = daemon.render(scene)
            self.assertEqual((503, "no_device"), (reply.status, reply.code))
            self.assertIn("there is no device 64", reply.json()["detail"])
            self.assertEqual(200, daemon.request("GET", "/healthz").status)
            self.assertIsNone(daemon.request("GET", "/v1/capabilities").json()["device"])


def is_running(pid):
    try:
        with open(f"/proc/{pid}/stat", encoding="utf-8") as stat:
            return stat.read().rsplit(")", 1)[1].split()[0] not in "ZX"
    except OSError:
        return False


def children_of(parent, role):
    found = []
    for name in os.listdir("/proc"):
        try:
            with open(f"/proc/{name}/stat", encoding="utf-8") as stat:
                is_child = (
                    name.isdigit() and int(stat.read().rsplit(")", 1)[1].split()[1]) == parent
                )
            with open(f"/proc/{name}/cmdline", "rb") as line:
                if is_child and line.read() == b"vitraild\0--role=" + role.encode() + b"\0":
                    found.append(int(name))
        except (OSError, ValueError, IndexError):
            continue
    return found


if __name__ == "__main__":
    support.run_tests()
