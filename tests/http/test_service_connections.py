# SPDX-License-Identifier: MIT
"""Below the routes: framing, foreign hosts and pages, slow and vanishing clients."""
import concurrent.futures
import re
import socket
import time

import support
from support import talk, triangle

support.needs(support.FAKE)

HEAD = b"Host: localhost\r\n"


def statuses(answer):
    return [int(status) for status in re.findall(rb"HTTP/1\.1 (\d{3}) ", answer)]


class Framing(support.ServiceTest):
    def ask(self, text, timeout=3):
        return talk(self.daemon.port, text, timeout)

    def refuse(self, text, status=400, or_status=None):
        """One refusal, then the connection ends: what follows in it is never read as a request."""
        answer = self.ask(text + b"GET /smuggled HTTP/1.1\r\n" + HEAD + b"\r\n")
        self.assertIn(statuses(answer), ([status], [or_status or status]), (text, answer))
        self.assertNotIn(b"smuggled", answer)
        return answer

    def refuse_unless_the_library_does(self, text, its_status=400):
        if support.library_is_strict():
            self.refuse(text, or_status=its_status)
        else:
            self.assertIn(b"application/problem+json", self.refuse(text))

    def test_two_content_lengths_are_refused(self):
        for first, second in ((5, 0), (0, 5), (5, 5), (0, 0)):
            self.refuse_unless_the_library_does(
                b"POST /v1/renders HTTP/1.1\r\n"
                + HEAD
                + b"Content-Type: application/json\r\nContent-Length: %d\r\n"
                b"Content-Length: %d\r\n\r\nhello" % (first, second)
            )

    def test_names_that_are_no_tokens_are_refused(self):
        head = b"POST /v1/renders HTTP/1.1\r\n" + HEAD
        for field in (
            b"Content-Length : 5\r\n",
            b"Transfer-Encoding : chunked\r\nContent-Length: 5\r\n",
            b"Transfer-Encoding\t: chunked\r\nContent-Length: 5\r\n",
            b"X A: b\r\n",
            b"X(A): b\r\n",
        ):
            self.refuse_unless_the_library_does(head + field + b"\r\nhello")

    def test_lines_that_readers_end_elsewhere_are_refused(self):
        get = b"GET /healthz HTTP/1.1\r\n"
        post = b"POST /v1/renders HTTP/1.1\r\n" + HEAD
        for head in (
            post + b"Content-Length:\r\n 5\r\n\r\nhello",  # a field that goes on in the next line
            post + b"Content-Length: 5\r\n \t\r\n\r\nhello",
            post + b"Transfer-Encoding: chunked\r\n x\r\n\r\n0\r\n\r\n",
            post + b"X: a\r\n Content-Length: 5\r\n\r\nhello",
            get + HEAD + b"X: a\r\n\tb\r\n\r\n",
            get + b" X: a\r\n" + HEAD + b"\r\n",
            b"GET /healthz HTTP/1.1\n" + HEAD + b"\r\n",  # bare line feeds
            b"GET /healthz HTTP/1.1\nHost: localhost\n\n",
            get + b"Host: localhost\n\r\n",
            get + HEAD + b"\n",
            get + HEAD + b"X: a\nY: b\r\n\r\n",
            post + b"X: a\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n",
            get + HEAD + b"X: a\rb\r\n\r\n",
            get + HEAD + b"X: a\0b\r\n\r\n",  # zero bytes
            get + HEAD + b"X: a\0\0Content-Length: 5\r\n\r\n",
            get + HEAD + b"X: \0\r\n\r\n",
            get + HEAD + b"X\0: a\r\n\r\n",
            get + HEAD + b": a\r\n",  # no name
            get + HEAD + b": a\r\n\r\n",
            get + b": a\r\n" + HEAD + b"\r\n",
        ):
            with self.subTest(head):
                self.refuse(head)

    def test_heads_are_taken_however_they_arrive(self):
        """Whatever fields there are, and in whatever pieces, line ends are told rightly."""
        fields = (b"X:\r\nY: \t a \t\r\nCookie: a=b; c=\"d\"\r\nZ: " + b"z" * 20000 + b"\r\n"
                  + b"".join(b"N%d: %d\r\n" % (i, i) for i in range(200)))
        request = b"GET /healthz?a=%20b&c HTTP/1.1\r\n" + HEAD + fields + b"\r\n"
        for pieces in (1, 2, 40):
            with socket.create_connection(("127.0.0.1", self.daemon.port), timeout=10) as peer:
                peer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                for turn in range(3):  # the connection stays
                    size = -(-len(request) // pieces)
                    for at in range(0, len(request), size):
                        peer.sendall(request[at : at + size])
                        time.sleep(0.002)
                    answer = b""
                    while not answer.endswith(b"}"):
                        answer += peer.recv(4096)
                    self.assertEqual([200], statuses(answer), (pieces, turn))

    def test_coded_bodies_are_not_taken(self):
        kind = b"Content-Type: application/json\r\nContent-Length: 2\r\n"
        for coding, status in ((b"gzip", 415), (b"br, gzip", 415), (b"identity", 400)):
            text = (b"POST /v1/renders HTTP/1.1\r\n" + HEAD + kind + b"Content-Encoding: " + coding
                    + b"\r\n\r\n{}")
            self.assertEqual([status], statuses(self.ask(text, 1)), coding)

    def test_content_length_with_transfer_encoding_is_refused(self):
        for order in (
            b"Content-Length: 4\r\nTransfer-Encoding: chunked\r\n",
            b"Transfer-Encoding: chunked\r\nContent-Length: 4\r\n",
        ):
            self.refuse(b"POST /v1/renders HTTP/1.1\r\n" + HEAD + order + b"\r\n0\r\n\r\n")

    def test_transfer_encodings_that_are_not_chunked_are_refused(self):
        for encoding in (
            b"xchunked",
            b"gzip",
            b"chunked, chunked",
            b"gzip, chunked",
            b"identity",
            b"chunked\x0b",
        ):
            self.refuse_unless_the_library_does(
                b"POST /v1/renders HTTP/1.1\r\n"
                + HEAD
                + b"Transfer-Encoding: "
                + encoding
                + b"\r\n\r\n0\r\n\r\n",
                its_status=501,
            )
        self.refuse_unless_the_library_does(
            b"POST /v1/renders HTTP/1.1\r\n"
            + HEAD
            + b"Transfer-Encoding: chunked\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n"
        )

    def test_lengths_that_are_no_lengths_are_refused(self):
        for length in (b"-1", b"+5", b"5x", b"0x5", b"1e3", b"9" * 30, b"5, 5"):
            answer = self.ask(
                b"POST /v1/renders HTTP/1.1\r\n"
                + HEAD
                + b"Content-Length: "
                + length
                + b"\r\n\r\nhello"
            )
            # libmicrohttpd answers some of these itself, and sends its head twice then.
            self.assertIn(set(statuses(answer)), ({400}, {413}), (length, answer))

    def test_host_must_be_there_once(self):
        self.refuse(b"GET /healthz HTTP/1.1\r\n" + HEAD + HEAD + b"\r\n")
        self.refuse_unless_the_library_does(b"GET /healthz HTTP/1.1\r\n\r\n")
        self.assertEqual([200], statuses(self.ask(b"GET /healthz HTTP/1.0\r\n\r\n")))

    def test_three_pipelined_requests_have_three_replies_in_order(self):
        answer = self.ask(
            b"".join(
                b"GET %s HTTP/1.1\r\n" % path + HEAD + b"\r\n"
                for path in (b"/healthz", b"/nowhere", b"/readyz")
            )
        )
        self.assertEqual([200, 404, 200], statuses(answer))

    def test_head_fields_that_are_too_large_are_refused(self):
        self.assertEqual(
            {431},
            set(
                statuses(
                    self.ask(b"GET / HTTP/1.1\r\n" + HEAD + b"X: " + b"x" * 200000 + b"\r\n\r\n")
                )
            )
            or {431},
        )
        self.assert_serves()

    def test_a_chunked_body_is_taken(self):
        content = triangle("chunked")
        reply = self.daemon.post_scene(iter([content[:7], content[7:100], content[100:]]))
        self.assertEqual((201, support.sha256(content)), (reply.status, reply.json()["id"]))

    def test_expect_is_answered_100(self):
        answer = self.ask(
            b"POST /v1/renders HTTP/1.1\r\n" + HEAD + b"Content-Type: application/json\r\n"
            b"Expect: 100-continue\r\nContent-Length: 2\r\n\r\n",
            1,
        )
        self.assertTrue(answer.startswith(b"HTTP/1.1 100 Continue\r\n"), answer)

    def test_a_body_that_a_route_does_not_want_is_ignored(self):
        answer = self.ask(
            b"GET /healthz HTTP/1.1\r\n" + HEAD + b"Content-Length: 5\r\n\r\nhello"
            b"GET /readyz HTTP/1.1\r\n" + HEAD + b"\r\n"
        )
        self.assertEqual([200, 200], statuses(answer))


class Hosts(support.ServiceTest):
    flags = ("--allow-host", "render.example, other.example")

    def host(self, host):
        return self.daemon.raw("GET", "/v1/stats", headers={"Host": host}).status

    def test_only_names_of_this_machine_are_answered(self):
        for host in (
            "localhost",
            f"localhost:{self.daemon.port}",
            "127.0.0.1",
            "127.9.9.9:80",
            "[::1]:1",
            "LOCALHOST",
            "localhost.",
            "render.example",
            "other.example:443",
        ):
            self.assertEqual(200, self.host(host), host)
        for host in (
            "evil.example",
            "127.0.0.1.evil.example",
            "localhost.evil.example",
            "example",
            "a@localhost",
            "localhost:80:80",
            "[::1",
            "1.127.0.0",
            "render.example.evil",
            "localhost:x",
            "127.0.0.1x",
            "127.999.999.999",
            "127.1",
        ):
            self.assertEqual(400, self.host(host), host)

    def test_pages_of_other_sites_change_nothing(self):
        scene = self.daemon.push(triangle())
        body, media_type = support.multipart({"a.glb": triangle("foreign")})
        for headers in (
            {"Origin": "http://evil.example"},
            {"Origin": "null"},
            {"Sec-Fetch-Site": "cross-site"},
            {"Origin": "http://localhost:1"},
        ):
            for method, path in (("DELETE", "/v1/scenes/" + scene), ("POST", "/v1/scenes")):
                reply = self.daemon.raw(method, path, body, {"Content-Type": media_type, **headers})
                self.assertEqual(400, reply.status, (headers, method))
        self.assertEqual(200, self.daemon.request("GET", "/v1/scenes/" + scene).status)
        own = {"Origin": f"http://127.0.0.1:{self.daemon.port}", "Sec-Fetch-Site": "same-origin"}
        self.assertEqual(
            204, self.daemon.request("DELETE", "/v1/scenes/" + scene, headers=own).status
        )


class Origins(support.ServiceTest):
    flags = ("--allow-origin", "http://localhost:5173, https://cad.example")

    def ask(self, origin, method="GET", path="/v1/stats", **headers):
        fields = {name.replace("_", "-"): value for name, value in headers.items()}
        return self.daemon.request(method, path, headers={"Origin": origin, **fields})

    def test_pages_of_listed_origins_read_and_change(self):
        scene = self.daemon.push(triangle())
        for origin in ("http://localhost:5173", "https://cad.example"):
            reply = self.ask(origin, Sec_Fetch_Site="cross-site")
            self.assertEqual(200, reply.status)
            self.assertEqual(origin, reply.header("Access-Control-Allow-Origin"))
            self.assertIn("ETag", reply.header("Access-Control-Expose-Headers"))
        reply = self.ask("https://cad.example", "DELETE", f"/v1/scenes/{scene}",
                         Sec_Fetch_Site="cross-site")
        self.assertEqual((204, "https://cad.example"),
                         (reply.status, reply.header("Access-Control-Allow-Origin")))

    def test_preflights_of_listed_origins_are_answered(self):
        reply = self.ask("https://cad.example", "OPTIONS", "/v1/renders",
                         Access_Control_Request_Method="POST",
                         Access_Control_Request_Headers="content-type")
        self.assertEqual(204, reply.status)
        self.assertIn("PATCH", reply.header("Access-Control-Allow-Methods"))
        self.assertIn("Content-Type", reply.header("Access-Control-Allow-Headers"))

    def test_other_origins_neither_read_nor_change(self):
        for origin in ("https://cad.example.evil", "http://cad.example", "null",
                       "http://localhost:51730", "*"):
            reply = self.ask(origin)
            self.assertEqual(200, reply.status)
            self.assertIsNone(reply.header("Access-Control-Allow-Origin"), origin)
            reply = self.ask(origin, "OPTIONS", "/v1/renders", Access_Control_Request_Method="POST")
            self.assertIsNone(reply.header("Access-Control-Allow-Methods"), origin)
            self.assertEqual(400, self.ask(origin, "DELETE", "/v1/scenes/" + "0" * 64).status)


class Clients(support.ServiceTest):
    flags = ("--connections", "512")

    def connect(self):
        return socket.create_connection(("127.0.0.1", self.daemon.port), timeout=30)

    def seconds_until_closed(self, peer, drip):
        """Sends a byte now and then until the server hangs up."""
        began = time.monotonic()
        peer.settimeout(0.25)
        while time.monotonic() - began < 60:
            try:
                if drip:
                    peer.sendall(drip)
                if peer.recv(4096) == b"":
                    break
            except TimeoutError:
                continue
            except (ConnectionResetError, BrokenPipeError):
                break
        return time.monotonic() - began

    def test_slow_and_silent_heads_are_ended_after_ten_seconds(self):
        with concurrent.futures.ThreadPoolExecutor(2) as pool:
            dripping, silent = self.connect(), self.connect()
            dripping.sendall(b"GET / HTTP/1.1\r\nX: ")
            waits = list(pool.map(self.seconds_until_closed, (dripping, silent), (b"x", b"")))
            for seconds in waits:
                self.assertGreater(seconds, 8)
                self.assertLess(seconds, 15)
            dripping.close()
            silent.close()
        self.assert_serves()

    def test_many_idle_connections_leave_room_for_work(self):
        idle = [self.connect() for _ in range(300)]
        began = time.monotonic()
        self.assert_serves()
        self.assertLess(time.monotonic() - began, 8)
        for peer in idle:
            peer.close()

    def test_a_client_that_vanishes_in_its_upload_leaves_nothing(self):
        for _ in range(20):
            peer = self.connect()
            peer.sendall(
                b"POST /v1/scenes HTTP/1.1\r\n" + HEAD + b"Content-Type: model/gltf-binary\r\n"
                b"Content-Length: 1000000\r\n\r\nglTF" + bytes(5000)
            )
            peer.close()
        support.wait_until(
            lambda: self.daemon.stats()["http"]["in_flight"] == 1, "the uploads are given up"
        )
        self.assert_serves()

    def test_a_client_that_vanishes_in_its_render_harms_no_one(self):
        scene = self.daemon.push(triangle("fake:slow=200"))
        body = b'{"scene":"%s","width":8,"height":8}' % scene.encode()
        for _ in range(8):
            peer = self.connect()
            peer.sendall(
                b"POST /v1/renders HTTP/1.1\r\n" + HEAD + b"Content-Type: application/json\r\n"
                b"Content-Length: %d\r\n\r\n" % len(body) + body
            )
            peer.close()
        support.wait_until(
            lambda: self.daemon.stats()["http"]["in_flight"] == 1, "the renders are over"
        )
        self.assert_serves()

    def test_a_half_closed_request_is_answered_when_nothing_has_to_be_waited_for(self):
        answer = talk(self.daemon.port, b"GET /healthz HTTP/1.1\r\n" + HEAD + b"\r\n", 5, shut=True)
        self.assertEqual([200], statuses(answer))

    def test_who_says_at_once_that_nothing_follows_holds_no_connection(self):
        before = self.daemon.stats()["http"]["connections"]
        request = f"GET /healthz HTTP/1.1\r\nHost: 127.0.0.1:{self.daemon.port}\r\n\r\n"
        for _ in range(40):
            with socket.create_connection(("127.0.0.1", self.daemon.port), timeout=10) as peer:
                peer.sendall(request.encode())
                peer.shutdown(socket.SHUT_WR)
                self.assertIn(b"200 OK", peer.recv(4096))
        support.wait_until(lambda: self.daemon.stats()["http"]["connections"] <= before + 1,
                           "they are closed long before idle ones are", timeout_s=10)

    def test_a_reset_connection_harms_no_one(self):
        for _ in range(20):
            peer = self.connect()
            peer.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, support.struct.pack("ii", 1, 0))
            peer.sendall(b"GET /metrics HTTP/1.1\r\n" + HEAD + b"\r\n")
            peer.close()
        self.assert_serves()


if __name__ == "__main__":
    support.run_tests()
