# SPDX-License-Identifier: MIT
"""What the tests of the client share: a stub server, scenes to send, and a way to run `vitrail`."""
import hashlib
import http.server
import json
import os
import re
import struct
import subprocess
import sys
import tempfile
import threading
import unittest

BIN = os.path.abspath(sys.argv[1] if len(sys.argv) > 1 else "build/bin")
VITRAIL = os.path.join(BIN, "vitrail")
PNG = b"\x89PNG\r\n\x1a\n" + b"pixels" * 1000
FRAME = {"id": "f1", "warnings": ["no light in the scene"], "timings_ms": {"total": 12.5},
         "plan": [{"pass": "shade", "because": "always", "technique": "clustered", "ms": 3.5}]}


def glb(size=64):
    """A file that begins as a GLB does; the client looks no further."""
    return b"glTF" + struct.pack("<II", 2, size) + bytes(size - 12)


def multipart_parts(content_type, body):
    """{part name: (file name, bytes)} of a multipart/form-data body."""
    boundary = re.search(r'boundary="?([^";]+)', content_type).group(1).encode()
    parts = {}
    for chunk in body.split(b"--" + boundary)[1:-1]:
        head, _, content = chunk[2:-2].partition(b"\r\n\r\n")
        text = head.decode()
        name = re.search(r'[ ;]name="([^"]*)"', text).group(1)
        file_name = re.search(r'filename="([^"]*)"', text)
        parts[name] = (file_name.group(1) if file_name else None, content)
    return parts


class Request:
    def __init__(self, handler, body):
        self.method, self.path = handler.command, handler.path
        self.headers, self.body = handler.headers, body

    def json(self):
        return json.loads(self.body)


