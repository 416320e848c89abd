# SPDX-License-Identifier: MIT
"""The command line against a daemon on the test double: what its tests share."""
import os
import subprocess
import tempfile

import support
from support import triangle

support.needs(support.FAKE)
VITRAIL = os.path.join(support.BIN, "vitrail")
support.needs(VITRAIL)


class CliServiceTest(support.ServiceTest):
    """Each test has a folder of its own with a scene in it."""

    command = ()  # begins every call
    make_scene = staticmethod(triangle)

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        self.scene = self.path("scene.glb")
        with open(self.scene, "wb") as file:
            file.write(self.make_scene())

    def path(self, name):
        return os.path.join(self.folder, name)

    @property
    def url(self):
        return f"http://127.0.0.1:{self.daemon.port}"

    def run_cli(self, *arguments, code=0, environment=None, progress="none"):
        """What it printed; where it has to fail, what it said why. stderr, stdout: both."""
        done = subprocess.run(
            [VITRAIL, *self.command, *arguments, "--server", self.url, "--progress", progress],
            capture_output=True, text=True, timeout=60, check=False,
            env={**os.environ, **(environment or {})})
        self.assertEqual(code, done.returncode, (arguments, done.stderr, done.stdout))
        self.stdout, self.stderr = done.stdout, done.stderr
        return done.stdout if code == 0 else done.stderr
