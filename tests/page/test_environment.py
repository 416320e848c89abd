# SPDX-License-Identifier: MIT
"""Environment maps on the page: the studio, files that are brought or dropped, and undo."""
import os
import tempfile

from page import PageTest, support


def hdr(width, height):
    return (b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n" % (height, width)
            + bytes((128, 64, 32, 129)) * (width * height))


class Environment(PageTest):
    def setUp(self):
        super().setUp()
        for one in self.daemon.request("GET", "/v1/environments").json()["environments"]:
            self.daemon.request("DELETE", "/v1/environments/" + one["id"])

    def lights(self):
        self.load()
        self.panel("lights")

    def light(self):
        return self.view()["environment"]

    def choices(self):
        return self.browser.run("""
          const select = [...document.querySelectorAll('#panel-lights select')]
            .find((one) => one.labels[0].textContent === 'Map');
          return [...select.options].map((option) => option.textContent);""")

    def check(self, label):
        self.browser.run("""
          const input = [...document.querySelectorAll('#panel-lights input[type=checkbox]')]
            .find((one) => one.labels[0].textContent === arguments[0]);
          input.click();""", label)

    def test_studio_lighting_is_a_switch(self):
        self.lights()
        self.changed_by(lambda: self.enter("Studio lighting", "on", "#panel-lights"))
        self.assertEqual("on", self.view()["studio"])
        self.changed_by(lambda: self.press("Undo"))
        self.assertEqual("auto", self.view()["studio"])

    def haze_is(self, wanted):
        """Waits until the view's haze is that: members of it, or None."""
        def is_so():
            haze = self.view()["atmosphere"]
            return haze is None if wanted is None else haze and wanted.items() <= haze.items()
        support.wait_until(is_so, f"the haze is {wanted}")

    def test_haze_fills_the_space_as_its_sliders_say(self):
        self.lights()
        self.assertIsNone(self.view()["atmosphere"])
        self.changed_by(lambda: self.check("Fill space with haze"))
        self.assertLess(0, self.view()["atmosphere"]["density"])
        for label, value in (("Density", 0.25), ("Onwards or back", -0.5), ("Thins out within", 8),
                             ("Above height", 1.5)):
            self.enter(label, value, "#panel-lights")
        self.browser.run("""
          const input = [...document.querySelectorAll('#panel-lights input[type=color]')]
            .find((one) => one.labels[0].textContent === 'Colour of the haze');
          input.value = '#ff0000';
          input.dispatchEvent(new Event('input'));""")
        self.haze_is({"density": 0.25, "color": [1, 0, 0], "anisotropy": -0.5, "falloff_m": 8,
                      "base_m": 1.5})
        self.check("Fill space with haze")
        self.haze_is(None)
        self.press("Undo")
        self.haze_is({"density": 0.25, "color": [1, 0, 0]})

    def test_smoke_has_sliders_of_its_own(self):
        scene = self.daemon.push(support.triangle(  # no node shows it: drawing it takes long
            extensionsUsed=["VITRAIL_density_grids"],
            extensions={"VITRAIL_density_grids": {"grids": [
                {"name": "plume", "size": [8, 8, 8], "min": [0, 0, 0], "max": [1, 1, 1],
                 "density": 5, "procedure": {"type": "smoke"}}]}}))
        self.load(scene=scene)
        self.panel("lights")

        def grids_are(wanted):
            support.wait_until(lambda: self.view()["overrides"]["grids"] == wanted,
                               f"the grids are {wanted}")
        self.enter("Density of the smoke", 2.5, "#panel-lights")
        grids_are({"#0": {"density": 2.5}})
        self.enter("Smoke scatters onwards or back", 0.5, "#panel-lights")
        grids_are({"#0": {"density": 2.5, "anisotropy": 0.5}})
        self.press("As in the file")
        grids_are({})
        self.press("Undo")
        grids_are({"#0": {"density": 2.5, "anisotropy": 0.5}})

    def test_the_studio_lights_the_view_and_undo_takes_it_back(self):
        self.lights()
        self.assertEqual(["None", "Studio"], self.choices())
        self.changed_by(lambda: self.enter("Map", "studio", "#panel-lights"))
        self.changed_by(lambda: self.enter("Map rotation", 30, "#panel-lights"))
        self.changed_by(lambda: self.check("Show it behind the scene"))
        shown = self.changed_by(lambda: self.enter("Map intensity", 2.5, "#panel-lights"))
        map_ = {"image": "studio", "rotation_deg": 30, "intensity": 2.5, "background": True}
        self.assertEqual({"sky": [0, 0, 0], "ground": [0, 0, 0], **map_}, self.light())
        self.assertEqual(shown, self.reload_link())
        self.assertEqual("studio", self.light()["image"])
        self.panel("lights")
        self.changed_by(lambda: self.check("Light from everywhere"))
        self.assertLess(0, self.light()["sky"][0])
        self.assertEqual("studio", self.light()["image"])
        self.changed_by(lambda: self.enter("Map", "", "#panel-lights"))
        self.assertNotIn("image", self.light())
        self.changed_by(lambda: self.press("Undo"))
        self.assertEqual("studio", self.light()["image"])
        self.changed_by(lambda: self.enter("Map", "", "#panel-lights"))
        self.changed_by(lambda: self.check("Light from everywhere"))
        self.assertIsNone(self.light())

    def test_a_map_that_is_dropped_is_uploaded_and_lights_the_view(self):
        self.lights()
        content = hdr(8, 4)
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "dusk.hdr")
            with open(path, "wb") as file:
                file.write(content)
            self.changed_by(lambda: self.browser.drop(self.center(), path))
        self.assertEqual(support.sha256(content), self.light()["image"])
        self.assertEqual(["None", "Studio", "dusk.hdr"], self.choices())

    def test_a_file_that_is_no_map_is_said_and_changes_nothing(self):
        self.expects_refusal = True
        self.lights()
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "broken.hdr")
            with open(path, "wb") as file:
                file.write(hdr(8, 4)[:-5])
            self.browser.drop(self.center(), path)
            self.browser.wait("""return document.body.innerText
              .includes('broken.hdr could not be taken')""", "the refusal is said")
        self.assertIsNone(self.light())

    def test_a_map_that_is_gone_is_left_out(self):
        self.expects_refusal = True
        self.lights()
        self.assertEqual(201, self.daemon.request("POST", "/v1/environments?name=day", hdr(6, 3), {
            "Content-Type": "image/vnd.radiance"}).status)
        self.load("?again=1")
        self.panel("lights")
        environment = support.sha256(hdr(6, 3))
        self.changed_by(lambda: self.enter("Map", environment, "#panel-lights"))
        self.assertEqual(environment, self.light()["image"])
        self.daemon.request("DELETE", "/v1/environments/" + environment)
        self.reload_link()
        self.assertIn("The environment map is gone",
                      self.browser.run("return document.body.innerText"))
        self.assertIsNone(self.light())


if __name__ == "__main__":
    support.run_tests()