class Handler(http.server.BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"

    def log_message(self, *arguments):
        pass

    def answer(self, status, body=b"", headers=(), length=None):
        if isinstance(body, (dict, list)):
            body = json.dumps(body).encode()
            headers = [("Content-Type", "application/json"), *headers]
        self.send_response(status)
        for name, value in headers:
            self.send_header(name, value)
        self.send_header("Content-Length", str(len(body) if length is None else length))
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(body)
            self.wfile.flush()

    def problem(self, status, code, detail, pointer=None, headers=()):
        body = {"type": "about:blank", "status": status, "code": code, "detail": detail}
        if pointer:
            body["pointer"] = pointer
        self.answer(status, json.dumps(body).encode(),
                    [("Content-Type", "application/problem+json"), *headers])

    def read_body(self):
        return self.rfile.read(int(self.headers.get("Content-Length", 0)))

    def handle_any(self):
        stub = self.server.stub
        request = Request(self, self.read_body())
        with stub.lock:
            stub.requests.append(request)
        special = stub.special.get((self.command, self.path.partition("?")[0]))
        if special and special(self, request) is not False:
            return
        self.route(stub, request)

    do_GET = do_POST = do_PATCH = do_DELETE = do_HEAD = handle_any

    def route(self, stub, request):
        path = self.path.partition("?")[0]
        scene = path.rpartition("/")[2]
        if path in ("/healthz", "/readyz"):
            self.answer(200, {"status": "ok"})
        elif path == "/v1/scenes" and self.command == "POST":
            scene = hashlib.sha256(request.body).hexdigest()
            if request.headers["Content-Type"].startswith("multipart/"):
                scene = "ab" * 32
            stub.scenes.add(scene)
            self.answer(201, {"id": scene}, [("Location", "/v1/scenes/" + scene)])
        elif path == "/v1/scenes/demo" and self.command == "POST":
            stub.scenes.add("de" * 32)
            self.answer(201, {"id": "de" * 32}, [("Location", "/v1/scenes/" + "de" * 32)])
        elif path == "/v1/scenes":
            self.answer(200, {"scenes": [{"id": s, "name": stub.names.get(s, "box\x1b[2J.glb"),
                                          "triangles": 12,
                                          "bytes": {"upload": 1024, "decoded": 3 << 20},
                                          "material_count": 2, "light_count": 1}
                                         for s in sorted(stub.scenes)]})
        elif path.startswith("/v1/scenes/"):
            if scene not in stub.scenes:
                self.problem(404, "not_found", "no scene " + scene)
            elif self.command == "PATCH":
                stub.names[scene] = request.json()["name"]
                self.answer(200, {"id": scene, "name": stub.names[scene]})
            elif self.command == "DELETE":
                stub.scenes.discard(scene)
                self.answer(204)
            else:
                self.answer(200, {"id": scene, "warnings": stub.scene_warnings, **stub.described})
        elif path == "/v1/renders":
            if request.json()["scene"] not in stub.scenes:
                self.problem(404, "not_found", "no such scene", "/scene")
            else:
                self.answer(200, stub.image, [("Content-Type", request.headers["Accept"]),
                                              ("Link", '</v1/frames/f1>; rel="describedby"')])
        elif path.startswith("/v1/renders/") and stub.statuses:
            body = stub.statuses.pop(0)
            self.answer(200, body, [("Content-Type", "application/json")]
                        if isinstance(body, bytes) else ())
        elif path == "/v1/frames/f1":
            self.answer(200, FRAME)
        elif path in ("/v1/stats", "/v1/capabilities"):
            self.answer(200, {"device": {"renderer": "stub", "is_robust": True},
                              "formats": ["png", "exr"], "frames": 3})
        else:
            self.problem(404, "not_found", "no route " + path)


class Stub:
    """A server with the routes that the client uses. `special` overrides a route:
    {(method, path): function(handler, request)}; one that returns False leaves the answer to the
    usual route."""

    def __init__(self):
        self.requests, self.scenes, self.special = [], set(), {}
        self.scene_warnings, self.names = [], {}
        self.described = {"camera_count": 1, "light_count": 1}
        self.statuses = []  # answers to GET /v1/renders/{id}, each once
        self.image, self.lock = PNG, threading.Lock()
        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.server.daemon_threads = True
        self.server.stub = self
        self.url = "http://127.0.0.1:%d" % self.server.server_port
        threading.Thread(target=self.server.serve_forever, args=(0.02,), daemon=True).start()

    def close(self):
        self.server.shutdown()
        self.server.server_close()

    def sent(self, method, path):
        return [r for r in self.requests
                if r.method == method and r.path.partition("?")[0] == path]


class CliTest(unittest.TestCase):
    """A stub server, an empty folder, and vitrail run against the one in the other."""

    def setUp(self):
        self.stub = Stub()
        self.addCleanup(self.stub.close)
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        self.environment = dict(os.environ, VITRAIL_SERVER=self.stub.url, TMPDIR=self.folder)
        self.environment.pop("http_proxy", None)

    def path(self, *names):
        return os.path.join(self.folder, *names)

    def write(self, name, content):
        os.makedirs(os.path.dirname(self.path(name)), exist_ok=True)
        with open(self.path(name), "wb") as file:
            file.write(content if isinstance(content, bytes) else content.encode())
        return self.path(name)

    def read(self, name):
        with open(self.path(name), "rb") as file:
            return file.read()

    def scene(self, content=None, name="box.glb"):
        return self.write(name, content or glb())

    def start(self, *arguments, program=VITRAIL, **options):
        return subprocess.Popen([program, *arguments], cwd=self.folder, env=self.environment,
                                stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                stderr=subprocess.PIPE, **options)

    def run_cli(self, *arguments, code=0, **options):
        """Runs to the end, checks the exit code, returns (stdout, stderr) as text."""
        process = self.start(*arguments, **options)
        out, err = process.communicate(timeout=60)
        self.assertEqual(process.returncode, code, err.decode(errors="replace"))
        self.assertNotIn(b"Sanitizer", err)
        return out.decode(errors="surrogateescape"), err.decode(errors="surrogateescape")

    def assert_only(self, *names):
        """The folder holds just these: no temporary file is left."""
        self.assertEqual(sorted(os.listdir(self.folder)), sorted(names))

    def render_request(self, *arguments):
        """The JSON that a render with these options asks for."""
        self.run_cli("render", self.scene(), "-o", "out.png", "-q", *arguments)
        return self.stub.sent("POST", "/v1/renders")[-1].json()


def main():
    unittest.main(argv=[sys.argv[0], *sys.argv[2:]])
