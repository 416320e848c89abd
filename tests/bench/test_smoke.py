# SPDX-License-Identifier: MIT
"""The benchmark program runs, and states its results as JSON with scene, size, device, protocol."""

import json
import math
import pathlib
import subprocess
import sys
import unittest

PROGRAM = pathlib.Path(sys.argv.pop(1)) / "vitrail-bench"


def run(*arguments):
    return subprocess.run([str(PROGRAM), *arguments], capture_output=True, text=True, check=False,
                          timeout=600)


def measure(suite, *arguments):
    """In few rounds: what is promised of a suite here needs no exact times."""
    return run(suite, "--quick", "--json", "--frames", "2", *arguments)


class Bench(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        done = run("deep", "--quick", "--json", "--size", "160x120")
        if done.returncode == 77:
            print(done.stderr, file=sys.stderr)
            sys.exit(77)
        assert done.returncode == 0, done.stderr
        cls.document = json.loads(done.stdout)

    def test_each_result_names_scene_size_protocol_and_times(self):
        results = self.document["results"]
        self.assertEqual({"deep", "deep-linked", "linked-faithful"},
                         {r["variant"] for r in results if "static" not in r["variant"]})
        for result in results:
            self.assertEqual("demo", result["scene"])
            self.assertEqual([160, 120], result["size_px"])
            self.assertGreaterEqual(result["frames"], 5)
            for clock in ("wall_ms", "cpu_ms"):
                times = result[clock]
                self.assertGreater(times["median"], 0)
                self.assertGreaterEqual(times["p95"], times["median"])
        self.assertTrue(self.document["machine"]["device"])
        self.assertGreater(self.document["machine"]["cores"], 0)

    def test_static_lights_rebuild_nothing_and_moved_ones_everything(self):
        for result in self.document["results"]:
            built = result["counts"]["shadow_maps_built"]
            self.assertEqual(0 if "static" in result["variant"] else 1, built, result["variant"])
            self.assertGreater(result["counts"]["events"], 0)

    def test_parts_add_up_to_the_frame(self):
        for result in self.document["results"]:
            passes = sum(p["cpu_ms"]["median"] for p in result["parts"]
                         if not p["part"].startswith("=") or p["part"] == "= other")
            self.assertLess(passes, 1.5 * result["cpu_ms"]["p95"])
            self.assertGreater(passes, 0.5 * result["cpu_ms"]["median"])

    def test_ratios_are_numbers(self):
        checks = self.document["checks"]
        self.assertGreaterEqual(len(checks), 4)
        for check in checks:
            self.assertTrue(math.isfinite(check["value"]), check)


class CommandLine(unittest.TestCase):
    def test_list_names_every_suite(self):
        names = [line.split()[0] for line in run("list").stdout.splitlines()]
        self.assertEqual(["lights", "deep", "both", "layers", "demo", "draws", "raytrace",
                          "foliage", "forecast", "auto", "linear", "standing", "ahead",
                          "environment", "smoke", "grids", "peels", "finders", "traced",
                          "techniques", "silhouettes", "area", "skin", "import", "targets",
                          "scaling", "promises", "farm", "live"], names)

    def test_the_import_states_speed_and_memory_beside_the_decoders(self):
        done = measure("import")
        self.assertEqual(0, done.returncode, done.stderr)
        checks = {(c["subject"], c["name"]): c["value"] for c in json.loads(done.stdout)["checks"]}
        for form in ("plain", "meshopt", "draco"):
            for name in ("import, ms", "MB of file per s", "million triangles per s"):
                self.assertGreater(checks[form, name], 0, (form, name))
        for form in ("meshopt", "draco"):
            self.assertLess(checks[form, "file, MB"], checks["plain", "file, MB"])
            self.assertGreater(checks[form, "decoder alone, ms"], 0)
            self.assertIn((form, "import beyond plain / decoder alone"), checks)

    def test_light_from_all_around_states_its_cost_and_its_error(self):
        done = measure("environment", "--size", "64x36", "--seconds", "1")
        self.assertEqual(0, done.returncode, done.stderr)
        document = json.loads(done.stdout)
        checks = {check["name"]: check["value"] for check in document["checks"]}
        self.assertTrue(0.5 < checks["cpu with / without"] < 10, checks)
        self.assertIn("cpu ns per pixel and sample", checks)
        (_, few), (_, many) = document["series"][0]["points"]
        self.assertLess(many, 0.8 * few)  # 4 samples err less than one

    def test_haze_states_its_cost_and_its_error(self):
        done = measure("smoke", "--scene", "demo", "--size", "64x36", "--seconds", "1")
        self.assertEqual(0, done.returncode, done.stderr)
        checks = {(c["subject"], c["name"]): c["value"] for c in json.loads(done.stdout)["checks"]}
        for technique in ("deep", "raytraced", "raytraced-shadows"):
            self.assertGreater(checks[technique, "cpu haze / without"], 0.5, checks)
            for samples in (16, 64, 256):
                error = checks[technique, f"mean error, {samples} atmosphere samples"]
                self.assertTrue(0 < error < 0.5, checks)

    def test_haze_of_the_chapel_states_both_figures_of_its_target(self):
        done = measure("smoke", "--scene", "chapel", "--size", "64x36", "--seconds", "1")
        self.assertEqual(0, done.returncode, done.stderr)
        checks = {c["name"]: c for c in json.loads(done.stdout)["checks"]}
        cost, error = checks["cpu haze / without"], checks["RMSE beside 256 slices"]
        self.assertEqual(("<= 2", "<= 0.01"), (cost["target"], error["target"]))
        self.assertGreater(cost["value"], 0.5)
        self.assertTrue(0 < error["value"] < 0.5, error)

    def test_smoke_from_nearby_states_what_a_walk_per_step_takes(self):
        done = measure("smoke", "--scene", "close-up", "--size", "32x18", "--seconds", "1")
        self.assertEqual(0, done.returncode, done.stderr)
        checks = {c["name"]: c["value"] for c in json.loads(done.stdout)["checks"]}
        for figure in ("march steps", "lookups", "cpu ms"):
            ours, walked = checks[figure], checks[figure + ", walked"]
            self.assertGreater(min(ours, walked), 0, figure)
            self.assertAlmostEqual(walked / ours, checks[figure + " walked / ours"], places=3)
        # a small picture has a column for each pixel, as a walk has
        self.assertAlmostEqual(1, checks["march steps walked / ours"], delta=0.1)

    def test_smoke_states_what_was_forecast(self):
        done = measure("grids", "--size", "64x36")
        self.assertEqual(0, done.returncode, done.stderr)
        case = json.loads(done.stdout)["results"][1]
        self.assertGreater(case["with_ms"], case["without_ms"])
        self.assertGreater(case["forecast_ms"], case["without_ms"])
        self.assertGreater(case["workload"]["grid_lights"], 0)

    def test_shadow_techniques_state_times_that_add_up(self):
        done = measure("techniques", "--size", "64x48", "--seconds", "1")
        self.assertEqual(0, done.returncode, done.stderr)
        checks = {(c["subject"], c["name"]): c["value"] for c in json.loads(done.stdout)["checks"]}
        for technique in ("map", "translucent", "stochastic", "colored-stochastic", "composited",
                          "composited, faithful", "moments", "deep", "raytraced-shadows"):
            for quads in ("0 quads", "40 quads"):
                total, shadow, shading = (checks[quads, f"{technique}: {part}, cpu ms"]
                                          for part in ("total", "shadow", "shading"))
                # each is told with six digits
                self.assertAlmostEqual(total, shadow + shading, delta=2e-5 * max(total, shadow))
                self.assertGreater(min(total, shading), 0)

    def test_shadow_volumes_state_times_beside_maps_and_rays(self):
        done = measure("silhouettes", "--size", "64x48", "--seconds", "1")
        self.assertEqual(0, done.returncode, done.stderr)
        checks = {(c["subject"], c["name"]): c["value"] for c in json.loads(done.stdout)["checks"]}
        ways = ["map", "volume", "silhouette", "raytraced-shadows"]
        forms = [f"silhouette, {form}" for form in ("geometry", "tessellation",
                                                    "triangles-two-pass", "triangles-one-pass")]
        for triangles, count in (("2402 triangles", 4), ("4802 triangles", 2)):
            ms = {way: checks[triangles, f"{way}: total, cpu ms"] for way in ways + forms[:count]}
            self.assertGreater(min(ms.values()), 0)
            for form in forms[:count]:
                ratio = checks[triangles, f"{form}: over compute"]
                self.assertAlmostEqual(1, ratio * ms["silhouette"] / ms[form], places=3)

    def test_area_shadows_state_times_beside_rays(self):
        done = measure("area", "--size", "64x48", "--seconds", "1")
        self.assertEqual(0, done.returncode, done.stderr)
        checks = {(c["scene"], c["name"]): c["value"] for c in json.loads(done.stdout)["checks"]}
        for scene in ("spheres", "sticks"):
            for ratio in ("cpu area / rays", "cpu area, faithful / area",
                          "cpu area / rays, moving"):
                self.assertGreater(checks[scene, ratio], 0)

    def test_one_figure_that_moves_builds_the_shadow_that_it_casts(self):
        done = measure("skin", "--size", "64x36", "--seconds", "1")
        self.assertEqual(0, done.returncode, done.stderr)
        checks = {(c["subject"], c["name"]): c["value"] for c in json.loads(done.stdout)["checks"]}
        self.assertGreater(checks["pose alone", "million skinned vertices/s"], 0.1)
        self.assertEqual(1, checks["deep", "shadows built for it"])

    def test_ray_tracing_states_its_overhead_and_its_gain(self):
        done = measure("raytrace", "--size", "96x64")
        self.assertEqual(0, done.returncode, done.stderr)
        checks = json.loads(done.stdout)["checks"]
        overheads = [c["value"] for c in checks if c["name"] == "cpu ours / kernel alone"]
        self.assertEqual(2, len(overheads), checks)
        for value in overheads:
            self.assertTrue(0.5 < value < 20, checks)

    def test_rays_are_held_against_a_bare_ray_tracer(self):
        done = measure("traced", "--size", "64x48", "--seconds", "1")
        self.assertEqual(0, done.returncode, done.stderr)
        checks = {c["name"]: c["value"] for c in json.loads(done.stdout)["checks"]}
        self.assertTrue(0.5 < checks["cpu 1 sample / bare"] < 50, checks)
        self.assertGreater(checks["cpu 4 samples / 1 sample"], 1)

    def test_many_objects_share_draw_calls_and_most_are_culled_from_amid(self):
        done = measure("draws", "--size", "96x64")
        self.assertEqual(0, done.returncode, done.stderr)
        for result in json.loads(done.stdout)["results"]:
            counts = result["counts"]
            self.assertLess(counts["draw_calls"], 5)
            if result["variant"] == "from amid":
                self.assertGreater(counts["culled"], counts["draws"])
            if result["variant"] == "25 standing shadows":
                self.assertEqual(0, counts["shadow_maps_built"])
            if result["variant"] == "shadows rebuilt":
                self.assertGreater(counts["shadow_culled"], 0)

    def test_frames_ahead_are_compared_with_frames_in_turn(self):
        done = measure("ahead", "--size", "96x64", "--seconds", "1")
        self.assertEqual(0, done.returncode, done.stderr)
        document = json.loads(done.stdout)
        self.assertEqual({"in turn", "next one ahead"},
                         {result["variant"] for result in document["results"]})
        values = {check["name"]: check["value"] for check in document["checks"]}
        self.assertTrue(0.3 < values["frame cpu, ahead / in turn"] < 3, values)
        self.assertTrue(0 <= values["left after the last command, ms"] < 1000, values)

    def test_targets_state_their_bounds(self):
        done = measure("targets", "--size", "96x64", "--seconds", "1")
        self.assertEqual(0, done.returncode, done.stderr)
        checks = json.loads(done.stdout)["checks"]
        bounds = sorted(c["target"] for c in checks if "target" in c)
        self.assertEqual(["<= 1.05", *["<= 1.3"] * 3, "<= 1.5", "<= 2", "<= 3"], bounds)
        for check in checks:
            self.assertTrue(math.isfinite(check["value"]), check)
        alone = [c["value"] for c in checks if c["name"] == "lookups alone / those of the frame"]
        self.assertEqual(1, len(alone))
        self.assertAlmostEqual(1, alone[0], delta=0.01)  # the same points ask for the same lights

    def test_foliage_states_errors_and_bytes_of_each_setting(self):
        done = measure("foliage", "--size", "96x64", "--seconds", "1")
        self.assertEqual(0, done.returncode, done.stderr)
        document = json.loads(done.stdout)
        errors = {c["subject"]: c["value"] for c in document["checks"] if c["name"] == "RMSE"}
        self.assertEqual(15, len(errors))
        self.assertLess(errors["exact 512"], errors["none"])
        self.assertLess(errors["512, k 4"], errors["none"])

    def test_live_views_are_measured_alone_and_beside_others(self):
        done = run("live", "--quick", "--json", "--size", "96x64")
        self.assertEqual(0, done.returncode, done.stderr)
        document = json.loads(done.stdout)
        self.assertEqual(["", "slow", "rest", "render"], [r["beside"] for r in document["viewers"]])
        for row in document["viewers"]:
            self.assertGreater(row["frames"], 0)
            self.assertGreaterEqual(row["p95_ms"], row["p50_ms"])
            self.assertEqual(row["beside"] in ("rest", "render"), row["beside_frames"] > 0)
            self.assertGreater(row["mean_parts_ms"]["render"], 0)
            self.assertGreater(row["mean_parts_ms"]["socket"], 0)
        self.assertGreater(document["patch_p50_ms"], 0)

    def test_unknown_suites_and_options_are_refused(self):
        for arguments in (["nothing"], ["deep", "--frames", "0"], ["deep", "--size", "10"],
                          ["deep", "--no-such"], []):
            self.assertEqual(2, run(*arguments).returncode, arguments)


class Generated(unittest.TestCase):
    def test_auto_is_held_against_generated_scenes(self):
        done = run("auto", "--quick", "--json")
        self.assertEqual(0, done.returncode, done.stderr)
        document = json.loads(done.stdout)
        cases = document["results"][0]["cases"]
        self.assertEqual(2, len(cases))
        for case in cases:
            for technique in ("maps", "rays", "traced_shadows"):
                self.assertTrue(all(ms > 0 for ms in case[technique]), case["name"])
        self.assertEqual(3, len(document["checks"]))

    def test_promises_are_counted(self):
        done = run("promises", "--quick", "--json")
        self.assertEqual(0, done.returncode, done.stderr)
        document = json.loads(done.stdout)
        for wish in ("budget_ms", "max_error"):
            self.assertEqual(1, document["summary"][wish]["asked"])
        self.assertEqual(["budget_ms", "max_error"], [r["wish"] for r in document["results"]])
        for result in document["results"]:
            self.assertGreater(result["got"], 0)
        self.assertLess(document["results"][1]["got"], 0.5)

    def test_a_seed_that_is_none_is_refused(self):
        self.assertEqual(2, run("generate", "0", "/tmp/x.glb").returncode)
        self.assertEqual(2, run("generate", "7").returncode)


if __name__ == "__main__":
    unittest.main()
