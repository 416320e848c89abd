# SPDX-License-Identifier: MIT
"""A WebSocket client of a hundred lines, and readers of streams, for the tests of views."""
import base64
import hashlib
import json
import os
import socket
import struct

GUID = "258EAFA5-E914-47DA-95CA-C5AB0DC85B11"
TEXT, BINARY, CLOSE, PING, PONG = 1, 2, 8, 9, 10


class Closed(Exception):
    """The peer ended the connection; args: close code (None without one), reason."""


class Wire:
    """A connection with a buffer."""

    def __init__(self, port, timeout=20, receive_buffer=None):
        self.peer = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        if receive_buffer:
            self.peer.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
        # As browsers have it: else a camera waits until the acknowledgement before it has arrived.
        self.peer.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.peer.settimeout(timeout)
        self.peer.connect(("127.0.0.1", port))
        self.buffer = b""

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.peer.close()

    def fill(self):
        piece = self.peer.recv(65536)
        if not piece:
            raise Closed(None, "end of stream")
        self.buffer += piece

    def take(self, count):
        while len(self.buffer) < count:
            self.fill()
        taken, self.buffer = self.buffer[:count], self.buffer[count:]
        return taken

    def until(self, mark):
        while mark not in self.buffer:
            self.fill()
        taken, self.buffer = self.buffer.split(mark, 1)
        return taken

    def head(self):
        """(status, headers) of a reply."""
        lines = self.until(b"\r\n\r\n").decode("latin-1").split("\r\n")
        fields = (line.split(": ", 1) for line in lines[1:])
        return int(lines[0].split()[1]), {name.lower(): value for name, value in fields}


class WebSocket(Wire):
    def __init__(self, port, path, headers=None, **options):
        super().__init__(port, **options)
        key = base64.b64encode(os.urandom(16)).decode()
        fields = {"Host": f"127.0.0.1:{port}", "Upgrade": "websocket", "Connection": "Upgrade",
                  "Sec-WebSocket-Key": key, "Sec-WebSocket-Version": "13", **(headers or {})}
        lines = [f"GET {path} HTTP/1.1"] + [f"{k}: {v}" for k, v in fields.items()
                                            if v is not None]
        self.peer.sendall(("\r\n".join(lines) + "\r\n\r\n").encode())
        self.status, self.headers = self.head()
        if self.status == 101:
            wanted = base64.b64encode(hashlib.sha1((key + GUID).encode()).digest()).decode()
            assert self.headers["sec-websocket-accept"] == wanted, self.headers

    def send_frame(self, opcode, payload, first=0x80, is_masked=True, length=None):
        length = len(payload) if length is None else length
        mask = os.urandom(4) if is_masked else b""
        bit = 0x80 if is_masked else 0
        size = (bytes([bit | length]) if length < 126
                else bytes([bit | 126]) + struct.pack(">H", length) if length < 1 << 16
                else bytes([bit | 127]) + struct.pack(">Q", length))
        body = bytes(b ^ mask[i % 4] for i, b in enumerate(payload)) if is_masked else payload
        self.peer.sendall(bytes([first | opcode]) + size + mask + body)

    def send(self, **message):
        self.send_frame(TEXT, json.dumps(message).encode())

    def receive_frame(self):
        """(opcode, payload) of the next frame; the server does not fragment."""
        first, second = self.take(2)
        length = second & 0x7F
        if length == 126:
            (length,) = struct.unpack(">H", self.take(2))
        elif length == 127:
            (length,) = struct.unpack(">Q", self.take(8))
        assert first & 0x70 == 0 and second & 0x80 == 0, (first, second)
        return first & 0x0F, self.take(length)

    def receive(self):
        """The next message: a dict; a frame has its image under "image"."""
        while True:
            opcode, payload = self.receive_frame()
            if opcode == CLOSE:
                code = struct.unpack(">H", payload[:2])[0] if payload else None
                raise Closed(code, payload[2:].decode())
            if opcode == PING:
                self.send_frame(PONG, payload)
            elif opcode == TEXT:
                return json.loads(payload)
            elif opcode == BINARY:
                (size,) = struct.unpack(">I", payload[:4])
                return {**json.loads(payload[4 : 4 + size]), "image": payload[4 + size :]}

    def until_type(self, kind, **expected):
        """Reads on, acknowledging frames, to a message of this type with these members."""
        while True:
            message = self.receive()
            if message["type"] == "frame":
                self.send(type="ack")
            if message["type"] == kind and all(message.get(k) == v for k, v in expected.items()):
                return message

    def close_code(self):
        """Reads on until the server closes."""
        try:
            while True:
                self.receive()
        except Closed as closed:
            return closed.args[0]


class Stream(Wire):
    """A chunked reply, read piece by piece."""

    def __init__(self, port, path, **options):
        super().__init__(port, **options)
        self.peer.sendall(f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\n\r\n".encode())
        self.status, self.headers = self.head()
        self.decoded = b""

    def chunk(self):
        size = int(self.until(b"\r\n"), 16)
        if size == 0:
            raise Closed(None, "the last chunk")
        self.decoded += self.take(size)
        self.take(2)

    def decode_until(self, mark):
        while mark not in self.decoded:
            self.chunk()
        taken, self.decoded = self.decoded.split(mark, 1)
        return taken

    def part(self):
        """(headers, body) of the next part of a multipart stream."""
        lines = self.decode_until(b"\r\n\r\n").decode().split("\r\n")
        fields = (line.split(": ", 1) for line in lines if ": " in line)
        headers = {name.lower(): value for name, value in fields}
        size = int(headers["content-length"])
        while len(self.decoded) < size + len(b"\r\n--vitrail-frame\r\n"):
            self.chunk()
        body, self.decoded = self.decoded[:size], self.decoded[size:]
        return headers, body

    def event(self):
        """(name, data) of the next server-sent event; comments are (None, text)."""
        lines = self.decode_until(b"\n\n").decode().split("\n")
        if lines[0].startswith(":"):
            return None, lines[0]
        fields = dict(line.split(": ", 1) for line in lines)
        return fields["event"], json.loads(fields["data"])
