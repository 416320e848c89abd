# SPDX-License-Identifier: MIT
"""Every member of every body with values that it cannot have: what the OpenAPI document refuses is
refused, at its place, and what the daemon refuses it names."""
import http.client
import json
import os

import support
from support import triangle

support.needs(support.FAKE)

UNIT = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]
NUMBERS = (0, -1, 1, 3, 1.5, 91, 180, 257, 16385, 1e9, 1.1e12, 1e300, 2**53)
VALUES = (None, True, *NUMBERS, "", "x", "png", "A" * 1025, "\u00e9" * 513, [], [0] * 3, [2] * 4,
          [-1e13] * 3, [0] * 16, ["a"] * 3, [None] * 3, {}, {"x": 1}, [[]], [{}])


def light(kind, **more):
    return {"type": kind, "position": [0, 4, 0], "direction": [0, -1, 0], **more}


def members(scene):
    """All members that renders, views and trade-offs share."""
    return {
        "scene": scene, "width": 16, "height": 12, "scene_lights": True, "studio": "on",
        "camera": {"eye": [0, 0, 5], "target": [0, 0, 0], "up": [0, 1, 0], "fov_y_deg": 40,
                   "ortho_height": 3},
        "lights": [light("spot", color=[1, 1, 1], intensity=8, inner_cone_deg=2, outer_cone_deg=35,
                         range=3, shadow=True, up=[1, 0, 0]),
                   light("rect", width=1, height=1), light("disk", radius=1)],
        "overrides": {
            "nodes": {"Triangle": {"visible": True, "matrix": UNIT}},
            "materials": {"#0": {
                "base_color": [1, 1, 1, 1], "metallic": 0, "roughness": 1, "emissive": [0, 0, 0],
                "transmission": 0, "ior": 1.5, "thickness": 0, "attenuation_color": [1, 1, 1],
                "attenuation_distance": 1, "alpha_mode": "blend", "self_shadow": True,
                "cast_once": True, "pass_through": {
                    "model": "edge", "edge_color": [1, 1, 1], "edge_exponent": 2}}},
            "grids": {"#0": {"density": 2, "extinction": [1, 2, 3], "color": [1, 1, 0.5],
                             "anisotropy": -0.5}}},
        "parts": {"p": {"scene": scene, "parent": "Triangle", "matrix": UNIT, "visible": True}},
        "clip_planes": [[0, 1, 0, 2], {"plane": [0, 1, 0, 2], "shadows": True, "cap": [1, 0, 0]}],
        "ground_plane": {"height": -1.5},
        "atmosphere": {"density": 0.05, "color": [1, 1, 0.5], "anisotropy": -0.5, "falloff_m": 8,
                       "base_m": 1},
        "highlight": {"nodes": ["Triangle"], "color": [1, 0, 0], "width_px": 2, "hidden": 0.5},
        "edges": {"crease_deg": 30, "borders": True, "silhouettes": True, "color": [0, 0, 0],
                  "width_px": 1, "hidden": 0},
        "background": [0, 0, 0, 0], "environment": {
            "sky": [1, 1, 1], "ground": [0, 0, 0], "image": "studio", "rotation_deg": 10,
            "intensity": 2, "background": True},
        "exposure_ev": 1, "tone_mapping": "none",
        "quality": {"shadows": "deep", "transparency": "lists", "light_lists": "clustered",
                    "blend_filter": "tint", "shadow_resolution": 64, "shadow_taps": 4, "samples": 1,
                    "shadow_prefilter": 1, "shadow_compression": 0.01, "shadow_fallback": 0.01,
                    "area_samples": 4, "environment_samples": 4, "atmosphere_samples": 20,
                    "environment_visibility": "rays",
                    "refraction": "auto", "refraction_samples": 4, "faithful": False,
                    "volume_map": "factors", "silhouette_form": "geometry"},
    }


def places(value, path=()):
    """Paths to everything in a body, and to a member that each object lacks."""
    if path:
        yield path
    if isinstance(value, dict):
        for key, member in value.items():
            yield from places(member, (*path, key))
        yield (*path, "nonsense")
    elif isinstance(value, list):
        for i, element in enumerate(value if len(value) < 16 else value[:2]):
            yield from places(element, (*path, i))


