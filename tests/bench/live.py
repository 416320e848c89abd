#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Measures live views over loopback: camera to image, frames per second, memory; the same beside
a client that reads slowly, one that looks closely, and one that renders large images.

usage: live.py BIN [SCENE.glb] [--size WxH] [--seconds S] [--budget-ms MS] [--quick] [--json]

`vitrail-bench live` runs this. SCENE: the demo scene where it is not given. --budget-ms: of a
moving frame, in the place of the default of views. --quick: a few frames, to see that everything
runs.

Starts a vitraild of its own. Each viewer is a thread with a WebSocket to a view of its own, which
sends a camera, waits for the frame that shows it, and sends the next: the time between is the
latency. The clients run in this process, so their share of the processor is in all numbers.
"""
import argparse
import http.client
import json
import math
import os
import statistics
import subprocess
import sys
import tempfile
import threading
import time

from daemon import Daemon

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "http"))
WANTED = argparse.ArgumentParser(description="live views over loopback")
WANTED.add_argument("bin")
WANTED.add_argument("scene", nargs="?")
WANTED.add_argument("--size", default="640x360")
WANTED.add_argument("--seconds", type=float, default=5)
WANTED.add_argument("--budget-ms", type=float)
WANTED.add_argument("--quick", action="store_true")
WANTED.add_argument("--json", action="store_true")


def import_sockets():
    from sockets import WebSocket
    return WebSocket


class Server(Daemon):
    def __init__(self, binaries):
        self.folder = tempfile.TemporaryDirectory()
        super().__init__(binaries, self.folder.name)

    def resident_kib(self):
        with open(f"/proc/{self.process.pid}/statm", encoding="ascii") as statm:
            return int(statm.read().split()[1]) * os.sysconf("SC_PAGESIZE") // 1024

    def stop(self):
        super().stop()
        self.folder.cleanup()


def camera(turn, radius):
    return {"eye": [radius * math.sin(turn), 0.4 * radius, radius * math.cos(turn)],
            "target": [0, 0.3 * radius, 0]}


class Viewer(threading.Thread):
    def __init__(self, server, view, phase, seconds):
        super().__init__()
        self.server, self.view, self.phase, self.seconds = server, view, phase, seconds
        self.latencies_ms, self.scales, self.parts_ms = [], [], []

    def run(self):
        socket_type = import_sockets()
        with socket_type(self.server.port, f"/v1/views/{self.view}/socket", timeout=120) as client:
            client.until_type("hello")
            until, seq = time.monotonic() + self.seconds, 0
            while time.monotonic() < until:
                seq += 1
                began = time.monotonic()
                client.send(type="camera", seq=seq, camera=camera(self.phase + 0.05 * seq, 6))
                frame = client.until_type("frame", seq=seq)
                self.latencies_ms.append(1e3 * (time.monotonic() - began))
                self.scales.append(frame["scale"])
                self.parts_ms.append(parts_of(frame["timings_ms"], self.latencies_ms[-1]))


def parts_of(timings_ms, latency_ms):
    """What the server says of a frame, and what is left: its socket, the way, and the client."""
    parts = {name: ms or 0 for name, ms in timings_ms.items() if name != "total"}
    return {**parts, "socket": latency_ms - timings_ms["total"]}


def mean_parts(threads):
    """By part, over all frames, so that they add up to the mean of camera to image."""
    frames = [parts for thread in threads for parts in thread.parts_ms]
    names = sorted({name for parts in frames for name in parts})
    means = {name: sum(parts.get(name, 0) for parts in frames) / len(frames) for name in names}
    return {name: round(mean, 2) for name, mean in means.items()}


class Resting(threading.Thread):
    """Moves, waits for the exact frame, and moves again: somebody who looks closely."""

    def __init__(self, server, view, until):
        super().__init__()
        self.server, self.view, self.until = server, view, until
        self.latencies_ms, self.times_ms = [], []

    def run(self):
        socket_type = import_sockets()
        with socket_type(self.server.port, f"/v1/views/{self.view}/socket", timeout=120) as client:
            seq = 0
            while time.monotonic() < self.until:
                seq += 1
                began = time.monotonic()
                client.send(type="camera", seq=seq, camera=camera(0.3 * seq, 6))
                client.until_type("frame", seq=seq)
                self.latencies_ms.append(1e3 * (time.monotonic() - began))
                client.until_type("frame", seq=seq, exact=True)
                self.times_ms.append(1e3 * (time.monotonic() - began))


class Rendering(threading.Thread):
    """Asks for one large image after another: nine times the pixels of a view."""

    def __init__(self, server, scene, size, until):
        super().__init__()
        self.server, self.until, self.times_ms = server, until, []
        self.body = {"scene": scene, "width": 3 * size[0], "height": 3 * size[1]}

    def run(self):
        while time.monotonic() < self.until:
            began = time.monotonic()
            camera_now = camera(0.1 * len(self.times_ms), 6)
            body = json.dumps({**self.body, "camera": camera_now}).encode()
            self.server.ask("/v1/renders", body)
            self.times_ms.append(1e3 * (time.monotonic() - began))


class Slow(threading.Thread):
    """Watches a view's multipart stream at 64 KiB/s while its camera turns."""

    def __init__(self, server, view):
        super().__init__(daemon=True)
        self.server, self.view, self.is_over = server, view, False

    def run(self):
        import socket
        with socket.create_connection(("127.0.0.1", self.server.port)) as peer:
            path = f"/v1/views/{self.view}/stream"
            peer.sendall(f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n".encode())
            while not self.is_over and peer.recv(6554):
                time.sleep(0.1)


def start_beside(beside, server, scene, size, view, seconds):
    """A thread that does so until then; None for nothing."""
    until = time.monotonic() + seconds
    thread = {"": lambda: None, "slow": lambda: Slow(server, view),
              "rest": lambda: Resting(server, view, until),
              "render": lambda: Rendering(server, scene, size, until)}[beside]()
    if thread:
        thread.start()
    return thread


def measure(server, scene, arguments, viewers, seconds, beside=""):
    size = tuple(int(side) for side in arguments.size.split("x"))
    body = {"scene": scene, "width": size[0], "height": size[1], "camera": camera(0, 6)}
    if arguments.budget_ms:
        body["stream"] = {"budget_ms": arguments.budget_ms}
    views = [server.ask_json("/v1/views", body)["id"] for _ in range(viewers + 1)]
    before = server.resident_kib()
    other = start_beside(beside, server, scene, size, views[-1], seconds)
    threads = [Viewer(server, views[i], i, seconds) for i in range(viewers)]
    for thread in threads:
        thread.start()
    time.sleep(0.8 * seconds)
    during = server.resident_kib()
    for thread in threads:
        thread.join()
    if other:
        other.is_over = True
        other.join(120)
    for view in views:
        server.ask(f"/v1/views/{view}", method="DELETE")
    latencies = sorted(x for thread in threads for x in thread.latencies_ms)
    times = getattr(other, "times_ms", [])
    return {"viewers": viewers, "beside": beside, "frames": len(latencies),
            "p50_ms": round(statistics.median(latencies), 1),
            "p95_ms": round(latencies[int(0.95 * (len(latencies) - 1))], 1),
            "most_ms": round(latencies[-1], 1),
            "mean_parts_ms": mean_parts(threads),
            "frames_per_s": round(len(latencies) / seconds, 1),
            "scale": statistics.median(x for thread in threads for x in thread.scales),
            "kib_per_viewer": round((during - before) / viewers),
            "beside_frames": len(times),
            "beside_p50_ms": round(statistics.median(times), 1) if times else None}


def patch_times(server):
    """Milliseconds of the front for a one-node patch of an assembly of 10,000 nodes, on one
    connection that stays, as that of a page does."""
    side, nodes = 100, []
    for i in range(side * side):
        nodes.append({"name": f"n{i}", "mesh": 0, "translation": [i % side, 0, i // side]})
    import support
    document = support.triangle_document()
    document["nodes"], document["scenes"] = nodes, [{"nodes": list(range(len(nodes)))}]
    content = support.glb(document, support.TRIANGLE)
    scene = json.loads(server.ask("/v1/scenes", content, "model/gltf-binary")[1])["id"]
    view = server.ask_json("/v1/views", {
        "scene": scene, "width": 320, "height": 180, "camera": {"fit": "iso"},
        "lights": [{"type": "directional", "direction": [0, -1, 0.2]}]})["id"]
    server.ask(f"/v1/views/{view}/image")
    times, connection = [], http.client.HTTPConnection("127.0.0.1", server.port)
    for i in range(200):
        matrix = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, i % 7, 0.5, 0, 1]
        patch = {"overrides": {"nodes": {f"n{i}": {"matrix": matrix}}}}
        began = time.monotonic()
        connection.request("PATCH", f"/v1/views/{view}", json.dumps(patch),
                           {"Content-Type": "application/json"})
        reply = connection.getresponse()
        reply.read()
        times.append(1e3 * (time.monotonic() - began))
        assert reply.status == 200, reply.status
    connection.close()
    times.sort()
    return {"patch_p50_ms": round(times[100], 2), "patch_p95_ms": round(times[190], 2)}


CASES = [(1, ""), (4, ""), (16, ""), (4, "slow"), (4, ""), (4, "slow"), (4, ""), (4, "rest"),
         (4, "render"), (1, ""), (1, "rest"), (1, "render")]
QUICK = [(1, ""), (2, "slow"), (1, "rest"), (1, "render")]


def read_scene(path, binaries):
    """(name, bytes) of the scene file, or of the demo scene."""
    if path:
        with open(path, "rb") as file:
            return os.path.basename(path), file.read()
    with tempfile.TemporaryDirectory() as folder:
        made = os.path.join(folder, "demo.glb")
        subprocess.run([os.path.join(binaries, "vitrail"), "demo-scene", "-o", made], check=True,
                       stdout=subprocess.DEVNULL)
        return read_scene(made, binaries)


def run(arguments):
    seconds = 0.5 if arguments.quick else arguments.seconds
    name, content = read_scene(arguments.scene, arguments.bin)
    server = Server(arguments.bin)
    try:
        scene = json.loads(server.ask("/v1/scenes", content, "model/gltf-binary")[1])["id"]
        measure(server, scene, arguments, 1, min(seconds, 2), "rest")  # compiles the shaders
        rows = [measure(server, scene, arguments, viewers, seconds, beside)
                for viewers, beside in (QUICK if arguments.quick else CASES)]
        return {"scene": name, "size": arguments.size,
                "device": server.ask_json("/v1/capabilities")["device"]["renderer"],
                "viewers": rows, **patch_times(server)}
    finally:
        server.stop()


def main():
    arguments = WANTED.parse_args()
    result = run(arguments)
    if arguments.json:
        print(json.dumps(result))
        return
    print(f"{result['scene']}, {result['size']}, {result['device']}")
    for row in result["viewers"]:
        times = (f"  {row['beside_frames']} of its own, p50 {row['beside_p50_ms']} ms"
                 if row["beside_frames"] else "")
        print(f"{row['viewers']:3} viewers{' + ' + row['beside'] if row['beside'] else '':9}: "
              f"p50 {row['p50_ms']:7} ms  p95 {row['p95_ms']:7} ms  most {row['most_ms']:7} ms  "
              f"{row['frames_per_s']:5} /s  scale {row['scale']}  "
              f"{row['kib_per_viewer']} KiB per viewer{times}")
        print("     of a frame: " +
              ", ".join(f"{name} {ms}" for name, ms in row["mean_parts_ms"].items() if ms >= 0.01))
    print(f"patch of one node of 10,000: p50 {result['patch_p50_ms']} ms, "
          f"p95 {result['patch_p95_ms']} ms, HTTP included")


if __name__ == "__main__":
    main()
