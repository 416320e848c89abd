# SPDX-License-Identifier: MIT
"""Three daemons behind the HAProxy configuration of docs/how-to/several-servers.md, one killed."""
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile

import support
from support import triangle

support.needs(support.FAKE)
VITRAIL = os.path.join(support.BIN, "vitrail")
support.needs(VITRAIL)
HAPROXY = shutil.which("haproxy", path=os.environ["PATH"] + ":/usr/sbin")
if not HAPROXY:
    print("skipped: haproxy is not installed")
    sys.exit(77)

PAGE = os.path.join(os.path.dirname(os.path.abspath(__file__)),
                    "../../docs/how-to/several-servers.md")
SCENES = 9


class Refused:
    """What a connection that breaks off answers."""
    status, body = 0, b""


class FarmHaproxy(support.unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="vitrail-haproxy-")
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        self.daemons = [support.Daemon() for _ in range(3)]
        for daemon in self.daemons:
            self.addCleanup(daemon.__exit__)
            daemon.wait_ready()
        self.port = support.free_ports(1)[0]
        self.start_proxy()

    def start_proxy(self):
        """The configuration of the page, with the addresses of this test."""
        with open(PAGE, encoding="utf-8") as file:
            text = re.search(r"```haproxy\n(.*?)^```", file.read(), re.S | re.M)[1]
        text = text.replace("bind :8090", f"bind 127.0.0.1:{self.port}")
        for at, daemon in enumerate(self.daemons, 1):
            text = text.replace(f"10.0.0.{at}:8090", f"127.0.0.1:{daemon.port}")
        path = os.path.join(self.folder, "haproxy.cfg")
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)
        with open(os.path.join(self.folder, "log"), "wb") as log:
            self.proxy = subprocess.Popen([HAPROXY, "-db", "-f", path], stdout=log, stderr=log)
        self.addCleanup(self.proxy.wait)
        self.addCleanup(self.proxy.kill)
        support.wait_until(lambda: self.ask("GET", "/readyz").status == 200, "the proxy serves")

    def ask(self, method, path, body=None, headers=None):
        connection = support.http.client.HTTPConnection("127.0.0.1", self.port, timeout=60)
        if isinstance(body, dict):
            body, headers = json.dumps(body), {"Content-Type": "application/json"}
        try:
            connection.request(method, path, body, headers or {})
            return support.Reply(connection.getresponse())
        except OSError:
            return Refused()
        finally:
            connection.close()

    def holders(self, scene):
        return [at for at, daemon in enumerate(self.daemons)
                if daemon.is_alive() and daemon.raw("HEAD", f"/v1/scenes/{scene}").status == 200]

    def upload(self, number):
        reply = self.ask("POST", "/v1/scenes", triangle(f"Scene {number}"),
                         {"Content-Type": "model/gltf-binary"})
        self.assertIn(reply.status, (200, 201), reply.body)
        return reply.json()["id"]

    def render(self, scene):
        return self.ask("POST", "/v1/renders", {"scene": scene, "width": 32, "height": 16})

    def test_scenes_stay_with_their_servers_and_a_killed_one_is_replaced(self):
        scenes = [self.upload(number) for number in range(SCENES)]
        homes = {}
        for scene in scenes:
            [homes[scene]] = self.holders(scene)  # once each
        self.assertEqual({0, 1, 2}, set(homes.values()))
        for _ in range(2):
            self.assertEqual([200] * SCENES, [self.render(scene).status for scene in scenes])
        views = [self.ask("POST", "/v1/views", {"scene": scene}).header("Location")
                 for scene in scenes]
        for view in views:
            self.assertEqual(200, self.ask("GET", view).status, view)
            self.assertEqual(200, self.ask("PATCH", view, {"width": 48}).status)
        job = self.ask("POST", "/v1/jobs", {"scene": scenes[0], "frames": "1-3",
                                            "view": {"width": 32, "height": 16}})
        support.wait_until(
            lambda: self.ask("GET", job.header("Location")).json()["state"] == "done", "the job")

        self.daemons[1].stop(signal.SIGKILL)
        support.wait_until(lambda: self.ask("GET", "/readyz").status == 200, "the proxy serves")
        others = [scene for scene in scenes if homes[scene] != 1]
        support.wait_until(lambda: all(self.render(scene).status == 200 for scene in others),
                           "scenes of the others do not move")
        for scene in others:
            self.assertEqual([homes[scene]], self.holders(scene))
        lost = next(scene for scene in scenes if homes[scene] == 1)
        support.wait_until(lambda: self.render(lost).status == 404, "its scenes are told missing")
        file = os.path.join(self.folder, "lost.glb")
        with open(file, "wb") as out:
            out.write(triangle(f"Scene {scenes.index(lost)}"))
        done = subprocess.run(
            [VITRAIL, "render", file, "-o", os.path.join(self.folder, "lost.png"), "--size",
             "32x16", "--server", f"http://127.0.0.1:{self.port}", "--progress", "none"],
            capture_output=True, text=True, timeout=60, check=False)
        self.assertEqual(0, done.returncode, done.stderr)
        self.assertEqual(1, len(self.holders(lost)))
        self.assertEqual(200, self.render(lost).status)


if __name__ == "__main__":
    support.run_tests()
