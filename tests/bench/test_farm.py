# SPDX-License-Identifier: MIT
"""`vitrail-bench farm` runs and states all that it measures, of a scene that costs little."""
import json
import pathlib
import struct
import subprocess
import sys
import tempfile
import unittest

PROGRAM = pathlib.Path(sys.argv.pop(1)) / "vitrail-bench"


def triangle():
    """A GLB of one triangle."""
    binary = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)
    text = json.dumps({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "buffers": [{"byteLength": len(binary)}],
        "bufferViews": [{"buffer": 0, "byteLength": len(binary)}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
                       "min": [0, 0, 0], "max": [1, 1, 0]}]}).encode()
    text += b" " * (-len(text) % 4)
    return (struct.pack("<4sII", b"glTF", 2, 28 + len(text) + len(binary)) +
            struct.pack("<I4s", len(text), b"JSON") + text +
            struct.pack("<I4s", len(binary), b"BIN\0") + binary)


class Farm(unittest.TestCase):
    def test_films_are_measured_as_a_job_and_as_processes(self):
        with tempfile.TemporaryDirectory() as folder:
            scene = pathlib.Path(folder) / "scene.glb"
            scene.write_bytes(triangle())
            done = subprocess.run(
                [str(PROGRAM), "farm", str(scene), "--quick", "--json", "--size", "64x36"],
                capture_output=True, text=True, check=False, timeout=600)
        self.assertEqual(0, done.returncode, done.stderr)
        document = json.loads(done.stdout)
        for how in ("job", "process", "kept"):
            self.assertGreater(document[how]["wall_s"], 0)
            self.assertGreater(document[how]["cpu_s"], 0)
        self.assertGreater(document["job"]["frame_ms"], 0)
        self.assertGreater(document["job"]["machinery_cpu_ms"], 0)
        self.assertGreater(document["job"]["loading_s"], 0)
        self.assertTrue(0 < document["job"]["loading_share"] < 1)
        for beside in ("alone", "beside_a_job"):
            for kind in ("urgent", "default"):
                found = document["latency"][beside][kind]
                self.assertEqual(8, found["count"])
                self.assertLess(0, found["p50_ms"])
                self.assertLessEqual(found["p50_ms"], found["p95_ms"])
        workers = document["workers"]
        self.assertAlmostEqual(workers["one_s"] / workers["two_s"], workers["ratio"])


if __name__ == "__main__":
    unittest.main()
