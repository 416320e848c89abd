# SPDX-License-Identifier: MIT
"""What the tests of the service share: daemons, requests checked against OpenAPI, scenes."""
import ctypes
import hashlib
import http.client
import importlib
import json
import os
import re
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time
import unittest

BIN = os.path.abspath(sys.argv[1] if len(sys.argv) > 1 else "build/bin")
FAKE = os.path.join(BIN, "vitraild-fake")
START_S = 60
STOP_S = 30


def needs(path):
    """Skips the whole file where a program is not built."""
    if not os.access(path, os.X_OK):
        print(f"skipped: {path} is not there")
        sys.exit(77)


def library_is_strict():
    """libmicrohttpd 1.0 refuses by a page of its own what 0.9 lets through to the server."""
    version = ctypes.CDLL("libmicrohttpd.so.12").MHD_get_version
    version.restype = ctypes.c_char_p
    return not version().startswith(b"0.")


def run_tests():
    unittest.main(argv=[sys.argv[0], *sys.argv[2:]], verbosity=2)


# ---- scenes ----


def glb(document, binary=b"", version=2):
    """A binary glTF around a JSON document (a dict or raw bytes)."""
    text = document if isinstance(document, bytes) else json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    if binary:
        binary += bytes(-len(binary) % 4)
        chunks += struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return b"glTF" + struct.pack("<II", version, 12 + len(chunks)) + chunks


TRIANGLE = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)


def triangle_document(node="Triangle", **more):
    """One triangle, under a node of that name; its buffer has no uri."""
    return {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": node, "mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [
            {
                "bufferView": 0,
                "componentType": 5126,
                "count": 3,
                "type": "VEC3",
                "min": [0, 0, 0],
                "max": [1, 1, 0],
            }
        ],
        "bufferViews": [{"buffer": 0, "byteLength": len(TRIANGLE)}],
        "buffers": [{"byteLength": len(TRIANGLE)}],
        **more,
    }


def triangle(node="Triangle", **more):
    return glb(triangle_document(node, **more), TRIANGLE)


def sha256(content):
    return hashlib.sha256(content).hexdigest()


def multipart(files, boundary="xYzZy", name_from="filename"):
    """Body and Content-Type of a multipart upload of {relative name: bytes}."""
    body = b""
    for index, (name, content) in enumerate(files.items()):
        fields = {"filename": f'name="file{index}"; filename="{name}"', "name": f'name="{name}"'}
        body += (
            (
                f"--{boundary}\r\nContent-Disposition: form-data; {fields[name_from]}\r\n"
                "Content-Type: application/octet-stream\r\n\r\n"
            ).encode()
            + content
            + b"\r\n"
        )
    return body + f"--{boundary}--\r\n".encode(), f"multipart/form-data; boundary={boundary}"


def manifest_id(files):
    """The id of an upload of several files, as docs/reference/http.md defines it."""
    lines = ["vitrail-scene-1\n"]
    for name in sorted(files, key=lambda name: name.encode()):
        lines.append(f"{sha256(files[name])} {len(files[name])} {name}\n")
    return sha256("".join(lines).encode())


# ---- replies against the OpenAPI document ----


class Schemas:
    """As much of JSON Schema 2020-12 as the document uses; an unknown keyword is an error."""

    ANNOTATIONS = {"default", "description", "format", "title", "summary"}
    TYPES = {"object": dict, "array": list, "string": str, "boolean": bool, "null": type(None)}

    def __init__(self, document):
        self.document = document

    def resolve(self, schema):
        while "$ref" in schema:
            target = self.document
            for part in schema["$ref"].removeprefix("#/").split("/"):
                target = target[part]
            schema = target
        return schema

    def is_type(self, value, name):
        if name in ("integer", "number"):
            is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
            return is_number and (name == "number" or value == int(value))
        return isinstance(value, self.TYPES[name])

    def check(self, value, schema, where="$"):
        """Yields what is wrong."""
        schema = self.resolve(schema)
        for keyword, rule in schema.items():
            if keyword in self.ANNOTATIONS or keyword in ("properties", "required", "items"):
                continue
            method = getattr(self, "check_" + keyword, None)
            assert method, f"the checker does not know '{keyword}'"
            yield from method(value, rule, where, schema)
        if isinstance(value, dict):
            for name in schema.get("required", []):
                if name not in value:
                    yield f"{where}: '{name}' is missing"
            for name, of_name in schema.get("properties", {}).items():
                if name in value:
                    yield from self.check(value[name], of_name, f"{where}.{name}")
        if isinstance(value, list) and "items" in schema:
            for index, element in enumerate(value):
                yield from self.check(element, schema["items"], f"{where}[{index}]")

    def check_type(self, value, rule, where, _):
        names = rule if isinstance(rule, list) else [rule]
        if not any(self.is_type(value, name) for name in names):
            yield f"{where}: {value!r} is not {' or '.join(names)}"

    def check_enum(self, value, rule, where, _):
        if value not in rule:
            yield f"{where}: {value!r} is not one of {rule}"

    def check_pattern(self, value, rule, where, _):
        if isinstance(value, str) and not re.search(rule, value):
            yield f"{where}: {value!r} does not match {rule}"

    def check_minimum(self, value, rule, where, _):
        if isinstance(value, (int, float)) and value < rule:
            yield f"{where}: {value} is less than {rule}"

    def check_maximum(self, value, rule, where, _):
        if isinstance(value, (int, float)) and value > rule:
            yield f"{where}: {value} is more than {rule}"

    def check_exclusiveMaximum(self, value, rule, where, _):
        if isinstance(value, (int, float)) and value >= rule:
            yield f"{where}: {value} is not less than {rule}"

    def check_minLength(self, value, rule, where, _):
        if isinstance(value, str) and len(value) < rule:
            yield f"{where}: {len(value)} characters, at least {rule}"

    def check_maxLength(self, value, rule, where, _):
        if isinstance(value, str) and len(value) > rule:
            yield f"{where}: {len(value)} characters, at most {rule}"

    def check_minItems(self, value, rule, where, _):
        if isinstance(value, list) and len(value) < rule:
            yield f"{where}: {len(value)} elements, at least {rule}"

    def check_maxItems(self, value, rule, where, _):
        if isinstance(value, list) and len(value) > rule:
            yield f"{where}: {len(value)} elements, at most {rule}"

    def check_oneOf(self, value, rule, where, _):
        matching = sum(not list(self.check(value, one, where)) for one in rule)
        if matching != 1:
            yield f"{where}: matches {matching} of the alternatives"

    def check_additionalProperties(self, value, rule, where, schema):
        if not isinstance(value, dict) or rule is True:
            return
        for name in set(value) - set(schema.get("properties", {})):
            if rule is False:
                yield f"{where}: '{name}' is not in the schema"
            else:
                yield from self.check(value[name], rule, f"{where}.{name}")


