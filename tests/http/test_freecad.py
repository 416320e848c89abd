# SPDX-License-Identifier: MIT
"""The workbench for FreeCAD, run by freecadcmd against the daemon: tests/http/freecad_cases.py."""
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

import support

REAL = os.path.join(support.BIN, "vitraild")
CASES = os.path.join(os.path.dirname(os.path.abspath(__file__)), "freecad_cases.py")
FREECAD = shutil.which("freecadcmd") or shutil.which("FreeCADCmd")
PICTURES = os.path.join(support.BIN, "..", "freecad")  # to be looked at
SECONDS = 600


class Workbench(unittest.TestCase):
    def test_all_cases_pass_inside_freecad(self):
        os.makedirs(PICTURES, exist_ok=True)
        with support.Daemon(program=REAL) as daemon, tempfile.TemporaryDirectory() as home:
            daemon.wait_device().wait_ready()
            environment = {**os.environ, "VITRAIL_URL": f"http://127.0.0.1:{daemon.port}",
                           "VITRAIL_PICTURES": PICTURES, "HOME": home, "XDG_CONFIG_HOME": home,
                           "XDG_DATA_HOME": home, "PYTHONDONTWRITEBYTECODE": "1"}
            done = subprocess.run([FREECAD, CASES], env=environment, stdin=subprocess.DEVNULL,
                                  capture_output=True, text=True, timeout=SECONDS, check=False)
        print(re.sub(r"Recompute\.+|\t+\([0-9]+ %\)\t*\n?|^\s*\n", "", done.stderr, flags=re.M))
        self.assertEqual(0, done.returncode, done.stdout[-4000:])
        self.assertIn("cases of the workbench passed", done.stdout)


if __name__ == "__main__":
    support.needs(REAL)
    if FREECAD is None:
        print("skipped: freecadcmd is not installed")
        sys.exit(77)
    support.run_tests()
