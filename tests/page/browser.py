# SPDX-License-Identifier: MIT
"""A headless Chromium, driven by ChromeDriver over WebDriver (W3C), with the standard library."""
import base64
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request

CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")
DRIVER = shutil.which("chromedriver")
ELEMENT = "element-6066-11e4-a52e-4f735466cecf"  # the key that the standard gives to references
KEYS = {"Tab": "\ue004", "Enter": "\ue007", "Escape": "\ue00c", "Left": "\ue012", "Up": "\ue013",
        "Right": "\ue014", "Down": "\ue015", "Home": "\ue011", "End": "\ue010", "Shift": "\ue008",
        "Control": "\ue009", "Space": " "}


def needs_browser():
    """Skips the whole file where there is no browser."""
    if not CHROMIUM or not DRIVER:
        print("skipped: chromium and chromium-driver are not installed")
        sys.exit(77)


class Browser:
    """One window. Leaves nothing behind."""

    def __init__(self, width=1280, height=800, phone=False, dark=True, webgl=False):
        self.folder = tempfile.TemporaryDirectory(prefix="vitrail-page-")
        self.driver = subprocess.Popen(
            [DRIVER, "--port=0", "--log-level=SEVERE"], stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL, env={**os.environ, "TMPDIR": self.folder.name})
        self.url = None
        for line in self.driver.stdout:
            words = line.decode().split(" successfully on port ")
            if len(words) == 2:
                self.url = f"http://127.0.0.1:{words[1].strip().rstrip('.')}"
                break
        if not self.url:
            raise RuntimeError("chromedriver did not start")
        options = {
            "binary": CHROMIUM,
            "args": ["--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage",
                     "--hide-scrollbars", "--force-color-profile=srgb", "--no-first-run",
                     "--disable-background-networking", "--disable-component-update",
                     f"--user-data-dir={self.folder.name}/profile",
                     f"--window-size={width},{height}"],
        }
        if webgl:  # on the processor
            options["args"] += ["--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
        if phone:
            options["mobileEmulation"] = {"deviceMetrics": {
                "width": width, "height": height, "pixelRatio": 1.0, "touch": True}}
        self.session = ""
        made = self.call("POST", "/session", {"capabilities": {"alwaysMatch": {
            "browserName": "chrome", "goog:chromeOptions": options,
            "goog:loggingPrefs": {"browser": "ALL"}}}})
        self.session = f"/session/{made['sessionId']}"
        self.call("POST", f"{self.session}/timeouts", {"script": 110000})
        self.scheme("dark" if dark else "light")
        if not phone:
            self.cdp("Emulation.setDeviceMetricsOverride",
                     width=width, height=height, deviceScaleFactor=1, mobile=False)

    def call(self, method, path, members=None):
        body = None if members is None else json.dumps(members).encode()
        request = urllib.request.Request(self.url + path, body, method=method,
                                         headers={"Content-Type": "application/json"})
        try:
            with urllib.request.urlopen(request, timeout=120) as reply:
                return json.load(reply)["value"]
        except urllib.error.HTTPError as refusal:
            value = json.load(refusal)["value"]
            message = f"{path.rsplit('/', 1)[1]}: {value['message']}"
            raise AssertionError(message.splitlines()[0]) from None

    def cdp(self, command, **parameters):
        return self.call("POST", f"{self.session}/goog/cdp/execute",
                         {"cmd": command, "params": parameters})

    def scheme(self, name, motion="no-preference"):
        self.cdp("Emulation.setEmulatedMedia", features=[
            {"name": "prefers-color-scheme", "value": name},
            {"name": "prefers-reduced-motion", "value": motion}])

    def go(self, url):
        self.call("POST", f"{self.session}/url", {"url": url})

    def run(self, script, *arguments):
        """The value of a JavaScript function body; promises are waited for."""
        return self.call("POST", f"{self.session}/execute/sync",
                         {"script": script, "args": list(arguments)})

    def find(self, selector):
        return self.call("POST", f"{self.session}/element",
                         {"using": "css selector", "value": selector})[ELEMENT]

    def click(self, selector):
        self.call("POST", f"{self.session}/element/{self.find(selector)}/click", {})

    def type(self, selector, text):
        """Types into an element; the name of a file into a file input chooses it."""
        self.call("POST", f"{self.session}/element/{self.find(selector)}/value", {"text": text})

    def keys(self, *names, hold=None):
        """Presses keys one after the other, wherever the focus is; names as in KEYS, or letters."""
        actions = [{"type": "keyDown", "value": KEYS[hold]}] if hold else []
        for name in names:
            value = KEYS.get(name, name)
            actions += [{"type": "keyDown", "value": value}, {"type": "keyUp", "value": value}]
        if hold:
            actions.append({"type": "keyUp", "value": KEYS[hold]})
        self.actions([{"type": "key", "id": "keys", "actions": actions}])

    def drag(self, start, end, kind="mouse", button=0, steps=6, hold=None):
        """A press at one point of the window and a release at another; no way is a click."""
        way = [(start[0] + (end[0] - start[0]) * i / steps,
                start[1] + (end[1] - start[1]) * i / steps) for i in range(1, steps + 1)]
        self.drag_along([start, *(way if start != end else [])], kind, button, hold)

    def drag_along(self, points, kind="mouse", button=0, hold=None):
        """A press at the first of some points, moves through the others; hold names a key."""
        moves = [{"type": "pointerMove", "duration": 30 if i else 0, "x": round(x), "y": round(y)}
                 for i, (x, y) in enumerate(points)]
        pointer = [moves[0], {"type": "pointerDown", "button": button}, *moves[1:],
                   {"type": "pointerUp", "button": button}]
        keys = [{"type": "pause"} for _ in pointer]
        if hold:
            keys[0] = {"type": "keyDown", "value": KEYS[hold]}
            keys.append({"type": "keyUp", "value": KEYS[hold]})
        self.actions([{"type": "pointer", "id": kind, "parameters": {"pointerType": kind},
                       "actions": pointer}, {"type": "key", "id": "keys", "actions": keys}])

    def drop(self, point, *paths):
        """Drops files or folders of this machine at a point of the window."""
        for kind in ("dragEnter", "dragOver", "drop"):
            self.cdp("Input.dispatchDragEvent", type=kind, x=round(point[0]), y=round(point[1]),
                     data={"items": [], "files": list(paths), "dragOperationsMask": 1})

    def actions(self, sources):
        self.call("POST", f"{self.session}/actions", {"actions": sources})

    def wait(self, script, what, timeout_s=40):
        """Until a JavaScript function body answers something true, which is returned."""
        deadline = time.monotonic() + timeout_s
        while not (value := self.run(script)):
            if time.monotonic() > deadline:
                raise AssertionError(f"not within {timeout_s} s: {what}; {self.log()[-4:]}")
            time.sleep(0.05)
        return value

    def log(self):
        """What the console said since the last call."""
        entries = self.call("POST", f"{self.session}/se/log", {"type": "browser"})
        return [f"{entry['level']} {entry['message']}" for entry in entries]

    def screenshot(self, path):
        png = base64.b64decode(self.call("GET", f"{self.session}/screenshot"))
        with open(path, "wb") as file:
            file.write(png)

    def close(self):
        try:
            if self.session:
                self.call("DELETE", self.session)
        finally:
            self.driver.terminate()
            self.driver.wait(20)
            self.driver.stdout.close()
            self.folder.cleanup()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()