class Api:
    def __init__(self, document):
        self.document = document
        self.schemas = Schemas(document)

    def operation(self, method, path):
        """(template, operation) of a request, or (None, None)."""
        for template, item in self.document["paths"].items():
            pattern = re.sub(r"\{[^}]+\}", "[^/]+", template)
            if re.fullmatch(pattern, path) and method.lower() in item:
                return template, item[method.lower()]
        return None, None

    def faults(self, method, path, reply):
        """What in a reply contradicts the document."""
        media_type = (reply.header("Content-Type") or "").split(";")[0]
        _, operation = self.operation("GET" if method == "HEAD" else method, path.split("?")[0])
        if (
            operation is None
        ):  # a route or method that does not exist is answered by a problem, or by OPTIONS
            if reply.status not in (204, 404, 405):
                return [f"status {reply.status} of an operation that is not in the document"]
            content = {
                "application/problem+json": {"schema": {"$ref": "#/components/schemas/Problem"}}
            }
            headers = {"X-Request-Id": {}}
        else:
            responses = operation["responses"]
            response = responses.get(str(reply.status), responses["default"])
            response = self.schemas.resolve(response)
            if str(reply.status) not in responses and reply.status < 400:
                return [f"status {reply.status} is not in the document"]
            content, headers = response.get("content", {}), response.get("headers", {})
        found = [
            f"no {name} header"
            for name, header in headers.items()
            if reply.header(name) is None and header.get("required", True)
        ]
        if method == "HEAD" or not reply.body:
            return found + (["no body"] if content and method not in ("HEAD", "OPTIONS") else [])
        if media_type not in content:
            return found + [f"media type {media_type!r} is not one of {list(content)}"]
        if media_type.endswith("json"):
            found += self.schemas.check(reply.json(), content[media_type]["schema"])
        if media_type == "application/problem+json":
            problem = reply.json()
            if problem.get("status") != reply.status:
                found.append(
                    f"problem says {problem.get('status')}, the status line {reply.status}"
                )
            if problem.get("request_id") != reply.header("X-Request-Id"):
                found.append("the problem names another request")
        return found


class Reply:
    def __init__(self, response):
        self.status = response.status
        self.headers = response.getheaders()
        self.body = response.read()

    def header(self, name):
        values = [value for key, value in self.headers if key.lower() == name.lower()]
        return values[0] if values else None

    def json(self):
        return json.loads(self.body)

    @property
    def code(self):
        """Of a problem, else None."""
        is_problem = (self.header("Content-Type") or "") == "application/problem+json"
        return self.json()["code"] if is_problem else None


# ---- the daemon ----


