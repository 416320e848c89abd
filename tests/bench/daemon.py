# SPDX-License-Identifier: MIT
"""A vitraild of its own for measurements over HTTP."""
import json
import os
import pathlib
import subprocess
import time
import urllib.error
import urllib.request

READY_TIMEOUT_S = 180
REPLY_TIMEOUT_S = 600


class Daemon:
    """began, ready_s: when it was started [monotonic s], and how long it took to be ready."""

    def __init__(self, binaries, state_dir, *flags, poll_s=0.02):
        environment = {name: value for name, value in os.environ.items()
                       if name != "MESA_SHADER_CACHE_DIR" and not name.startswith("VITRAIL_")}
        self.began = time.monotonic()
        self.process = subprocess.Popen(
            [os.path.join(binaries, "vitraild"), "--listen", "127.0.0.1:0", "--state-dir",
             state_dir, "--log-level", "error", *flags], stdout=subprocess.PIPE, text=True,
            env=environment)
        self.port = int(self.process.stdout.readline().rsplit(":", 1)[1])
        while not self.is_ready():
            if time.monotonic() > self.began + READY_TIMEOUT_S:
                raise SystemExit("the daemon does not become ready")
            time.sleep(poll_s)
        self.ready_s = time.monotonic() - self.began

    def ask(self, path, body=None, media_type="application/json", method=None, priority=None):
        """(headers, body) of the reply."""
        headers = {"Content-Type": media_type, **({"Priority": priority} if priority else {})}
        request = urllib.request.Request(f"http://127.0.0.1:{self.port}{path}", body, headers,
                                         method=method)
        with urllib.request.urlopen(request, timeout=REPLY_TIMEOUT_S) as reply:
            return reply.headers, reply.read()

    def ask_json(self, path, body=None, method=None):
        return json.loads(self.ask(path, json.dumps(body).encode() if body else None,
                                   method=method)[1])

    def is_ready(self):
        try:
            self.ask("/readyz")
            return True
        except urllib.error.HTTPError:
            return False

    def cpu_ms(self):
        """Processor time of the server's own process, without its workers."""
        used = 0
        for task in pathlib.Path(f"/proc/{self.process.pid}/task").iterdir():
            try:
                used += int((task / "schedstat").read_text().split()[0])
            except OSError:
                pass  # a thread that ended meanwhile
        return used / 1e6

    def stop(self):
        self.process.terminate()
        self.process.wait(60)
        self.process.stdout.close()
