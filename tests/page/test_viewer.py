# SPDX-License-Identifier: MIT
"""The viewer in a real browser over the real daemon: what a person does, and what comes of it."""
import json
import math
import os
import tempfile

from page import PageTest, support


class Looking(PageTest):
    def test_the_page_shows_the_scene_of_its_link_and_names_it(self):
        picture = self.load()
        self.assertGreater(len(picture), 3000)
        self.assertEqual("room.glb – Vitrail", self.browser.run("return document.title"))
        self.assertIn("room.glb", self.browser.run(
            "return document.getElementById('picture').getAttribute('aria-label')"))

    def test_dragging_orbits_and_the_wheel_zooms(self):
        first = self.load()
        x, y = self.center()
        orbited = self.changed_by(lambda: self.browser.drag((x, y), (x + 120, y - 30)))
        self.assertNotEqual(first, orbited)
        zoomed = self.changed_by(lambda: self.browser.actions([{
            "type": "wheel", "id": "wheel", "actions": [{
                "type": "scroll", "x": round(x), "y": round(y), "deltaX": 0, "deltaY": -240}]}]))
        self.assertNotEqual(orbited, zoomed)

    def test_a_link_brings_back_exactly_the_same_picture(self):
        self.load()
        x, y = self.center()
        picture = self.changed_by(lambda: self.browser.drag((x, y), (x - 90, y + 20)))
        self.assertEqual(picture, self.reload_link())
        self.assertIn("&view=", self.browser.run("return location.href"))

    def test_standard_views_and_orthographic_change_the_picture_and_fit_keeps_the_direction(self):
        self.load()
        front = self.changed_by(lambda: self.browser.run("""
          const select = document.querySelector('[aria-label="Standard views"]');
          select.value = 'front'; select.dispatchEvent(new Event('change'));"""))
        flat = self.changed_by(lambda: self.press("Orthographic (O)"))
        self.assertNotEqual(front, flat)
        back = self.changed_by(lambda: self.press("Orthographic (O)"))
        self.assertEqual(front, back)

    def test_the_picture_at_rest_is_refined_and_a_control_changes_that(self):
        refined = self.load()
        self.panel("render")
        told = "return document.getElementById('status-frame').textContent"
        self.assertIn("refined", self.browser.run(told))
        choose = """const labels = [...document.querySelectorAll('#panel-render label')];
          const label = labels.find((one) => one.textContent.startsWith('Samples at rest'));
          const select = document.getElementById(label.htmlFor);
          select.value = arguments[0]; select.dispatchEvent(new Event('change'));"""
        exact = self.changed_by(lambda: self.browser.run(choose, "0"))
        self.assertIn("exact", self.browser.run(told))
        self.assertNotEqual(refined, exact)
        self.assertEqual(refined, self.changed_by(lambda: self.browser.run(choose, "16")))

    def test_every_line_shows_the_same_exact_picture(self):
        pictures = [self.load(f"?line={line}") for line in ("socket", "stream", "stills")]
        self.assertEqual(pictures[0], pictures[1])
        self.assertEqual(pictures[0], pictures[2])
        self.assertEqual("stills", self.browser.run(
            "return document.getElementById('status-link').textContent"))

    def views(self):
        return self.daemon.request("GET", "/v1/views").json()["views"]

    def test_a_page_that_is_left_forgets_its_view(self):
        self.load()
        self.assertEqual([60], [view["expires_s"] for view in self.views()])
        self.browser.run("dispatchEvent(new PageTransitionEvent('pagehide'))")
        support.wait_until(lambda: not self.views(), "the view is deleted")

    def test_pages_that_were_left_leave_no_view_behind(self):
        for turn in range(3):
            self.load(f"?turn={turn}")
        self.browser.go("about:blank")
        # a busy browser may end the page before it has said anything: the view then expires
        support.wait_until(lambda: not self.views(), "no view is left behind", timeout_s=90)

    def test_statistics_tell_the_passes_of_the_frame(self):
        self.load()
        self.press("Statistics (I)")
        text = self.browser.wait("return document.querySelector('#overlay table')?.innerText",
                                 "the passes are listed")
        self.assertRegex(text, r"shade|raytrace\.trace")  # auto takes what this device is faster at
        self.assertIn("ms", text)

    def test_two_techniques_are_compared_with_a_divider(self):
        self.load()
        self.press("Compare two techniques (C)")
        self.browser.wait("return document.getElementById('picture-b').dataset.exact === 'true'",
                          "the second picture is there")
        self.browser.run("document.getElementById('divider').focus()")
        self.browser.keys("Left", "Left")
        self.assertEqual("46", self.browser.run(
            "return document.getElementById('divider').getAttribute('aria-valuenow')"))
        self.press("Compare two techniques (C)")
        self.assertTrue(self.browser.run("return document.getElementById('divider').hidden"))


