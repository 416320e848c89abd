#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Whether `budget_ms` and `max_error` are kept by frames of generated scenes, over HTTP.

usage: promises.py BIN [--seeds N] [--busy] [--wish budget_ms|max_error] [--quick] [--json]

`vitrail-bench promises` runs this. For each scene (`vitrail-bench generate`), right after its
upload and with no warm-up awaited, renders are asked for with budgets from 60 to 1000 ms, each
twice, and, in a small picture, with errors from 0.08 to 0.008. A budget is kept where the frame
took no longer in the renderer, an error where the picture that was sent (EXR) is no farther off
the ray-traced reference of 256 samples per pixel; either counts where the reply warned that
nothing keeps it. --busy: beside a process that keeps a processor busy. Where budgets are asked
for, every scene has a daemon of its own with an empty state directory, so that nothing is
compiled; --haze, --smoke: the same scenes with either; --media: scenes of random media
(random_media.py), each with one error, held against 64 samples first; --quick: one scene, one
budget, one error.
"""
import argparse
import json
import os
import subprocess
import sys
import tempfile

import random_media
from daemon import Daemon
from exr import read_color, rmse

WISHES = ("budget_ms", "max_error")
WANTED = argparse.ArgumentParser(description="promises of frames")
WANTED.add_argument("bin")
WANTED.add_argument("--seeds", type=int, default=12)
WANTED.add_argument("--first-seed", type=int, default=2001)  # nothing was fitted to these
WANTED.add_argument("--wish", choices=WISHES, action="append")
WANTED.add_argument("--busy", action="store_true")
WANTED.add_argument("--haze", type=float, default=0, metavar="DENSITY")  # 1/m
WANTED.add_argument("--smoke", action="store_true")
WANTED.add_argument("--media", action="store_true")
WANTED.add_argument("--quick", action="store_true")
WANTED.add_argument("--json", action="store_true")

BUDGETS_MS = (60, 150, 250, 500, 1000)
ERRORS = (0.08, 0.05, 0.03, 0.02, 0.012, 0.008)
SMALL = {"width": 64, "height": 48}  # of pictures whose error is measured
REFERENCE = {"reference": True, "samples": 256, "atmosphere_samples": 16}  # of each sample
SMALL_MEDIA = {"width": 8, "height": 6}  # each ray crosses grids for each light
# As many samples, since haze and smoke beside a lamp glow like one over the distance from it.
WHOLE = {**REFERENCE, "atmosphere_samples": 4}
# A quarter of them come first. Their noise adds to the error that is found: where that is at most
# half of the error asked for, it is kept, and the whole reference is not needed to tell.
REFERENCES_OF_MEDIA = (({**WHOLE, "samples": 64}, 0.5), (WHOLE, 1))
SHARE_KEPT, MOST_MISSED = 0.95, 3


def generate(wanted, seed):
    """(name, GLB, request) of a scene."""
    if wanted.media:
        return random_media.make(seed)
    with tempfile.NamedTemporaryFile(suffix=".glb") as file:
        done = subprocess.run([os.path.join(wanted.bin, "vitrail-bench"), "generate", str(seed),
                               file.name, *(["--smoke"] if wanted.smoke else [])],
                              capture_output=True, text=True, check=True)
        request = json.loads(done.stdout)
        haze = {"density": wanted.haze, "anisotropy": 0.3}
        return request.pop("name"), file.read(), {**request,
                                                  **({"atmosphere": haze} if wanted.haze else {})}


def draw(daemon, request, quality):
    """(stats, picture) of one frame."""
    body = {**request, "quality": quality}
    headers, picture = daemon.ask("/v1/renders", json.dumps(body).encode())
    link = headers["Link"]
    return daemon.ask_json(link[link.index("<") + 1:link.index(">")]), picture


def tell_of(frame, wish, asked, got):
    """What became of one wish."""
    chosen = frame["chosen"]
    return {"wish": wish, "asked": asked, "got": got, "shadows": chosen["shadows"],
            "expected": chosen["expected_ms"] if wish == "budget_ms" else frame["error"]["value"],
            "samples": chosen["samples"], "missed": chosen["missed"], "kept": got <= asked,
            "warned": any(wish in warning for warning in frame["warnings"])}


def ask_budgets(daemon, request, is_quick):
    for budget in BUDGETS_MS[-1:] if is_quick else BUDGETS_MS:
        for _ in range(1 if is_quick else 2):
            frame, _ = draw(daemon, request, {"budget_ms": budget})
            yield tell_of(frame, "budget_ms", budget, frame["chosen"]["took_ms"])


def ask_errors(daemon, request, errors, size, references):
    """references: from coarse to whole, each with the share of an error that it may tell."""
    request = {**request, **size, "format": "exr"}
    drawn = []
    for error in errors:
        frame, picture = draw(daemon, request, {"max_error": error})
        drawn.append((error, frame, read_color(picture)))
    for quality, share in references:
        reference = read_color(draw(daemon, request, quality)[1])
        found = [(*one, rmse(one[2], reference)) for one in drawn]
        if all(got <= share * error for error, _, _, got in found):
            break
    for error, frame, _, got in found:
        yield tell_of(frame, "max_error", error, got)


def errors_of(wanted, seed):
    """What is asked for: of random media one error, so that there are as many wishes as media."""
    return ERRORS[1:2] if wanted.quick else [ERRORS[seed % len(ERRORS)]] if wanted.media else ERRORS


def tell_one(wanted, one):
    state = "kept" if one["kept"] else "warned" if one["warned"] else "MISSED"
    if not wanted.json:
        print(f"  {one['scene'][:44]:44} {one['asked']:6g} {one['got']:9.4g} "
              f"{one['expected'] or 0:9.4g}  {one['shadows']:18}{one['samples']:3}  {state}",
              flush=True)


def run_scene(wanted, daemon, seed):
    name, glb, request = generate(wanted, seed)
    reply = daemon.ask("/v1/scenes", glb, "model/gltf-binary")[1]
    request["scene"] = json.loads(reply)["id"]
    compared = ((SMALL_MEDIA, REFERENCES_OF_MEDIA) if wanted.media
                else (SMALL, ((REFERENCE, 1),)))
    results = []
    for wish in wanted.wish or WISHES:
        asked = (ask_budgets(daemon, request, wanted.quick) if wish == "budget_ms"
                 else ask_errors(daemon, request, errors_of(wanted, seed), *compared))
        for one in asked:
            results.append({"scene": name, **one})
            tell_one(wanted, results[-1])
    return results


def run(wanted, seeds):
    """All wishes of some scenes, of one daemon."""
    with tempfile.TemporaryDirectory() as folder:
        daemon = Daemon(wanted.bin, folder)
        try:
            return [one for seed in seeds for one in run_scene(wanted, daemon, seed)]
        finally:
            daemon.stop()


def sum_up(results):
    kept = sum(one["kept"] or one["warned"] for one in results)
    return {"asked": len(results), "kept": sum(one["kept"] for one in results),
            "kept_or_warned": kept, "share": kept / len(results),
            "worst": max((one["got"] / one["asked"] for one in results
                          if one["kept"] or not one["warned"]), default=0)}


def tell(results, is_json):
    summary = {wish: sum_up([one for one in results if one["wish"] == wish])
               for wish in WISHES if any(one["wish"] == wish for one in results)}
    if is_json:
        print(json.dumps({"summary": summary, "results": results}, indent=1))
        return
    for wish, of_wish in summary.items():
        print(f"{wish}: kept or warned {of_wish['kept_or_warned']} of {of_wish['asked']} "
              f"({of_wish['share']:.3f} >= {SHARE_KEPT}), worst without a warning: "
              f"{of_wish['worst']:.2f} (<= {MOST_MISSED})")


def main():
    wanted = WANTED.parse_args()
    busy = subprocess.Popen([sys.executable, "-c", "while True: pass"]) if wanted.busy else None
    count = 1 if wanted.quick else wanted.seeds
    seeds = range(wanted.first_seed, wanted.first_seed + count)
    has_budgets = "budget_ms" in (wanted.wish or WISHES)
    results = []
    try:
        for some in [[seed] for seed in seeds] if has_budgets else [seeds]:
            results += run(wanted, some)
    finally:
        if busy:
            busy.kill()
            busy.wait()
    tell(results, wanted.json)


if __name__ == "__main__":
    main()
