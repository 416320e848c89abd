# SPDX-License-Identifier: MIT
"""Stopping: what is in flight is answered, nothing new is taken, and it ends in time."""
import concurrent.futures
import os
import signal
import socket
import time

import support
from support import triangle

support.needs(support.FAKE)


class Stop(support.unittest.TestCase):
    def test_renders_in_flight_are_answered_before_the_end(self):
        with support.Daemon() as daemon, concurrent.futures.ThreadPoolExecutor(8) as pool:
            scene = daemon.wait_ready().push(triangle("fake:slow=300"))
            replies = [pool.submit(daemon.render, scene) for _ in range(8)]
            support.wait_until(
                lambda: daemon.stats()["http"]["in_flight"] >= 9, "they are in flight"
            )
            began = time.monotonic()
            self.assertEqual(0, daemon.stop())
            self.assertEqual([200] * 8, [reply.result(1).status for reply in replies])
            self.assertLess(time.monotonic() - began, 10)

    def test_while_draining_no_one_new_is_let_in(self):
        with support.Daemon() as daemon, concurrent.futures.ThreadPoolExecutor(1) as pool:
            scene = daemon.wait_ready().push(triangle("fake:slow=3000"))
            idle = support.http.client.HTTPConnection("127.0.0.1", daemon.port, timeout=10)
            idle.request("GET", "/readyz")
            self.assertEqual(200, support.Reply(idle.getresponse()).status)
            last = pool.submit(daemon.render, scene)
            support.wait_until(
                lambda: daemon.stats()["renders"]["in_flight"] == 1, "a render is in flight"
            )
            daemon.process.send_signal(signal.SIGTERM)
            time.sleep(0.3)
            idle.request("GET", "/readyz")  # a connection from before still speaks, and is told
            reply = support.Reply(idle.getresponse())
            self.assertEqual((503, "overloaded"), (reply.status, reply.code))
            idle.request(
                "POST",
                "/v1/renders",
                '{"scene":"' + scene + '"}',
                {"Content-Type": "application/json"},
            )
            reply = support.Reply(idle.getresponse())
            self.assertEqual((503, "overloaded"), (reply.status, reply.code))
            idle.close()
            self.assertEqual(200, last.result(10).status)
            self.assertEqual(0, daemon.stop())

    def test_work_beyond_the_drain_deadline_is_refused_with_503(self):
        with support.Daemon(
            "--drain-timeout-s", "1"
        ) as daemon, concurrent.futures.ThreadPoolExecutor(6) as pool:
            scene = daemon.wait_ready().push(triangle("fake:hang"))
            replies = [pool.submit(daemon.render, scene) for _ in range(6)]
            support.wait_until(
                lambda: daemon.stats()["http"]["in_flight"] >= 7, "they are in flight"
            )
            began = time.monotonic()
            self.assertEqual(0, daemon.stop())
            self.assertLess(time.monotonic() - began, 8)
            self.assertEqual(
                [(503, "overloaded")] * 6,
                [(reply.result(1).status, reply.result(1).code) for reply in replies],
            )

    def test_a_second_signal_does_not_wait(self):
        with support.Daemon(
            "--drain-timeout-s", "60"
        ) as daemon, concurrent.futures.ThreadPoolExecutor(1) as pool:
            scene = daemon.wait_ready().push(triangle("fake:hang"))
            reply = pool.submit(daemon.render, scene)
            support.wait_until(
                lambda: daemon.stats()["renders"]["in_flight"] == 1, "a render is in flight"
            )
            daemon.process.send_signal(signal.SIGTERM)
            time.sleep(0.3)
            began = time.monotonic()
            self.assertEqual(0, daemon.stop(signal.SIGINT))
            self.assertLess(time.monotonic() - began, 8)
            self.assertEqual(503, reply.result(1).status)

    def test_an_upload_being_decoded_is_refused_at_the_deadline(self):
        with support.Daemon(
            "--drain-timeout-s", "1"
        ) as daemon, concurrent.futures.ThreadPoolExecutor(1) as pool:
            reply = pool.submit(daemon.post_scene, triangle("fake:decoder-hang"))
            support.wait_until(
                lambda: daemon.stats()["http"]["in_flight"] >= 2, "it is being decoded"
            )
            time.sleep(0.5)
            self.assertEqual(0, daemon.stop())
            self.assertEqual((503, "overloaded"), (reply.result(1).status, reply.result(1).code))
            self.assertEqual([], os.listdir(os.path.join(daemon.state_dir, "tmp")))

    def test_an_upload_that_ends_after_the_deadline_is_refused(self):
        """What serves it is still there: memory that was given back is filled by the C library."""
        content = triangle("late")
        with support.Daemon(
            "--drain-timeout-s", "1", environment={"MALLOC_PERTURB_": "165"}
        ) as daemon, socket.create_connection(("127.0.0.1", daemon.port), timeout=20) as peer:
            worker = daemon.worker_pid()
            peer.sendall(
                b"POST /v1/scenes HTTP/1.1\r\nHost: localhost\r\n"
                b"Content-Type: model/gltf-binary\r\nContent-Length: %d\r\n\r\n" % len(content)
                + content[:-5]
            )
            support.wait_until(
                lambda: daemon.stats()["http"]["in_flight"] >= 2, "the upload has begun"
            )
            daemon.process.send_signal(signal.SIGTERM)
            support.wait_until(
                lambda: not os.path.exists(f"/proc/{worker}"), "nobody renders any more"
            )
            peer.sendall(content[-5:])
            self.assertIn(b"HTTP/1.1 503 ", peer.recv(4096))
            self.assertEqual(0, daemon.stop())

    def test_idle_and_half_sent_connections_do_not_hold_the_end_up(self):
        with support.Daemon() as daemon:
            idle = [socket.create_connection(("127.0.0.1", daemon.port)) for _ in range(5)]
            for peer in idle[:3]:
                peer.sendall(b"GET / HTTP/1.1\r\nHost: loc")
            began = time.monotonic()
            self.assertEqual(0, daemon.stop(signal.SIGINT))
            self.assertLess(time.monotonic() - began, 10)
            for peer in idle:
                peer.close()

    def test_stopping_before_the_worker_is_ready_is_clean(self):
        for _ in range(3):
            with support.Daemon() as daemon:
                self.assertEqual(0, daemon.stop())

    def test_systemd_is_told_ready_and_stopping(self):
        with support.tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "notify")
            with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager:
                manager.bind(path)
                manager.settimeout(60)
                with support.Daemon(environment={"NOTIFY_SOCKET": path}) as daemon:
                    self.assertEqual(b"READY=1", manager.recv(100))
                    self.assertEqual(200, daemon.raw("GET", "/readyz").status)
                    self.assertEqual(0, daemon.stop())
                self.assertEqual(b"STOPPING=1", manager.recv(100))


if __name__ == "__main__":
    support.run_tests()