class Editing(PageTest):
    def test_a_click_picks_what_is_there_and_shows_its_properties(self):
        self.load()
        x, y = self.center()
        self.browser.drag((x, y), (x, y))
        text = self.browser.wait("""
          const text = document.getElementById('panel-properties').innerText;
          return text.includes('Clicked point') && text;""", "the hit is shown")
        self.assertIn("Pane material", text)
        self.assertIn("Room", text)
        self.assertFalse(self.browser.run("return document.getElementById('selection').hidden"))
        selected = self.browser.run(
            "return document.querySelector('[role=treeitem][aria-selected=true]')?.innerText")
        self.assertEqual("Pane", selected.strip())

    def test_hiding_a_part_changes_the_picture_and_undo_brings_it_back(self):
        first = self.load()
        self.panel("tree")
        hidden = self.changed_by(lambda: self.press("Hide Pane"))
        self.assertNotEqual(first, hidden)
        back = self.changed_by(lambda: self.press("Undo"))
        self.assertEqual(first, back)

    def test_a_material_edit_changes_the_picture_and_reset_takes_it_back(self):
        first = self.load()
        self.press("Pane material", "#panel-properties")
        edited = self.changed_by(lambda: self.browser.run("""
          const input = document.querySelector('#panel-properties input[type=color]');
          input.value = '#2040ff'; input.dispatchEvent(new Event('input'));"""))
        self.assertNotEqual(first, edited)
        back = self.changed_by(lambda: self.press("Reset", "#panel-properties"))
        self.assertEqual(first, back)

    def test_a_lobe_is_laid_over_a_material(self):
        first = self.load()
        self.press("Wall material", "#panel-properties")
        edited = self.changed_by(lambda: self.enter("Sheen roughness", "0.5", "#panel-properties")
                                 or self.enter("Clearcoat", "1", "#panel-properties"))
        self.assertNotEqual(first, edited)
        self.assertEqual({"sheen_roughness": 0.5, "clearcoat": 1},
                         self.view()["overrides"]["materials"]["#1"])
        self.assertEqual(first, self.changed_by(
            lambda: self.press("Reset", "#panel-properties")))

    def test_lights_are_edited_added_and_removed(self):
        first = self.load()
        self.panel("lights")
        dimmed = self.changed_by(lambda: self.browser.run("""
          const input = document.querySelector('#panel-lights .field-slider input[type=number]');
          input.value = '10'; input.dispatchEvent(new Event('change'));"""))
        self.assertNotEqual(first, dimmed)
        added = self.changed_by(lambda: self.press("Add a spot light"))
        self.assertNotEqual(dimmed, added)
        self.check_new_light()
        self.assertIn("Outer cone", self.browser.run(
            "return document.getElementById('panel-lights').innerText"))
        removed = self.changed_by(lambda: self.press("Remove", "#panel-lights"))
        self.assertEqual(dimmed, removed)
        back = self.changed_by(lambda: self.press("Lights as in the file"))
        self.assertEqual(first, back)

    def check_new_light(self):
        """It is in the picture, nearer than what the camera looks at, and shines there."""
        view = self.view()
        light, camera = view["lights"][-1], view["camera"]
        eye, target = camera["eye"], camera["target"]
        forward = [t - e for t, e in zip(target, eye)]
        to_light = [p - e for p, e in zip(light["position"], eye)]
        length = math.hypot(*forward)
        depth = sum(a * b for a, b in zip(to_light, forward)) / length
        self.assertAlmostEqual(0.75, depth / length, places=2)
        beside = math.sqrt(sum(v * v for v in to_light) - depth * depth)
        self.assertLess(beside, depth * math.tan(math.radians(camera["fov_y_deg"] / 2)))
        to_target = [t - p for t, p in zip(target, light["position"])]
        for got, expected in zip(light["direction"], to_target):
            self.assertAlmostEqual(expected / math.hypot(*to_target), got, places=6)
        self.assertAlmostEqual(3 * sum(v * v for v in to_target), light["intensity"],
                               delta=0.02 * light["intensity"])

    def test_a_clip_plane_cuts_and_flips(self):
        first = self.load()
        self.panel("section")
        cut = self.changed_by(lambda: self.press("Cut X"))
        flipped = self.changed_by(lambda: self.press("Flip"))
        self.assertEqual(3, len({first, cut, flipped}))

    def test_an_edit_that_the_server_refuses_is_said_and_taken_back(self):
        first = self.load()
        self.panel("render")
        self.changed_by(lambda: self.browser.run("""
          const select = document.querySelector('#panel-render select');
          select.value = 'none'; select.dispatchEvent(new Event('change'));"""))
        self.browser.run("return new Promise((done) => setTimeout(done, 1100))")  # another step
        self.browser.run("""
          const label = [...document.querySelectorAll('#panel-render .field-check label')]
            .find((one) => one.textContent.startsWith('Reference'));
          document.getElementById(label.htmlFor).click();""")
        text = self.browser.wait("return document.querySelector('.message')?.innerText",
                                 "a message")
        self.assertIn("The server refuses this view", text)
        self.assertIn("reference", text)
        self.browser.wait("""return ![...document.querySelectorAll('#panel-render input')]
          .some((input) => input.labels[0]?.textContent.startsWith('Reference')
            && input.checked);""", "the edit is undone")
        back = self.changed_by(lambda: self.press("Undo"))
        self.assertEqual(first, back)

    def test_an_automatic_exposure_leaves_its_number(self):
        self.load()
        self.panel("render")
        toggle = """const found = [...document.querySelectorAll('#panel-render label')]
          .find((each) => each.textContent === 'Automatic exposure');
          found.click();"""
        picture = self.changed_by(lambda: self.browser.run(toggle))
        self.assertEqual("auto", self.view()["exposure_ev"])
        self.browser.run(toggle)
        self.browser.wait("""return Number([...document.querySelectorAll('#panel-render input')]
          .find((each) => each.labels?.[0]?.firstChild.textContent === 'Exposure').value) !== 0;""",
                          "the number")
        self.assertEqual(picture, self.settle())
        number = self.view()["exposure_ev"]
        self.assertNotIn(number, ("auto", 0))
        self.changed_by(lambda: self.enter("Exposure", number + 1, "#panel-render"))
        self.assertAlmostEqual(number + 1, self.view()["exposure_ev"])

    def test_techniques_and_quality_reach_the_server(self):
        self.load()
        self.panel("render")
        names = self.browser.run("""return [...document.querySelector('#panel-render select')
          .options].map((option) => option.value);""")
        self.assertIn("deep", names)
        self.changed_by(lambda: self.browser.run("""
          const select = document.querySelector('#panel-render select');
          select.value = 'none'; select.dispatchEvent(new Event('change'));"""))
        self.press("Statistics (I)")
        text = self.browser.wait("return document.querySelector('#overlay table')?.innerText",
                                 "the passes are listed")
        self.assertNotIn("shadow", text)


