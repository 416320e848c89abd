# SPDX-License-Identifier: MIT
"""Assemblies of many nodes that share meshes: read with progress, listed, traced in little memory.

VITRAIL_EXTREMES=full: 100,000 nodes, and 12 million triangles of which no mesh has another's."""
import concurrent.futures
import json
import os
import subprocess
import sys
import time

import support

REAL = os.path.join(support.BIN, "vitraild")
VITRAIL = os.path.join(support.BIN, "vitrail")
support.needs(REAL)
support.needs(VITRAIL)
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "bench"))
from assembly import GROUP, write_assembly  # noqa: E402

IS_FULL = os.environ.get("VITRAIL_EXTREMES") == "full"
LIGHT = {"type": "directional", "direction": [-0.4, -1, -0.3], "intensity": 3}


def peak_bytes(pid):
    with open(f"/proc/{pid}/status", encoding="ascii") as status:
        return 1024 * int(next(line.split()[1] for line in status if line.startswith("VmHWM")))


class LargeAssemblies(support.ServiceTest):
    @classmethod
    def setUpClass(cls):
        cls.daemon = support.Daemon(program=REAL)

    def setUp(self):
        self.pool = concurrent.futures.ThreadPoolExecutor(1)
        self.addCleanup(self.pool.shutdown)

    def write(self, nodes, meshes, triangles):
        path = os.path.join(self.daemon.folder.name, f"{nodes}-{triangles}.glb")
        return path, write_assembly(path, nodes, meshes, triangles)

    def push(self, path, request_id):
        """The reply to the upload, and what was told while it was read."""
        with open(path, "rb") as file:
            content = file.read()
        headers = {"Content-Type": "model/gltf-binary", "X-Request-Id": request_id}
        reply = self.pool.submit(self.daemon.request, "POST", "/v1/scenes", content, headers, 900)
        told = []
        while not reply.done():
            status = self.daemon.request("GET", f"/v1/uploads/{request_id}")
            if status.status == 200:
                told.append(status.json())
            time.sleep(0.02)
        self.assertEqual(201, reply.result().status, reply.result().body[:400])
        return reply.result().json(), told

    def check(self, nodes, meshes, triangles, worker_bytes):
        path, of_meshes = self.write(nodes, meshes, triangles)
        began = time.monotonic()
        summary, told = self.push(path, f"assembly-{nodes}")
        read_s = time.monotonic() - began
        stages = [status["progress"]["stage"] for status in told if "progress" in status]
        order = ["file", "meshes", "nodes", "outline"]
        self.assertEqual(sorted(stages, key=order.index), stages)
        self.assertLessEqual({"file", "outline"}, set(stages))
        for stage in order:
            shares = [status["progress"]["share"] for status in told
                      if status.get("progress", {}).get("stage") == stage]
            self.assertEqual(sorted(shares), shares)
        groups = -(-nodes // GROUP) + 1
        self.assertEqual(nodes + groups, summary["nodes"])
        self.assertEqual(of_meshes // meshes * nodes, summary["triangles"])
        path_of = f"/v1/scenes/{summary['id']}/outline"
        outline = self.daemon.request("GET", path_of, timeout=900).json()
        self.assertEqual(nodes + groups, len(outline["nodes"]))
        self.assertEqual(f"Part {nodes - 1}", outline["nodes"][-1]["name"])
        began = time.monotonic()
        reply = self.daemon.render(summary["id"], timeout=900, width=160, height=90,
                                   lights=[LIGHT], quality={"shadows": "raytraced"})
        self.assertEqual(200, reply.status, reply.body[:400])
        peak = peak_bytes(self.daemon.worker_pid())
        print(f"{nodes} nodes, {summary['triangles']} triangles of {of_meshes}: read in "
              f"{read_s:.1f} s, first image in {time.monotonic() - began:.1f} s, worker's peak "
              f"{peak / 1e6:.0f} MB", file=sys.stderr)
        self.assertLess(peak, worker_bytes)
        return path

    def test_nodes_that_share_meshes_take_memory_once(self):
        path = self.check(20_000, 200, 240_000, 1.2e9)  # as triangles of their own they took 3 GB
        self.assert_the_client_tells(path)
        if IS_FULL:
            self.check(100_000, 200, 120_000, 2e9)

    def test_many_triangles_are_read_and_traced(self):
        if not IS_FULL:
            self.skipTest("VITRAIL_EXTREMES=full draws twelve million triangles")
        self.check(200, 200, 12_000_000, 8e9)
        self.check(100_000, 200, 12_000_000, 8e9)

    def assert_the_client_tells(self, path):
        server = f"http://127.0.0.1:{self.daemon.port}"
        done = subprocess.run([VITRAIL, "push", "--force", "--progress", "json", "--scene", "#0",
                               "--server", server, path],
                              capture_output=True, timeout=900, check=True)
        lines = [json.loads(line) for line in done.stderr.decode().splitlines()
                 if line.startswith("{")]
        self.assertIn("uploading", {line["stage"] for line in lines})
        read = [line for line in lines if line["stage"] == "reading scene" and "pass" in line]
        self.assertTrue(read, lines)
        self.assertLessEqual({line["pass"] for line in read},
                             {"file", "meshes", "nodes", "outline"})
        self.assertEqual({"decoding"}, {line["state"] for line in read})

    def test_what_is_not_being_read_is_404(self):
        reply = self.daemon.request("GET", "/v1/uploads/nobody")
        self.assertEqual((404, "not_found"), (reply.status, reply.code))
        self.assertIn("'nobody'", reply.json()["detail"])
        self.assertEqual(404, self.daemon.raw("GET", "/v1/uploads/" + "x" * 100).status)


if __name__ == "__main__":
    support.run_tests()
