#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Fits the models behind `auto`, `max_error`, `budget_ms` (docs/explanation/cost-model.md).

    vitrail-bench forecast --json > F.json;  fit_models.py costs F.json...
    vitrail-bench grids --scene fit --json > G.json;  fit_models.py grids G.json...
    vitrail tradeoff SCENE -o T.json;        fit_models.py errors T.json...
    vitrail-bench auto --scene fit --json > A.json;  fit_models.py auto A.json...
    vitrail-bench auto --json > A.json;      fit_models.py keep A.json > auto_timings.json

costs: what each unit of work takes in ns of processor time, for renderer/forecast/forecast.c: least
squares without negative costs, in which each case weighs by its own time, so that a case of 5 ms
counts as much as one of 500. errors: the RMSE of each kind of setting, for renderer/cost/choice.c:
the value below which four of five measured settings are. auto: from the costs that stand in
forecast.c, those that frames of generated scenes ask for: descent over Huber's loss of logarithms,
in which each cost is drawn to its old value. keep: the times that tests/data/auto_timings.json
holds for unit.plan_learning."""
import json
import math
import os
import re
import statistics
import sys

NS = 1e-6  # ms


def solve(rows, targets, rounds=8, sweeps=400):
    """Costs that are not negative, by coordinate descent; weights follow what is forecast."""
    count = len(rows[0])
    costs = [0.0] * count
    weights = [1 / max(target, 0.5) for target in targets]
    for _ in range(rounds):
        gram = [[0.0] * count for _ in range(count)]
        right = [0.0] * count
        for row, target, weight in zip(rows, targets, weights):
            for i in range(count):
                right[i] += weight**2 * row[i] * target
                for j in range(count):
                    gram[i][j] += weight**2 * row[i] * row[j]
        for _ in range(sweeps):
            for j in range(count):
                if gram[j][j] > 0:
                    slope = right[j] - sum(gram[j][k] * costs[k] for k in range(count))
                    costs[j] = max(0.0, costs[j] + slope / gram[j][j])
        told = [sum(a * b for a, b in zip(row, costs)) for row in rows]
        weights = [1 / max(math.sqrt(max(a, 0) * b), 0.5) for a, b in zip(told, targets)]
    return costs, told


def tell(title, names, rows, targets):
    costs, told = solve(rows, targets)
    off = [math.exp(abs(math.log(max(a, 1e-9) / b))) for a, b in zip(told, targets)]
    off.sort()
    print(f"{title}: {len(rows)} cases, off by {statistics.median(off):.2f} (median), "
          f"{off[len(off) * 9 // 10]:.2f} (9 of 10), {off[-1]:.2f} (worst)")
    for name, cost in zip(names, costs):
        print(f"    {name:20s}{cost:10.3g}")


# ---- costs ----


def shade(case):
    work, more = case["workload"], 1.0 if case["samples"] > 1 else 0.0
    pixels, covered = work["pixels"], work["pixels"] * work["covered"]
    layers = work["pixels"] * work["layers"]
    surfaces = covered + layers
    lit = surfaces * work["lit"]
    looks = lit if work["shadowed_lights"] else 0.0
    return [1 / NS, pixels, more * pixels, more * covered, lit, looks * (1 + 4 * 0.25), layers,
            more * layers, surfaces * work["textures"], more * surfaces * work["textures"],
            work["triangles_in_view"], more * work["triangles_in_view"]]


SHADE = ["frame_ms", "pixel", "msaa_pixel", "msaa_covered", "light", "look (tap: a quarter)",
         "layer", "msaa_layer", "texture", "msaa_texture", "triangle", "msaa_triangle"]


def maps(case):
    work, side = case["workload"], 1024.0
    texels, deep = work["map_faces"] * side**2, work["deep_faces"] * side**2
    return [work["map_faces"] / NS, texels, work["map_triangles"], deep, work["deep_triangles"],
            deep * work["deep_share"]]


MAPS = ["face_ms", "texel", "caster", "deep_texel", "deep_caster", "event"]


def trace(case):
    work = case["workload"]
    rays, levels = work["pixels"] * case["samples"], math.log2(2 + work["triangles"])
    layers = work["pixels"] * work["layers"]
    surfaces = work["pixels"] * work["covered"] + layers
    return [1 / NS, rays, rays * work["covered"] * levels, surfaces * work["lit"],
            rays * work["layers"], layers * work["lit"], surfaces * work["textures"]]


TRACE = ["traced_frame_ms", "ray", "hit_level", "shadow_ray", "layer_ray", "layer_light",
         "traced_texture"]


def point_rays(case):
    """What traced shadows add to a picture without any, which comes first."""
    work, more = case["workload"], 1.0 if case["samples"] > 1 else 0.0
    layers = work["pixels"] * work["layers"]
    surfaces = work["pixels"] * work["covered"] + layers
    speed = NS * case["speed"]["trace"]
    return [case["bare"]["alone_ms"][1]] + [
        speed * unit for unit in (work["pixels"], more * work["pixels"], surfaces,
                                  surfaces * work["lit"] * math.log2(2 + work["triangles"]),
                                  layers * work["lit"])]


POINT_RAYS = ["without shadows", "point_pixel", "msaa_point_pixel", "point", "point_level",
              "layer_point_ray"]


def read_cases(paths):
    """Those of every run, each with how fast the device was in it."""
    cases = []
    for path in paths:
        with open(path, encoding="utf-8") as file:
            results = json.load(file)["results"]
        speed = next(one for one in results if one["suite"] == "speed")
        cases += [{**one, "speed": speed} for one in results if one["suite"] == "forecast"]
    return cases


def fit_costs(paths):
    cases = read_cases(paths)
    shadowed = [one for one in cases if one["workload"]["shadowed_lights"]]
    tell("traced shadows", POINT_RAYS, [point_rays(case) for case in shadowed],
         [case["raytraced_shadows"]["alone_ms"][1] for case in shadowed])
    scaled = [(case, case["raster"]["cpu_ms"], case["raytraced"]["cpu_ms"]) for case in cases]
    built = [one for one in scaled if one[1][0] - one[1][1] > 1]
    treed = [one for one in scaled if one[0]["workload"]["triangles"] > 2000]
    tell("picture, rasterised", SHADE, [[NS * x for x in shade(c)] for c, _, _ in scaled],
         [raster[1] for _, raster, _ in scaled])
    tell("shadow maps", MAPS, [[NS * x for x in maps(c)] for c, _, _ in built],
         [raster[0] - raster[1] for _, raster, _ in built])
    tell("rays", TRACE, [[NS * x for x in trace(c)] for c, _, _ in scaled],
         [traced[1] for _, _, traced in scaled])
    tell("tree", ["built_triangle"], [[NS * c["workload"]["triangles"]] for c, _, _ in treed],
         [max(traced[0] - traced[1], 0.5) for _, _, traced in treed])


# ---- smoke ----

SPLIT = 2.4  # renderer/forecast/forecast.c


def smoke(case, trace):
    """What grids add to a frame by rays."""
    work, samples, ns = case["workload"], case["samples"], NS * trace
    rays, points = work["pixels"] * samples, 4 + (8 if samples >= 4 else 16)
    surfaces = work["pixels"] * (work["layers"] + work["covered"] * (SPLIT if samples > 1 else 1))
    return [ns * rays * points * work["grid_lights"],
            ns * (rays * (work["grid_cells"] + points * work["grid_lit_cells"]) +
                  surfaces * work["grid_shadow_cells"])]


def smoke_drawn(case, shade_speed):
    """What grids add to a rasterised frame."""
    work, ns = case["workload"], NS * shade_speed
    surfaces = work["pixels"] * (work["layers"] + work["covered"])
    return [ns * work["grid_nodes"], ns * work["grid_node_lights"],
            ns * (work["pixels"] * work["grid_cells"] + work["grid_node_cells"] +
                  surfaces * work["grid_shadow_cells"])]


def fit_grids(paths):
    rows, targets = {"raytraced": [], "deep": []}, {"raytraced": [], "deep": []}
    for path in paths:
        with open(path, encoding="utf-8") as file:
            results = json.load(file)["results"]
        speed = next(one for one in results if one["suite"] == "speed")
        for case in results:
            if case["suite"] == "grids":
                row = (smoke(case, speed["trace"]) if case["technique"] == "raytraced" else
                       smoke_drawn(case, speed["shade"]))
                rows[case["technique"]].append(row)
                targets[case["technique"]].append(case["with_ms"] - case["without_ms"])
    tell("smoke", ["grid_point", "grid_cell"], rows["raytraced"], targets["raytraced"])
    tell("smoke, rasterised", ["smoke_node", "smoke_light", "smoke_cell"], rows["deep"],
         targets["deep"])


# ---- auto ----

MAPS_TEXELS, TAPS = 1024, 4
HUBER, DRAWN = 0.25, 0.7  # logarithms: where the loss turns linear; how far a cost may well be off
COSTS_FILE = os.path.join(os.path.dirname(__file__), "..", "..", "renderer", "forecast",
                          "forecast.c")


def read_costs():
    with open(COSTS_FILE, encoding="utf-8") as file:
        text = file.read()
    table = text[text.index("forecast_costs = {"):]
    costs = dict((name, float(value)) for name, value in
                 re.findall(r"\.(\w+) = ([\d.]+)", table[:table.index("};")]))
    costs["SPLIT"] = float(re.search(r"SPLIT = ([\d.]+)", text).group(1))
    return costs


def drawn_units(case, speed, has_maps):
    """{cost: units} of the rasterised picture, by renderer/forecast/forecast.c."""
    work, more = case["workload"], 1.0 if case["samples"] > 1 else 0.0
    pixels, shade = work["pixels"], NS * speed["shade"]
    layers, covered = pixels * work["layers"], pixels * work["covered"]
    surfaces = layers + covered
    looks = surfaces * work["lit"] if has_maps and work["shadowed_lights"] else 0
    units = {"pixel": pixels, "msaa_pixel": more * pixels, "msaa_covered": more * covered,
             "light": surfaces * work["lit"], "look": looks, "tap": TAPS * looks,
             "walk": surfaces * work["listed"], "layer": layers, "msaa_layer": more * layers,
             "texture": surfaces * work["textures"],
             "msaa_texture": more * surfaces * work["textures"],
             "triangle": work["triangles_in_view"],
             "msaa_triangle": more * work["triangles_in_view"]}
    units = {name: shade * count for name, count in units.items()}
    units["drawn_frame_ms"] = speed["shade"]
    return units


def built_units(case, speed):
    work, texels, ns = case["workload"], MAPS_TEXELS**2, NS * speed["maps"]
    deep = work["deep_faces"] * texels
    return {"face_ms": speed["maps"] * work["map_faces"], "texel": ns * work["map_faces"] * texels,
            "caster": ns * work["map_triangles"], "deep_texel": ns * deep,
            "event": ns * deep * work["deep_share"], "deep_caster": ns * work["deep_triangles"]}


def ray_units(case, speed, split):
    work, ns = case["workload"], NS * speed["trace"]
    is_more = case["samples"] > 1
    pixels, levels = work["pixels"], math.log2(2 + work["triangles"])
    rays, layers = pixels * case["samples"], pixels * work["layers"]
    surfaces = layers + pixels * work["covered"] * (split if is_more else 1)
    units = {"ray": pixels, "hit_level": pixels * work["covered"] * levels,
             "more_ray": rays - pixels,
             "more_hit_level": (rays - pixels) * work["covered"] * levels,
             "traced_triangle": work["triangles_in_view"],
             "msaa_traced_triangle": work["triangles_in_view"] if is_more else 0,
             "layer_ray": rays * work["layers"], "layer_light": layers * work["lit"],
             "shadow_ray": surfaces * work["lit"], "traced_walk": surfaces * work["listed"],
             "traced_texture": surfaces * work["textures"]}
    units = {name: ns * count for name, count in units.items()}
    units["traced_frame_ms"] = speed["trace"]
    return units


def shadow_point_units(case, speed):
    work, ns = case["workload"], NS * speed["trace"]
    pixels, levels = work["pixels"], math.log2(2 + work["triangles"])
    layers = pixels * work["layers"]
    surfaces = layers + pixels * work["covered"]
    if not work["shadowed_lights"]:
        return {}
    units = {"point_pixel": pixels, "msaa_point_pixel": pixels if case["samples"] > 1 else 0,
             "point": surfaces, "point_level": surfaces * work["lit"] * levels,
             "layer_point_ray": layers * work["lit"], "point_walk": surfaces * work["listed"]}
    return {name: ns * count for name, count in units.items()}


def forecast_ms(case, speed, costs, technique):
    if technique == "rays":
        base, units = 0.0, ray_units(case, speed, costs["SPLIT"])
    else:
        base, units = speed["frame_ms"], drawn_units(case, speed, technique == "maps")
    if technique == "maps" and not case["maps_stay"]:
        units.update(built_units(case, speed))
    if technique == "traced_shadows":
        units.update(shadow_point_units(case, speed))
    return base + sum(costs[name] * count for name, count in units.items())


TECHNIQUES = ("maps", "rays", "traced_shadows")


def tell_auto(title, cases, costs):
    print(title)
    for samples in (1, 4):
        for technique in TECHNIQUES:
            off = sorted(math.log(forecast_ms(case, speed, costs, technique) /
                                  statistics.median(case[technique]))
                         for case, speed in cases if case["samples"] == samples)
            if off:
                print(f"    {samples} samples, {technique:15s} forecast over taken: median "
                      f"{math.exp(statistics.median(off)):.2f}, from {math.exp(off[0]):.2f} to "
                      f"{math.exp(off[-1]):.2f}")


def fit_auto(paths):
    cases, costs = [], read_costs()
    for path in paths:
        with open(path, encoding="utf-8") as file:
            for result in json.load(file)["results"]:
                cases += [(case, result["speed"]) for case in result["cases"]]
    old = dict(costs)
    tell_auto(f"{len(cases)} views, as it is:", cases, costs)

    def loss(trial):
        total = sum((math.log(trial[name] / old[name]) / DRAWN)**2 for name in old) * 0.1
        for case, speed in cases:
            for technique in TECHNIQUES:
                off = abs(math.log(forecast_ms(case, speed, trial, technique) /
                                   statistics.median(case[technique])))
                total += off * off if off < HUBER else HUBER * (2 * off - HUBER)
        return total

    best, step = loss(costs), 0.4
    while step > 0.02:
        before = best
        for name in costs:
            for factor in (math.exp(step), math.exp(-step)):
                trial = {**costs, name: costs[name] * factor}
                now = loss(trial)
                if now < best:
                    costs, best = trial, now
        if best > before - 1e-3 * before:
            step /= 2
    tell_auto("as it fits:", cases, costs)
    for name, cost in costs.items():
        if abs(math.log(cost / old[name])) > 0.05:
            print(f"    {name:22s}{old[name]:8.3g} -> {cost:8.3g}")


def brief(value):
    if isinstance(value, float):
        return float(f"{value:.5g}")
    if isinstance(value, list):
        return [brief(one) for one in value]
    return {name: brief(one) for name, one in value.items()} if isinstance(value, dict) else value


def keep_auto(paths):
    """The times of one run, as tests/data/auto_timings.json has them."""
    with open(paths[0], encoding="utf-8") as file:
        result = json.load(file)["results"][0]
    print(f'{{"speed": {json.dumps(brief(result["speed"]))},\n"cases": [')
    print(",\n".join(json.dumps(brief(case)) for case in result["cases"]))
    print("]}")


# ---- errors ----


def fit_errors(paths):
    groups, scenes = {}, set()
    for path in paths:
        with open(path, encoding="utf-8") as file:
            document = json.load(file)
        scenes.add(document["scene"])
        side = math.sqrt(document["width"] * document["height"])
        for one in document["settings"]:
            key = (one["shadows"], one["samples"], one["shadow_resolution"] or 0,
                   one["shadow_taps"] or 0)
            groups.setdefault(key, []).append(one["error"]["rmse"] * math.sqrt(side / 480))
    print(f"{len(scenes)} scenes, {len(paths)} views; RMSE times sqrt(sqrt(pixels) / 480)")
    for key, errors in sorted(groups.items()):
        errors.sort()
        print("{:12s} samples {:3d} texels {:4d} taps {:2d}: ".format(*key) +
              f"{len(errors):3d} measured, median {statistics.median(errors):.4f}, "
              f"4 of 5 below {errors[len(errors) * 4 // 5]:.4f}, worst {errors[-1]:.4f}")


if __name__ == "__main__":
    FITS = {"costs": fit_costs, "grids": fit_grids, "auto": fit_auto, "keep": keep_auto,
            "errors": fit_errors}
    if len(sys.argv) < 3 or sys.argv[1] not in FITS:
        sys.exit(__doc__)
    FITS[sys.argv[1]](sys.argv[2:])