class Daemon:
    """A vitraild on a port of its own. Leaves nothing behind."""

    def __init__(self, *flags, program=FAKE, state_dir=None, environment=None, warms_up=False):
        self.folder = tempfile.TemporaryDirectory(prefix="vitrail-test-")
        self.state_dir = state_dir or os.path.join(self.folder.name, "state")
        self.log_path = os.path.join(self.folder.name, "log")
        clean = {key: value for key, value in os.environ.items() if not key.startswith("VITRAIL_")}
        changed = {**clean, **(environment or {})}  # None takes a variable away
        with open(self.log_path, "wb") as log:
            self.process = subprocess.Popen(
                [program, "--listen", "127.0.0.1:0", "--state-dir", self.state_dir,
                 *([] if warms_up else ["--no-warm-up"]), *flags],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=log,
                env={key: value for key, value in changed.items() if value is not None},
            )
        line = self.process.stdout.readline().decode()
        match = re.fullmatch(r"listening on http://127\.0\.0\.1:(\d+)\n", line)
        if not match:
            self.process.wait(STOP_S)
            raise RuntimeError(f"the daemon said {line!r}; its log: {self.log()}")
        self.port = int(match.group(1))
        self.api = None
        self.api = Api(self.request("GET", "/openapi.json").json())

    def log(self):
        with open(self.log_path, encoding="utf-8", errors="replace") as log:
            return log.read()

    def raw(self, method, path, body=None, headers=None, timeout=120):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=timeout)
        try:
            connection.request(method, path, body, headers or {})
            return Reply(connection.getresponse())
        finally:
            connection.close()

    def request(self, method, path, body=None, headers=None, timeout=120):
        """A request whose reply must be as the OpenAPI document says."""
        if isinstance(body, (dict, list)):
            body = json.dumps(body)
            headers = {"Content-Type": "application/json", **(headers or {})}
        reply = self.raw(method, path, body, headers, timeout)
        faults = self.api.faults(method, path, reply) if self.api else []
        assert (
            not faults
        ), f"{method} {path} answered {reply.status}: {faults}; {reply.body[:400]!r}"
        return reply

    def wait_ready(self, timeout_s=START_S):
        wait_until(
            lambda: self.raw("GET", "/readyz").status == 200, "the daemon is ready", timeout_s
        )
        return self

    def wait_device(self):
        """Until it has a device; a test that has none is skipped as a whole."""
        wait_until(
            lambda: self.raw("GET", "/readyz").code != "overloaded", "a device or none", 180
        )
        reply = self.raw("GET", "/readyz")
        if reply.status != 200:
            print("skipped:", reply.json()["detail"])
            with self:
                self.stop()
            sys.exit(77)
        return self

    def post_scene(self, content, media_type="model/gltf-binary", query=""):
        return self.request("POST", "/v1/scenes" + query, content, {"Content-Type": media_type})

    def push(self, content):
        """Posts a GLB that must be taken; returns its id."""
        reply = self.post_scene(content)
        assert reply.status in (200, 201), reply.body
        return reply.json()["id"]

    def render(self, scene, headers=None, timeout=120, **members):
        body = {"scene": scene, "width": 32, "height": 16, **members}
        return self.request("POST", "/v1/renders", body, headers, timeout)

    def stats(self):
        return self.request("GET", "/v1/stats").json()

    def worker_pid(self):
        wait_until(lambda: self.stats()["worker"]["ready"], "a worker is ready", START_S)
        return self.stats()["worker"]["pid"]

    def is_alive(self):
        return self.process.poll() is None

    def stop(self, how=signal.SIGTERM):
        """Ends the daemon; returns its exit status."""
        if self.is_alive():
            self.process.send_signal(how)
        try:
            status = self.process.wait(STOP_S)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
            raise
        finally:
            self.process.stdout.close()
        return status

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.stdout and not self.process.stdout.closed:
            self.stop()
        self.folder.cleanup()


def provenance(data):
    """What an image file says of its making, as the Python client reads it."""
    folder = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../clients/python")
    if folder not in sys.path:
        sys.path.insert(0, folder)
        sys.dont_write_bytecode = True
    return importlib.import_module("vitrail").provenance(data)


def free_ports(count):
    """Ports of this machine that nobody listens on, each another."""
    sockets = [socket.socket() for _ in range(count)]
    for each in sockets:
        each.bind(("127.0.0.1", 0))
    ports = [each.getsockname()[1] for each in sockets]
    for each in sockets:
        each.close()
    return ports


def wait_until(is_true, what, timeout_s=20):
    deadline = time.monotonic() + timeout_s
    while not is_true():
        if time.monotonic() > deadline:
            raise AssertionError(f"not within {timeout_s} s: {what}")
        time.sleep(0.02)


def talk(port, text, timeout=10, shut=False):
    """Sends bytes as they are; returns all that comes back until the peer closes or time is up."""
    with socket.create_connection(("127.0.0.1", port), timeout=timeout) as peer:
        peer.sendall(text)
        if shut:
            peer.shutdown(socket.SHUT_WR)
        answer = b""
        try:
            while piece := peer.recv(65536):
                answer += piece
        except (TimeoutError, ConnectionResetError):
            pass
        return answer


class ServiceTest(unittest.TestCase):
    """Tests that share one daemon; each leaves it able to serve the next request."""

    flags = ()

    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon(*cls.flags).wait_ready()

    @classmethod
    def tearDownClass(cls):
        with cls.daemon:
            status = cls.daemon.stop()
        assert status == 0, f"the daemon ended with {status}: {cls.daemon.log_path}"

    def assert_serves(self):
        """The daemon is up and takes the next render."""
        self.assertTrue(self.daemon.is_alive(), "the daemon died")
        scene = self.daemon.push(triangle())
        self.assertEqual(200, self.daemon.render(scene).status)
