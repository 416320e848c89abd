#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Draws models beside three.js's pictures of them, under one environment map and by one camera.

    npm install --prefix FOLDER three
    tests/page/compare_three.py BIN FOLDER/node_modules/three MODELS OUT [NAME ...]

BIN holds vitraild and vitrail, MODELS the folder with the models by others. Writes to OUT, for each
model, NAME-three.png, NAME-rasterised.png and NAME-raytraced.png, then sheet.webp with a row per
model, and prints the RMSE of either picture of ours against three.js's. Run by hand.

Both draw on a background of one grey, so that what shines through is the same. The middle of a map
is +X for three.js and -Z for us, hence the rotation.
"""
import base64
import functools
import http.server
import json
import math
import os
import subprocess
import sys
import tempfile
import threading

BIN, THREE, MODELS, OUT, *NAMES = sys.argv[1:]
sys.argv[1:] = [BIN]
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../http"))

import support
from browser import Browser, needs_browser
from image_files import read_png

needs_browser()
WIDTH, HEIGHT = 400, 300
GREY = 0.18  # of the background, linear

def binary(name):
    return f"{name}/glTF-Binary/{name}.glb"


FRONT = (0, 0, 1)
TESTS = {  # of materials: the file, and from which direction
    "MetalRoughSpheres": (binary("MetalRoughSpheresNoTextures"), FRONT),
    "ClearCoatTest": (binary("ClearCoatTest"), FRONT),
    "SpecularTest": (binary("SpecularTest"), FRONT),
    "SheenChair": ("SheenChair/glTF/SheenChair.gltf", (0.7, 0.5, 1)),
    "NormalTangentTest": (binary("NormalTangentTest"), FRONT),
    "TransmissionTest": (binary("TransmissionTest"), FRONT),
    "TransmissionRoughnessTest": (binary("TransmissionRoughnessTest"), FRONT),
    "AttenuationTest": (binary("AttenuationTest"), FRONT),
    "GlassVaseFlowers": (binary("GlassVaseFlowers"), (0.4, 0.3, 1)),
    "StainedGlassLamp":
        ("StainedGlassLamp/glTF-JPG-PNG/StainedGlassLamp-transmission.gltf", (0.3, 0.1, 1)),
    "ToyCar": ("ToyCar/glTF/ToyCar.gltf", (0.8, 0.6, 1)),
}
NEARER = 1.4  # than a camera that has the ball around the bounds in view
PAGE = """<!doctype html><meta charset="utf-8"><body style="margin:0">
<script type="importmap">{"imports": {"three": "/three/build/three.module.js",
 "three/addons/": "/three/examples/jsm/"}}</script>