class Keeping(PageTest):
    def test_a_picture_is_saved_at_the_size_and_in_the_format_asked_for(self):
        self.load()
        with tempfile.TemporaryDirectory() as folder:
            self.browser.cdp("Browser.setDownloadBehavior", behavior="allow", downloadPath=folder)
            self.press("Save the picture")
            self.browser.run("""
              const [format] = document.querySelectorAll('#help select');
              format.value = 'exr'; format.dispatchEvent(new Event('change'));
              const [width, height] = document.querySelectorAll('#help input');
              width.value = 64; width.dispatchEvent(new Event('change'));
              height.value = 48; height.dispatchEvent(new Event('change'));""")
            self.press("Save", "#help")
            path = os.path.join(folder, "room.exr")
            support.wait_until(lambda: os.path.exists(path), "the picture is saved")
            with open(path, "rb") as file:
                self.assertEqual(b"\x76\x2f\x31\x01", file.read(4))

    def test_saving_a_large_picture_says_how_far_it_is(self):
        self.load()
        with tempfile.TemporaryDirectory() as folder:
            self.browser.cdp("Browser.setDownloadBehavior", behavior="allow", downloadPath=folder)
            self.press("Save the picture")
            self.browser.run("""
              for (const input of document.querySelectorAll('#help input')) {
                input.value = 2000; input.dispatchEvent(new Event('change'));
              }
              window.told = [];
              const words = document.querySelector('#help .primary span');
              new MutationObserver(() => window.told.push(words.textContent)).observe(words,
                { childList: true, characterData: true, subtree: true });""")
            self.press("Save", "#help")
            path = os.path.join(folder, "room.png")
            support.wait_until(lambda: os.path.exists(path), "the picture is saved", 240)
            told = self.browser.run("return window.told")
        self.assertEqual("Rendering …", told[0])
        self.assertRegex(" ".join(told), r"(Shadows|Tracing rays|Shading), \d+ %")

    def test_trade_offs_are_measured_from_the_page(self):
        self.load()
        self.panel("render")
        self.press("Measure trade-offs")
        link = self.browser.wait("return document.querySelector('#help a')?.href", "a link")
        self.assertRegex(link, r"/v1/tradeoffs/[0-9a-f]+\?format=html$")
        made = "/v1/tradeoffs/" + link.rsplit("/", 1)[1].split("?")[0]
        self.press("Close", "#help")
        self.assertIn(self.daemon.request("GET", made).json()["state"], ("queued", "running"))
        self.assertLess(self.daemon.request("DELETE", made).status, 300)

    def test_measuring_trade_offs_can_be_stopped_from_the_page(self):
        self.load()
        self.panel("render")
        self.press("Measure trade-offs")
        link = self.browser.wait("return document.querySelector('#help a')?.href", "a link")
        self.press("Stop measuring", "#help")
        self.browser.wait("return /^cancelled, /.test(document.querySelector('#help p[role]')"
                          "?.textContent)", "it says that it is cancelled")
        made = "/v1/tradeoffs/" + link.rsplit("/", 1)[1].split("?")[0]
        self.assertEqual("cancelled", self.daemon.request("GET", made).json()["state"])

    def test_the_theme_is_chosen_by_its_button_and_kept(self):
        self.browser.scheme("dark")
        self.load()
        color = "return getComputedStyle(document.body).backgroundColor"
        dark = self.browser.run(color)
        self.press("Light, dark, or as the system")
        light = self.browser.run(color)
        self.assertNotEqual(dark, light)
        self.load()
        self.assertEqual(light, self.browser.run(color))
        self.browser.run("localStorage.clear()")


