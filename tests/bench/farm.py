#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Measures films: the frames of an animated scene as one job of a server, and as a process each.

usage: farm.py BIN [SCENE.glb] [--size WxH] [--frames N] [--processes N] [--rounds N] [--quick]
       [--json]

Without a SCENE the demo scene turns about its vertical axis. `job` is one daemon, from its start to
its end, with one job of N frames. `process` is `vitrail render --spawn` for each of some frames,
which begins with nothing; `kept` is the same over a state directory that keeps the decoded scene
and the compiled programs. All are stated per frame, in wall and processor time, of all processes.
`beside` is what a frame of the job takes beyond its render: the wall time of the job without the
renders' own, encoding included, and in brackets the same of one-shot renders by a client that
stays. `machinery` is the processor time of the server's own process, which keeps jobs, hashes and
writes files, and commits. `loading` is what a scene takes that is new to a server which has drawn
others, as the next shot of a film: its upload, decoded, and what its first frame takes beyond the
median of the next ones; and its share of the job. `workers` is the job on servers with one and with
two workers in turn, warm, the least wall time of each: how many times faster two are, beside the
processors and the load before.

`latency` is what a client waits for one render, from its request to its last byte, while the server
has nothing else to do and beside a job that never ends; the two take turns, a few renders each.
`urgent` renders say Priority: u=0, as those of a hand that moves; `default` ones say nothing.
"""
import argparse
import json
import os
import resource
import shutil
import statistics
import struct
import subprocess
import tempfile
import time

from daemon import Daemon

WANTED = argparse.ArgumentParser(description="films as a job and as processes")
WANTED.add_argument("bin")
WANTED.add_argument("scene", nargs="?")
WANTED.add_argument("--size", default="320x180")
WANTED.add_argument("--frames", type=int, default=200)
WANTED.add_argument("--processes", type=int, default=10)
WANTED.add_argument("--rounds", type=int, default=25, help="of latencies, four renders each")
WANTED.add_argument("--quick", action="store_true")
WANTED.add_argument("--json", action="store_true")


def unpack(glb):
    """The document of a GLB, and its binary chunk."""
    length, = struct.unpack_from("<I", glb, 12)
    document, rest = json.loads(glb[20:20 + length]), glb[20 + length:]
    return document, rest[8:8 + struct.unpack_from("<I", rest, 0)[0]]


def pack(document, binary):
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    body = (struct.pack("<I4s", len(text), b"JSON") + text
            + struct.pack("<I4s", len(binary), b"BIN\0") + binary)
    return b"glTF" + struct.pack("<II", 2, 12 + len(body)) + body


def turning(glb):
    """The GLB with an animation that turns all of it once in ten seconds."""
    document, binary = unpack(glb)
    quarter = 0.5 ** 0.5
    data = struct.pack("<5f", 0, 2.5, 5, 7.5, 10) + struct.pack(
        "<20f", 0, 0, 0, 1, 0, quarter, 0, quarter, 0, 1, 0, 0, 0, quarter, 0, -quarter,
        0, 0, 0, -1)
    start = len(binary)
    views, accessors = document["bufferViews"], document["accessors"]
    views += [{"buffer": 0, "byteOffset": start, "byteLength": 20},
              {"buffer": 0, "byteOffset": start + 20, "byteLength": 80}]
    accessors += [{"bufferView": len(views) - 2, "componentType": 5126, "count": 5,
                   "type": "SCALAR", "min": [0], "max": [10]},
                  {"bufferView": len(views) - 1, "componentType": 5126, "count": 5,
                   "type": "VEC4"}]
    shown = document["scenes"][document.get("scene", 0)]
    root = len(document["nodes"])
    document["nodes"].append({"name": "Film", "children": shown["nodes"]})
    shown["nodes"] = [root]
    document["animations"] = [{
        "channels": [{"sampler": 0, "target": {"node": root, "path": "rotation"}}],
        "samplers": [{"input": len(accessors) - 2, "output": len(accessors) - 1}]}]
    binary += data
    document["buffers"][0]["byteLength"] = len(binary)
    return pack(document, binary)


class Clock:
    """Wall time and that of the processors in children that have ended, since the last lap."""

    def __init__(self):
        self.lap()

    def lap(self):
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        now = (time.monotonic(), used.ru_utime + used.ru_stime)
        past, self.last = getattr(self, "last", now), now
        return {"wall_s": now[0] - past[0], "cpu_s": now[1] - past[1]}


def as_job(options, scene, folder):
    """One daemon and one job, from start to end, and what its frames took beside rendering."""
    clock = Clock()
    daemon = Daemon(options.bin, os.path.join(folder, "job"))
    try:
        found = run_job(options, scene, daemon)
    finally:
        daemon.stop()
    whole = clock.lap()
    return {**{key: value / options.frames for key, value in whole.items()}, **found}


def run_job(options, scene, daemon):
    with open(scene, "rb") as file:
        glb = file.read()
    summary = json.loads(daemon.ask("/v1/scenes", glb, "model/gltf-binary")[1])
    width, height = map(int, options.size.split("x"))
    view = {"width": width, "height": height, "exposure_ev": "auto",
            "camera": {"fit": "three-quarter"}}
    used, posted = daemon.cpu_ms(), time.monotonic()
    job = daemon.ask_json("/v1/jobs", {"scene": summary["id"], "view": view,
                                       "frames": f"1-{options.frames}"})
    path = f"/v1/jobs/{job['id']}"
    while job["state"] in ("queued", "running"):
        time.sleep(0.1)
        job = daemon.ask_json(path)
    took, used = time.monotonic() - posted, daemon.cpu_ms() - used
    assert job["state"] == "done", job
    times = [frame["ms"] for first in range(0, options.frames, 1000) for frame in
             daemon.ask_json(f"{path}/frames?first={first}&count=1000")["frames"]]
    stayed = []
    for frame in range(1, min(options.frames, 30) + 1):
        began = time.monotonic()
        headers, _ = daemon.ask("/v1/renders", json.dumps(
            {"scene": summary["id"], **view, "animation": {"time_s": frame / 24 + 0.001}}).encode())
        wall = 1e3 * (time.monotonic() - began)
        total = next(float(part.split("dur=")[1]) for part in headers["Server-Timing"].split(",")
                     if part.strip().startswith("total"))
        stayed.append(wall - total)
    loading = load_again(options, glb, view, daemon)
    return {"frame_ms": statistics.median(times),
            "beside_ms": 1e3 * took / options.frames - statistics.mean(times),
            "machinery_cpu_ms": used / options.frames,
            "client_ms": statistics.median(stayed),
            "first_frame_ms": times[0],
            "loading_s": loading, "loading_share": loading / (loading + took)}


def load_again(options, glb, view, daemon):
    """Seconds that the same scene takes, new to the server, until it draws as fast as later."""
    document, binary = unpack(glb)
    document["asset"]["generator"] = "the next shot"
    again = pack(document, binary)
    began = time.monotonic()
    scene = json.loads(daemon.ask("/v1/scenes", again, "model/gltf-binary")[1])["id"]
    upload = time.monotonic() - began
    times = []
    for frame in range(1, min(options.frames, 10) + 1):
        began = time.monotonic()
        daemon.ask("/v1/renders", json.dumps({"scene": scene, **view, "animation": {
            "time_s": frame / 24}}).encode())
        times.append(time.monotonic() - began)
    return upload + max(0, times[0] - statistics.median(times[1:]))


def timed_job(options, daemon, scene, frames):
    """Wall seconds of a job of so many frames, with shadows that both servers make alike."""
    width, height = map(int, options.size.split("x"))
    began = time.monotonic()
    job = daemon.ask_json("/v1/jobs", {
        "scene": scene, "frames": f"1-{frames}",
        "view": {"width": width, "height": height, "camera": {"fit": "three-quarter"},
                 "quality": {"shadows": "deep"}}})
    while job["state"] in ("queued", "running"):
        time.sleep(0.01)
        job = daemon.ask_json(f"/v1/jobs/{job['id']}")
    assert job["state"] == "done", job
    return time.monotonic() - began


def by_workers(options, scene, folder):
    """The same job on one worker and on two, in turn; the second server has the programs that the
    first one compiled. And renders beside a job of the first one."""
    with open(scene, "rb") as file:
        glb = file.read()
    rounds, load, least, daemons = 1 if options.quick else 3, os.getloadavg()[0], {}, {}
    try:
        for count in (1, 2):
            state = os.path.join(folder, f"workers-{count}")
            if daemons:
                shutil.copytree(os.path.join(folder, "workers-1", "cache"),
                                os.path.join(state, "cache"))
            daemon = daemons[count] = Daemon(options.bin, state, "--workers", str(count),
                                             "--no-warm-up", "--auto", "raster")
            found = json.loads(daemon.ask("/v1/scenes", glb, "model/gltf-binary")[1])["id"]
            while not all(one["ready"] for one in daemon.ask_json("/v1/stats")["workers"]):
                time.sleep(0.1)
            timed_job(options, daemon, found, 4 if count > 1 else 1)  # two go to each of several
        for _ in range(rounds):
            for count, daemon in daemons.items():
                took = timed_job(options, daemon, found, options.frames) / options.frames
                least[count] = min(took, least.get(count, took))
        latency = latencies(options, daemons[1], found)
    finally:
        for daemon in daemons.values():
            daemon.stop()
    return {"one_s": least[1], "two_s": least[2], "ratio": least[1] / least[2],
            "processors": os.cpu_count(), "load_before": load}, latency


def settle(daemon, job, is_paused):
    """Pauses the job until none of its frames is in the making, or has it go on until one is."""
    daemon.ask_json(job, {"paused": is_paused}, "PATCH")
    while (daemon.ask_json(job)["frames"]["running"] > 0) == is_paused:
        time.sleep(0.01)


def quantiles(times):
    ranked = sorted(times)
    return {"p50_ms": statistics.median(ranked),
            "p95_ms": ranked[min(len(ranked) - 1, int(0.95 * len(ranked)))], "count": len(ranked)}


def latencies(options, daemon, scene):
    """What renders take from request to reply, with and without a job beside them."""
    width, height = map(int, options.size.split("x"))
    view = {"width": width, "height": height, "exposure_ev": "auto",
            "camera": {"fit": "three-quarter"}}
    job = daemon.ask_json("/v1/jobs", {"scene": scene, "view": view, "paused": True,
                                       "frames": "1-100000"})
    path, frame = f"/v1/jobs/{job['id']}", 0
    times = {(beside, kind): [] for beside in ("alone", "beside_a_job")
             for kind in ("urgent", "default")}
    for number in range(options.rounds + 1):  # the first one warms up
        for (beside, kind), found in times.items():
            if kind == "urgent":
                settle(daemon, path, beside == "alone")
            for _ in range(4):
                frame += 1
                body = {"scene": scene, **view, "animation": {"time_s": frame / 24 + 0.001}}
                began = time.monotonic()
                daemon.ask("/v1/renders", json.dumps(body).encode(),
                           priority="u=0" if kind == "urgent" else None)
                if number > 0:
                    found.append(1e3 * (time.monotonic() - began))
    ended = daemon.ask_json(path, method="DELETE")
    result = {"job_frame_ms": 1e3 * ended["busy_s"] / max(1, ended["frames"]["done"])}
    for (beside, kind), found in times.items():
        result.setdefault(beside, {})[kind] = quantiles(found)
    return result


def as_processes(options, scene, folder, *more):
    """A process for each frame; of those that keep something the first is left out."""
    laps, clock = [], Clock()
    for frame in range(1, options.processes + 1):
        subprocess.run([os.path.join(options.bin, "vitrail"), "render", scene, "-o",
                        os.path.join(folder, "f.png"), "--size", options.size, "--camera",
                        "fit:three-quarter", "--exposure", "auto", "--time", str(frame / 24),
                        "--spawn", "--quiet", *more], check=True)
        laps.append(clock.lap())
    later = laps[1:] if more else laps
    return {key: statistics.median(lap[key] for lap in later) for key in later[0]}


def main():
    options = WANTED.parse_args()
    if options.quick:
        options.frames, options.processes, options.rounds = 8, 2, 2
    with tempfile.TemporaryDirectory() as folder:
        scene = os.path.join(folder, "scene.glb")
        if options.scene:
            scene = options.scene
        else:
            subprocess.run([os.path.join(options.bin, "vitrail"), "demo-scene", "-o", scene],
                           check=True, stdout=subprocess.DEVNULL)
            with open(scene, "r+b") as file:
                film = turning(file.read())
                file.seek(0)
                file.write(film)
        job, (workers, latency) = as_job(options, scene, folder), by_workers(options, scene, folder)
        ways = {"process": as_processes(options, scene, folder),
                "kept": as_processes(options, scene, folder, "--state-dir",
                                     os.path.join(folder, "kept"))}
    for way in ways.values():
        way["ratio"] = {key: way[key] / job[key] for key in ("wall_s", "cpu_s")}
    if options.json:
        print(json.dumps({"size": options.size, "frames": options.frames, "job": job,
                          "workers": workers, **ways, "latency": latency}, indent=1))
        return
    print(f"{options.frames} frames of {options.size}, per frame:")
    print(f"  job      {job['wall_s']:8.3f} s wall {job['cpu_s']:8.3f} s of processors; "
          f"render {job['frame_ms']:.1f} ms, beside it {job['beside_ms']:.2f} ms "
          f"(a client that stays: {job['client_ms']:.2f} ms), machinery "
          f"{job['machinery_cpu_ms']:.2f} ms of a processor")
    print(f"           loading the scene {job['loading_s']:.3f} s, "
          f"{100 * job['loading_share']:.2f} % of the job")
    print(f"  workers  {workers['one_s']:8.3f} s wall by one, {workers['two_s']:.3f} s by two: "
          f"{workers['ratio']:.2f} times as fast on {workers['processors']} processors, load "
          f"{workers['load_before']:.1f} before")
    for name, way in ways.items():
        print(f"  {name:8} {way['wall_s']:8.3f} s wall {way['cpu_s']:8.3f} s of processors; "
              f"{way['ratio']['wall_s']:.1f} and {way['ratio']['cpu_s']:.1f} times the job")
    print(f"one render, frames of the job beside it take {latency['job_frame_ms']:.0f} ms:")
    for beside in ("alone", "beside_a_job"):
        for kind, found in latency[beside].items():
            print(f"  {beside:12} {kind:7} p50 {found['p50_ms']:7.1f} ms, "
                  f"p95 {found['p95_ms']:7.1f} ms of {found['count']}")


main()