<script type="module">
import * as THREE from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { HDRLoader } from 'three/addons/loaders/HDRLoader.js';
const renderer = new THREE.WebGLRenderer({antialias: true, preserveDrawingBuffer: true});
renderer.setSize(WIDTH, HEIGHT);
renderer.toneMapping = THREE.NeutralToneMapping;
document.body.append(renderer.domElement);
window.draw = async (file, towards, nearer) => {
  const gltf = await new GLTFLoader().loadAsync('/models/' + file);
  const map = await new HDRLoader().setDataType(THREE.FloatType).loadAsync('/map.hdr');
  map.mapping = THREE.EquirectangularReflectionMapping;
  const scene = new THREE.Scene();
  scene.environment = map;
  scene.background = new THREE.Color(GREY, GREY, GREY);
  scene.add(gltf.scene);
  gltf.scene.traverse((node) => { if (node.isLight) node.visible = false; });
  gltf.scene.updateMatrixWorld(true);
  const box = new THREE.Box3().setFromObject(gltf.scene, true);
  const middle = box.getCenter(new THREE.Vector3());
  const radius = box.getSize(new THREE.Vector3()).length() / 2;
  const fov = 30;
  const eye = new THREE.Vector3(...towards).normalize()
    .multiplyScalar(radius / Math.sin(fov * Math.PI / 360) / nearer).add(middle);
  const camera = new THREE.PerspectiveCamera(fov, WIDTH / HEIGHT, radius / 100, radius * 100);
  camera.position.copy(eye);
  camera.lookAt(middle);
  renderer.render(scene, camera);
  return {eye: eye.toArray(), target: middle.toArray(), fov, revision: THREE.REVISION,
    picture: renderer.domElement.toDataURL('image/png').split(',')[1]};
};
window.isReady = true;
</script>""".replace("WIDTH", str(WIDTH)).replace("HEIGHT", str(HEIGHT)).replace("GREY", str(GREY))


def map_bytes(width=512):
    """RGBE: a grey room with a warm box to the left, a cold one to the right, a white one above."""
    rows = []
    for y in range(width // 2):
        elevation = 90 - (y + 0.5) * 360 / width
        for x in range(width):
            azimuth = ((x + 0.5) / width - 0.5) * 360
            color = [0.4 + 0.2 * math.sin(math.radians(elevation))] * 3
            if abs(azimuth + 125) < 24 and abs(elevation - 35) < 22:
                color = [10, 8.5, 7]
            elif abs(azimuth - 115) < 16 and abs(elevation - 25) < 28:
                color = [3.5, 4, 5]
            elif elevation > 66:
                color = [4, 4, 4]
            exponent = math.frexp(max(color))[1]
            rows.append(bytes([*(int(c * 256 / 2 ** exponent) for c in color), exponent + 128]))
    head = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {width // 2} +X {width}\n".encode()
    return head + b"".join(rows)


class Files(http.server.SimpleHTTPRequestHandler):
    """The page, the map, the package of three.js and the models."""

    def translate_path(self, path):
        path = super().translate_path(path)
        inside = os.path.relpath(path, self.directory)
        for name, folder in (("three", THREE), ("models", MODELS)):
            if inside.startswith(name + os.sep):
                return os.path.join(folder, os.path.relpath(inside, name))
        return path

    def log_message(self, *_):
        pass


def contents(path):
    with open(path, "rb") as file:
        return file.read()


def rmse(a, b):
    """Of two pictures of 8 bits, over R, G and B, where 1 is white."""
    steps = len(a[3]) // (WIDTH * HEIGHT), len(b[3]) // (WIDTH * HEIGHT)
    total = sum((a[3][i * steps[0] + k] - b[3][i * steps[1] + k]) ** 2
                for i in range(WIDTH * HEIGHT) for k in range(3))
    return math.sqrt(total / (3 * WIDTH * HEIGHT)) / 255


def ours(name, file, camera, technique, options):
    """Draws one model; the path of its picture."""
    path = os.path.join(OUT, f"{name}-{technique}.png")
    eye, target = (",".join(f"{x:.9g}" for x in camera[key]) for key in ("eye", "target"))
    subprocess.run(
        [os.path.join(BIN, "vitrail"), "render", os.path.join(MODELS, file), "-o", path,
         "--size", f"{WIDTH}x{HEIGHT}",
         "--camera", f"eye={eye} target={target} fov={camera['fov']}",
         "--environment", MAP, "--environment-rotation", "-90", "--no-scene-lights",
         "--background", f"{GREY},{GREY},{GREY},1", "--exposure", "0", "--quiet",
         "--server", SERVER, *options], check=True)
    return path


def write_sheet(browser, rows):
    """A picture with a row for each model, made by the browser."""
    def image(path):
        content = base64.b64encode(contents(path)).decode()
        return f'<td><img src="data:image/png;base64,{content}">'
    head = "".join(f"<td>{kind}" for kind in ("three.js", "rasterised", "ray traced"))
    body = "".join(f"<tr><th>{name}{''.join(map(image, paths))}" for name, paths in rows)
    style = ("*{margin:0;font:14px sans-serif}body{background:#fff}table{border-spacing:2px}"
             "th{writing-mode:vertical-rl;padding:2px}"
             f"img{{display:block;width:{WIDTH * 3 // 4}px}}")
    with open(os.path.join(FOLDER, "sheet.html"), "w", encoding="utf-8") as file:
        file.write(f"<style>{style}</style><table><tr><td>{head}{body}</table>")
    browser.go(f"{ADDRESS}/sheet.html")
    browser.wait("return [...document.images].every((i) => i.complete)", "pictures")
    width, height = browser.run("const t = document.querySelector('table').getBoundingClientRect();"
                                "return [Math.ceil(t.width), Math.ceil(t.height)]")
    browser.cdp("Emulation.setDeviceMetricsOverride",
                width=width, height=height, deviceScaleFactor=1, mobile=False)
    shown = browser.cdp("Page.captureScreenshot", format="webp", quality=80)
    with open(os.path.join(OUT, "sheet.webp"), "wb") as file:
        file.write(base64.b64decode(shown["data"]))


def compare(browser):
    rows = []
    for name in NAMES or TESTS:
        file, towards = TESTS[name]
        browser.go(f"{ADDRESS}/page.html")
        browser.wait("return window.isReady", "three.js")
        drawn = browser.run("return window.draw(...arguments)", file, towards, NEARER)
        path = os.path.join(OUT, f"{name}-three.png")
        with open(path, "wb") as picture:
            picture.write(base64.b64decode(drawn["picture"]))
        paths = [path,
                 ours(name, file, drawn, "rasterised", ["--shadows", "deep", "--samples", "4"]),
                 ours(name, file, drawn, "raytraced",
                      ["--shadows", "raytraced", "--samples", "4", "--environment-samples", "64"])]
        theirs, *mine = (read_png(contents(path)) for path in paths)
        print(json.dumps({"model": name, "three": drawn["revision"],
                          "rasterised": round(rmse(theirs, mine[0]), 4),
                          "raytraced": round(rmse(theirs, mine[1]), 4)}), flush=True)
        rows.append((name, paths))
    write_sheet(browser, rows)


os.makedirs(OUT, exist_ok=True)
with tempfile.TemporaryDirectory(prefix="vitrail-three-") as FOLDER:
    MAP = os.path.join(FOLDER, "map.hdr")
    with open(MAP, "wb") as map_file:
        map_file.write(map_bytes())
    with open(os.path.join(FOLDER, "page.html"), "w", encoding="utf-8") as page_file:
        page_file.write(PAGE)
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0),
                                             functools.partial(Files, directory=FOLDER))
    ADDRESS = f"http://127.0.0.1:{server.server_port}"
    threading.Thread(target=server.serve_forever, daemon=True).start()
    with support.Daemon(program=os.path.join(BIN, "vitraild")) as daemon, \
            Browser(width=WIDTH, height=HEIGHT, webgl=True) as window:
        daemon.wait_device()
        SERVER = f"http://127.0.0.1:{daemon.port}"
        compare(window)
    server.shutdown()