class Bringing(PageTest):
    expects_refusal = True

    def upload(self, files):
        with tempfile.TemporaryDirectory() as folder:
            for name, content in files.items():
                with open(os.path.join(folder, name), "wb") as file:
                    file.write(content)
            self.browser.type("#scene-files", "\n".join(os.path.join(folder, n) for n in files))
            return self.browser.wait("""
              const shown = document.querySelector('.message')?.innerText;
              return document.querySelector('.uploading') ? '' : shown || document.title;""",
                                     "the upload ended")

    def test_a_glb_is_uploaded_by_its_file_and_opened(self):
        self.load()
        self.upload({"triangle.glb": support.triangle("uploaded")})
        self.browser.wait("return document.title.startsWith('triangle.glb')", "the scene is open")
        self.panel("tree")
        self.assertIn("uploaded", self.browser.run(
            "return document.querySelector('[role=tree]').innerText"))

    def test_what_pictures_leave_out_of_a_file_is_said(self):
        self.load()
        hidden = "return document.getElementById('status-warnings').hidden"
        self.assertTrue(self.browser.run(hidden))
        self.upload({"warned.glb": support.triangle(extensionsUsed=["EXT_that_nobody_has"])})
        self.browser.wait("return !document.getElementById('status-warnings').hidden", "a warning")
        for where in ("getElementById('status-warnings').title",
                      "getElementById('panel-scenes').innerText"):
            self.assertIn("EXT_that_nobody_has", self.browser.run("return document." + where))

    def test_a_gltf_is_uploaded_with_its_files(self):
        self.load()
        document = support.triangle_document("with files")
        document["buffers"][0]["uri"] = "geometry.bin"
        self.upload({"scene.gltf": json.dumps(document).encode(), "geometry.bin": support.TRIANGLE})
        self.browser.wait("""return [...document.querySelectorAll('.scene-open strong')]
          .some((name) => name.textContent === 'scene.gltf');""", "the scene is listed")

    def test_a_broken_file_is_refused_in_words_that_can_be_closed(self):
        self.load()
        text = self.upload({"broken.glb": b"glTF" + bytes(40)})
        self.assertIn("broken.glb could not be opened", text)
        self.assertRegex(text, r"4\d\d \w+")
        self.press("Dismiss", "#messages")
        self.assertEqual(0, self.browser.run("return document.querySelectorAll('.message').length"))

    def test_a_scene_that_is_not_there_is_said_and_the_page_stays_usable(self):
        self.browser.go(f"http://127.0.0.1:{self.daemon.port}/#scene={'0' * 64}")
        text = self.browser.wait("return document.querySelector('.message')?.innerText",
                                 "a message")
        self.assertIn("404 not_found", text)
        self.browser.click(".scene-open")
        self.settle()


