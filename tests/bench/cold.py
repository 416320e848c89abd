#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Measures cold starts: from starting the daemon to the first image of a scene with many lights.

usage: cold.py BIN SCENE.glb [--size WxH] [--lights N] [--pause S] [--json]

Each start is a vitraild of its own over one state directory. The first finds it empty: the scene is
posted, and shader caches fill. `cpu` is the processor time of daemon and worker up to the first
image. Later ones find scene and caches; the page cache of the system is
warm in all. `--pause` waits between readiness and the first request, as a viewer does that a person
opens.
"""
import argparse
import json
import math
import os
import tempfile
import time

from daemon import Daemon

WANTED = argparse.ArgumentParser(description="cold starts of the daemon")
WANTED.add_argument("bin")
WANTED.add_argument("scene")
WANTED.add_argument("--size", default="640x480")
WANTED.add_argument("--lights", type=int, default=250)
WANTED.add_argument("--pause", type=float, default=0)
WANTED.add_argument("--shadows", default="none")
WANTED.add_argument("--json", action="store_true")


def spots(count):
    """Spots in a spiral above a scene that is a few metres wide."""
    lights = []
    for i in range(count):
        turn, radius = 2.39996 * i, 2.5 * math.sqrt((i + 0.5) / count)
        lights.append({"type": "spot", "direction": [0, -1, 0], "intensity": 3, "range": 3,
                       "position": [radius * math.cos(turn), 1.5, radius * math.sin(turn)],
                       "outer_cone_deg": 30})
    return lights


class Cold(Daemon):
    def __init__(self, binaries, state_dir):
        super().__init__(binaries, state_dir)
        self.ready_cpu_s = self.cpu_s()

    def cpu_s(self):
        """Processor time of the daemon and its worker so far."""
        ticks = 0
        for pid in os.listdir("/proc"):
            try:
                with open(f"/proc/{int(pid)}/stat", encoding="ascii", errors="replace") as stat:
                    fields = stat.read().rsplit(")", 1)[1].split()
            except (ValueError, OSError):
                continue
            if self.process.pid in (int(pid), int(fields[1])):
                ticks += int(fields[11]) + int(fields[12])
        return ticks / os.sysconf("SC_CLK_TCK")


def render(daemon, body):
    begin = time.monotonic()
    headers, _ = daemon.ask("/v1/renders", json.dumps(body).encode())
    seconds = time.monotonic() - begin
    link = headers["Link"]
    stats = json.loads(daemon.ask(link[1:link.index(">")])[1])
    return seconds, stats["counts"]


def start_once(wanted, state_dir, scene):
    """scene: bytes to post, or the id of one that is there."""
    daemon = Cold(wanted.bin, state_dir)
    try:
        posted_s = 0.0
        if isinstance(scene, bytes):
            begin = time.monotonic()
            scene = json.loads(daemon.ask("/v1/scenes", scene, "model/gltf-binary")[1])["id"]
            posted_s = time.monotonic() - begin
        time.sleep(wanted.pause)
        width, height = (int(side) for side in wanted.size.split("x"))
        body = {"scene": scene, "width": width, "height": height, "lights": spots(wanted.lights),
                "quality": {"shadows": wanted.shadows}}
        first_s, counts = render(daemon, body)
        cpu_s = daemon.cpu_s()
        total_s = time.monotonic() - daemon.began - wanted.pause
        body["camera"] = {"fit": "iso"}
        second_s, _ = render(daemon, body)
    finally:
        daemon.stop()
    return scene, {"ready_s": daemon.ready_s, "post_s": posted_s, "first_s": first_s,
                   "start_to_image_s": total_s, "cpu_s": cpu_s,
                   "ready_cpu_s": daemon.ready_cpu_s, "second_s": second_s,
                   "programs_built": counts["programs_built"],
                   "programs_reused": counts["programs_reused"]}


def main():
    wanted = WANTED.parse_args()
    with open(wanted.scene, "rb") as stream:
        scene = stream.read()
    rows = []
    with tempfile.TemporaryDirectory() as state_dir:
        for name in ("empty state", "second start", "third start"):
            scene, row = start_once(wanted, state_dir, scene)
            rows.append({"start": name, **row})
    if wanted.json:
        for row in rows:
            print(json.dumps(row))
        return
    columns = ("ready_s", "post_s", "first_s", "start_to_image_s", "cpu_s", "second_s")
    print("start         " + " ".join(f"{name:>16}" for name in columns) + "  programs")
    for row in rows:
        print(f"{row['start']:14}" + " ".join(f"{row[name]:16.2f}" for name in columns) +
              f"  {row['programs_built']} built, {row['programs_reused']} reused")


if __name__ == "__main__":
    main()