def changed(body, path, value):
    body = json.loads(json.dumps(body))  # which shares nothing
    at = body
    for key in path[:-1]:
        at = at[key]
    at[path[-1]] = value
    return body


class Members(support.ServiceTest):
    def setUp(self):
        smoke = {"size": [8, 8, 8], "min": [0, 0, 0], "max": [1, 1, 1],
                 "procedure": {"type": "fog"}}  # no node shows it
        self.scene = self.daemon.push(triangle(
            materials=[{"name": "M"}], extensionsUsed=["VITRAIL_density_grids"],
            extensions={"VITRAIL_density_grids": {"grids": [smoke]}}))
        self.connection = http.client.HTTPConnection("127.0.0.1", self.daemon.port, timeout=60)
        self.addCleanup(self.connection.close)

    def send(self, method, path, body=None):
        text = None if body is None else json.dumps(body)
        self.connection.request(method, path, text, {"Content-Type": "application/json"})
        reply = support.Reply(self.connection.getresponse())
        self.assertEqual([], self.daemon.api.faults(method, path, reply))
        return reply

    def is_described(self, schema, body):
        named = {"$ref": f"#/components/schemas/{schema}"}
        return not list(self.daemon.api.schemas.check(body, named))

    def sweep(self, schema, body, send):
        self.assertTrue(self.is_described(schema, body))
        reply = send(body)
        self.assertLess(reply.status, 300, reply.body)
        before = len(os.listdir(f"/proc/{self.daemon.process.pid}/fd"))
        for path in places(body):
            for value in VALUES:
                bad = changed(body, path, value)
                reply = send(bad)
                what = (path, value, reply.body)
                if reply.status < 300:
                    self.assertTrue(self.is_described(schema, bad), what)
                    continue
                self.assertIn(reply.status, (400, 404, 413, 422), what)
                self.assertIn("pointer", reply.json(), what)
                self.assertEqual(str(path[0]), reply.json()["pointer"].split("/")[1], what)
        self.assertLessEqual(len(os.listdir(f"/proc/{self.daemon.process.pid}/fd")), before + 4)
        self.assert_serves()

    def test_members_of_a_render(self):
        body = {**members(self.scene), "outputs": ["color", "depth"], "format": "exr"}
        self.sweep("RenderRequest", body,
                   lambda bad: self.send("POST", "/v1/renders?explain=json", bad))

    def test_members_of_a_new_view(self):
        stream = {"budget_ms": 50, "min_scale": 0.25, "format": "webp", "quality_percent": 80,
                  "rest_format": "webp", "rest_ms": 100, "rest_samples": 16}

        def make(bad):
            reply = self.send("POST", "/v1/views", bad)
            if reply.status == 201:
                self.send("DELETE", f"/v1/views/{reply.json()['id']}")
            return reply
        self.sweep("View", {**members(self.scene), "stream": stream}, make)

    def test_members_of_a_patch(self):
        view = self.send("POST", "/v1/views", members(self.scene)).json()["id"]
        body = members(self.scene)
        body["lights"] = {str(i): one for i, one in enumerate(body["lights"])}
        del body["scene"]
        gone = {name: None for name in body}
        first = {"lights": members(self.scene)["lights"]}

        def patch(bad):
            reply = self.send("PATCH", f"/v1/views/{view}", bad)
            if reply.status == 200:  # as it was, so that each begins with the same
                self.send("PATCH", f"/v1/views/{view}", {**gone, **first})
            return reply
        self.sweep("ViewPatch", body, patch)

    def test_members_of_a_tradeoff(self):
        options = {"time_budget_s": 1, "repeats": 1, "max_settings": 1, "reference_samples": 16,
                   "keep_images": False}

        def start(bad):
            reply = self.send("POST", "/v1/tradeoffs", bad)
            if reply.status == 202:
                path = f"/v1/tradeoffs/{reply.json()['id']}"
                self.send("DELETE", path)
            return reply
        body = {"scene": self.scene, "width": 16, "height": 12, "tradeoff": options}
        self.sweep("TradeoffRequest", body, start)


if __name__ == "__main__":
    support.run_tests()