class Reaching(PageTest):
    def test_the_keyboard_alone_reaches_the_picture_and_moves_it(self):
        first = self.load()
        self.browser.keys("Tab")
        self.assertEqual("Skip to the picture", self.focus("textContent"))
        self.browser.keys("Enter", "Tab")
        self.assertEqual("surface", self.focus("id"))
        turned = self.changed_by(lambda: self.browser.keys("Left", "Left", "Up"))
        self.assertNotEqual(first, turned)
        flown = self.changed_by(lambda: self.browser.keys("4"))
        self.assertNotEqual(turned, flown)
        self.browser.keys("?")
        self.assertTrue(self.browser.run("return document.getElementById('help').open"))
        self.browser.keys("Escape")
        self.assertEqual("surface", self.focus("id"))

    def focus(self, member):
        return self.browser.run(f"return document.activeElement.{member}")

    def test_the_tree_is_walked_and_parts_hidden_by_keys(self):
        first = self.load()
        self.panel("tree")
        self.browser.run("document.querySelector('[role=treeitem][tabindex=\"0\"]').focus()")
        self.browser.keys("Down", "Down", "Down")
        self.assertEqual("Pane", self.focus("ariaLabel"))
        hidden = self.changed_by(lambda: self.browser.keys("Space"))
        self.assertNotEqual(first, hidden)
        self.assertEqual("Pane", self.focus("ariaLabel"))

    def test_tabs_are_switched_by_arrow_keys(self):
        self.load()
        self.browser.run("document.getElementById('tab-properties').focus()")
        self.browser.keys("Right")
        self.assertEqual("tab-lights", self.focus("id"))
        self.assertFalse(self.browser.run("return document.getElementById('panel-lights').hidden"))

    def test_every_control_has_a_name_and_every_reference_a_target(self):
        self.load()
        for panel in ("tree", "properties", "lights", "section", "render", "scenes"):
            self.panel(panel)
            self.assertEqual([], self.browser.run(LABELS), panel)

    def test_text_and_fields_stand_out_in_light_and_in_dark(self):
        for scheme in ("light", "dark"):
            self.browser.scheme(scheme, motion="reduce")
            self.load()
            self.press("Statistics (I)")
            self.enter("What the picture shows", "layers")
            self.press("Compare two techniques (C)")
            self.browser.wait("return document.querySelector('#overlay table')", "the passes")
            for panel in ("scenes", "tree", "properties", "lights", "section", "render"):
                self.panel(panel)
                if panel == "section":
                    self.press("Cut X")
                self.assertEqual([], self.browser.run(CONTRAST), f"{panel}, {scheme}")
            for dialog in ("Save the picture", "Keys and gestures (?)"):
                self.press(dialog)
                self.assertEqual([], self.browser.run(CONTRAST), f"{dialog}, {scheme}")
                self.browser.keys("Escape")

    def test_tab_reaches_one_tool_and_arrow_keys_the_others(self):
        self.load()
        self.browser.keys("Tab", "Tab")
        self.assertEqual("Fit (F)", self.focus("ariaLabel"))  # there is nothing to undo
        self.browser.keys("Left")
        self.assertEqual("Keys and gestures (?)", self.focus("ariaLabel"))
        self.browser.keys("Home", "Right")
        self.assertEqual("Standard views", self.focus("ariaLabel"))
        self.browser.keys("Right")  # and no other view is taken
        self.assertEqual("Orthographic (O)", self.focus("ariaLabel"))
        self.browser.keys("Tab")
        self.assertEqual("tab-scenes", self.focus("id"))
        self.browser.keys("Shift")
        self.assertEqual(1, self.browser.run("""return [...document
          .querySelectorAll('#toolbar :is(button, select)')].filter((e) => e.tabIndex === 0)
          .length"""))

    def test_the_help_begins_at_its_top(self):
        self.load()
        self.press("Keys and gestures (?)")
        self.assertEqual("help-title", self.focus("id"))
        self.assertEqual(0, self.browser.run("return document.getElementById('help').scrollTop"))


