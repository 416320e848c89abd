# SPDX-License-Identifier: MIT
"""What a client can make the front hold: many views, halves of messages, sockets that end on one
side, readers that stop. On the test double."""
import os
import socket
import time

import support
from sockets import CLOSE, PING, TEXT, Stream, WebSocket
from support import triangle, wait_until

support.needs(support.FAKE)

LOOK = {"eye": [0, 0, 5], "target": [0, 0, 0]}
KIB, MIB = 1 << 10, 1 << 20


class Memory(support.ServiceTest):
    flags = ("--connections", "600", "--views", "2000", "--views-per-client", "2000")

    def setUp(self):
        self.scene = self.daemon.push(triangle())

    def make(self, **members):
        body = {"scene": self.scene, "width": 64, "height": 32, **members}
        view = self.daemon.request("POST", "/v1/views", body).json()["id"]
        self.addCleanup(self.daemon.request, "DELETE", f"/v1/views/{view}")
        return view

    def resident(self):
        with open(f"/proc/{self.daemon.process.pid}/statm", encoding="ascii") as statm:
            return int(statm.read().split()[1]) * os.sysconf("SC_PAGESIZE")

    def watchers(self):
        return self.daemon.stats()["views"]["watchers"]

    def open(self, view, **options):
        client = WebSocket(self.daemon.port, f"/v1/views/{view}/socket", **options)
        self.addCleanup(client.__exit__)
        return client

    def test_a_thousand_views_take_some_kilobytes_each(self):
        self.make()
        before = self.resident()
        for _ in range(1000):
            self.make()
        self.assertLess((self.resident() - before) / 1000, 12 * KIB)

    def test_halves_of_messages_hold_no_more_than_what_was_sent(self):
        view = self.make()
        clients = [self.open(view) for _ in range(50)]
        before = self.resident()
        for client in clients:  # a frame that says it is long, and one that is not the last
            client.send_frame(TEXT, b"x" * 1000, length=60000)
        for client in [self.open(view) for _ in range(10)]:
            client.send_frame(TEXT, b"x" * 1000, first=0)
        self.assert_serves()
        self.assertLess(self.resident() - before, 16 * MIB)
        for client in clients:
            client.peer.close()
        wait_until(lambda: self.watchers() == 10, "those that left are gone")

    def test_pieces_without_end_are_refused_at_the_limit_of_a_message(self):
        client = self.open(self.make())
        before = self.resident()
        client.send_frame(TEXT, b"x" * 60000, first=0)
        try:
            for _ in range(1000):
                client.send_frame(0, b"x" * 60000, first=0)
        except OSError:
            pass  # it has hung up
        try:
            self.assertEqual(1009, client.close_code())
        except OSError:
            pass  # over what was sent after its close frame
        self.assertLess(self.resident() - before, 8 * MIB)
        wait_until(lambda: self.watchers() == 0, "it is gone")

    def test_a_socket_that_ends_on_one_side_ends_on_the_other(self):
        client = self.open(self.make())
        client.until_type("hello")
        client.peer.shutdown(socket.SHUT_WR)
        wait_until(lambda: self.watchers() == 0, "it is gone")
        self.assertIsNone(client.close_code())

    def test_resets_in_the_middle_of_frames_leave_nothing(self):
        view = self.make(width=1500, height=1500)
        for kind in ("socket", "stream") * 5:
            opener = WebSocket if kind == "socket" else Stream
            client = opener(self.daemon.port, f"/v1/views/{view}/{kind}", receive_buffer=4096)
            client.take(3000)
            client.peer.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER,
                                   support.struct.pack("ii", 1, 0))
            client.peer.close()
        wait_until(lambda: self.watchers() == 0, "they are gone")
        self.assert_serves()

    def test_readers_that_stop_are_left_after_half_a_minute(self):
        view = self.make(width=1500, height=1500, stream={"rest_ms": 0})
        lazy = self.open(view, receive_buffer=4096)
        stream = Stream(self.daemon.port, f"/v1/views/{view}/stream", receive_buffer=4096)
        self.addCleanup(stream.__exit__)
        self.assertEqual(2, self.watchers())
        began = time.monotonic()
        for n in range(8):  # more than fits into the buffers of both ends
            self.daemon.request("PATCH", f"/v1/views/{view}", {"exposure_ev": 0.1 * n})
            lazy.send(type="ack", count=8)
            time.sleep(0.5)
        wait_until(lambda: self.watchers() == 0, "both are left", 60)
        self.assertGreater(time.monotonic() - began, 10)

    def test_a_peer_that_is_gone_without_a_word_is_left_after_a_minute(self):
        gone = self.open(self.make())
        gone.peer.settimeout(90)
        began, pings = time.monotonic(), 0
        while (frame := gone.receive_frame())[0] != CLOSE:
            pings += frame[0] == PING  # and never a pong
        self.assertGreaterEqual(pings, 2)
        self.assertEqual((1008).to_bytes(2, "big"), frame[1][:2])
        self.assertGreater(time.monotonic() - began, 30)
        wait_until(lambda: self.watchers() == 0, "it is left")


if __name__ == "__main__":
    support.run_tests()