class Phone(PageTest):
    size = (390, 780)
    phone = True

    def test_nothing_is_wider_than_the_screen_and_touch_orbits(self):
        first = self.load()
        self.assertEqual(390, self.browser.run("return document.documentElement.scrollWidth"))
        wide = self.browser.run("""return [...document.querySelectorAll('body *')].filter((e) =>
          e.offsetParent && e.getBoundingClientRect().right > innerWidth + 1
          && !e.closest('.skip')).map((e) => e.outerHTML.slice(0, 80));""")
        self.assertEqual([], wide)
        x, y = self.center()
        turned = self.changed_by(lambda: self.browser.drag((x, y), (x + 80, y + 20), kind="touch"))
        self.assertNotEqual(first, turned)

    def test_panels_open_as_sheets_and_close_again(self):
        self.load()
        shown = "return document.querySelector('.dock-right .panels').getClientRects().length"
        self.assertEqual(0, self.browser.run(shown))
        self.panel("lights")
        self.assertEqual(1, self.browser.run(shown))
        self.settle()
        free = self.browser.run("""return document.querySelector('.dock-right .panels')
          .getBoundingClientRect().top - document.getElementById('stage')
          .getBoundingClientRect().bottom;""")
        self.assertAlmostEqual(0, free, delta=1)  # the picture is whole above the sheet
        self.assertIn("Lamp", self.browser.run(
            "return document.getElementById('panel-lights').innerText"))
        self.panel("lights")
        self.assertEqual(0, self.browser.run(shown))


# What a checker of accessibility would find first: names, references, unique ids.
LABELS = """
const faults = [];
const nameOf = (e) => (e.getAttribute('aria-label') ?? '').trim() || e.textContent.trim()
  || [...(e.labels ?? [])].map((l) => l.textContent).join('').trim()
  || (document.getElementById(e.getAttribute('aria-labelledby'))?.textContent ?? '').trim();
for (const e of document.querySelectorAll('button, input, select, textarea, a[href], dialog[open],'
    + '[role=tab], [role=slider], [role=tree], [role=treeitem], [role=img], [role=region], aside'))
  if (!nameOf(e) && e.getAttribute('aria-hidden') !== 'true')
    faults.push(e.outerHTML.slice(0, 120));
const seen = new Set();
for (const e of document.querySelectorAll('[id]')) {
  if (seen.has(e.id)) faults.push('id twice: ' + e.id);
  seen.add(e.id);
}
for (const name of ['aria-controls', 'aria-labelledby', 'aria-describedby', 'for'])
  for (const e of document.querySelectorAll(`[${name}]`))
    if (!document.getElementById(e.getAttribute(name)) && !e.matches('dialog:not([open])'))
      faults.push(`${name}: ${e.getAttribute(name)}`);
if (!document.documentElement.lang) faults.push('no language');
if (document.querySelectorAll('h1').length !== 1) faults.push('not one h1');
return faults;
"""

# Contrast of texts with the ground behind them, at least 4.5, and of fields with theirs, at least
# 3: WCAG 2.2, 1.4.3 and 1.4.11. Behind what is half transparent may be anything from black to
# white.
CONTRAST = """
const parse = (text) => (text.match(/[\\d.]+/g) ?? []).map(Number);
const light = ([r, g, b]) => [r, g, b].map((v) => (v /= 255) <= 0.04045 ? v / 12.92
  : ((v + 0.055) / 1.055) ** 2.4).reduce((sum, v, i) => sum + v * [0.2126, 0.7152, 0.0722][i], 0);
const grounds = (e) => {
  if (!e || e.id === 'stage') return [[0, 0, 0], [255, 255, 255]];
  const [r, g, b, a = 1] = parse(getComputedStyle(e).backgroundColor);
  return a === 1 ? [[r, g, b]] : grounds(e.parentElement).map((behind) =>
    [r, g, b].map((v, i) => a * v + (1 - a) * behind[i]));
};
const ratio = (color, e) => Math.min(...grounds(e).map((ground) => {
  const [a, b] = [light(color), light(ground)].sort((x, y) => y - x);
  return (a + 0.05) / (b + 0.05);
}));
const faint = [];
for (const e of document.querySelectorAll('.tab, .panel:not([hidden]) *, .status *, .bar *,'
    + '.overlay *, .legend *, .side, .welcome *, dialog[open] *')) {
  if (!e.offsetParent && !e.closest('dialog') || e.closest(':disabled, option, .hidden-text'))
    continue;
  const style = getComputedStyle(e);
  const own = [...e.childNodes].some((n) => n.nodeType === 3 && n.textContent.trim());
  const text = own ? ratio(parse(style.color), e) : 21;
  if (text < 4.5) faint.push(`${text.toFixed(2)} ${e.className || e.tagName}: ${e.textContent}`);
  if (!e.matches('input:not([type=range], [type=checkbox], [type=file]), .panel select')) continue;
  const edge = ratio(parse(style.borderTopColor), e.parentElement);
  if (edge < 3) faint.push(`${edge.toFixed(2)} edge of ${e.getAttribute('aria-label') ?? e.id}`);
}
return faint;
"""

if __name__ == "__main__":
    support.run_tests()
