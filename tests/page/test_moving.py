# SPDX-License-Identifier: MIT
"""Placing parts and lights: by fields, and by handles over the picture."""
import math
import struct

from page import PageTest, room, support

# Matrices that turn, scale, shear and mirror: taken apart and put together they are the same, and
# what a person types is what is read back.
ALGEBRA = """
const t = await import('/viewer/transforms.js');
let seed = 7;
const random = () => (seed = (seed * 48271) % 2147483647) / 1073741823.5 - 1;
let worst = 0, count = 0;
const compare = (a, b) => a.forEach((value, i) => {
  worst = Math.max(worst, Math.abs(value - b[i]));
});
while (count < 500) {
  const m = Array.from({ length: 16 }, (_, i) => i % 4 === 3 ? Number(i === 15) : 2 * random());
  const columns = [m.slice(0, 3), m.slice(4, 7), m.slice(8, 11)];
  if (Math.abs(t.dot(columns[0], t.cross(columns[1], columns[2]))) < 0.1) continue;
  count++;
  compare(t.multiply(m, t.inverse(m)), t.IDENTITY);
  const parts = t.decompose(m);
  compare(t.withRotation(m, parts.rotation), m);
  compare(t.withScale(m, parts.scale), m);
  const angles = [180 * random(), 80 * random(), 180 * random()];
  compare(t.decompose(t.withRotation(m, angles)).rotation, angles);
}
compare(t.moved(t.withRotation(t.IDENTITY, [90, 0, 0]), [0, 1, 0]), [0, 0, 1]);
compare(t.moved(t.withRotation(t.IDENTITY, [0, 90, 0]), [0, 0, 1]), [1, 0, 0]);
compare(t.moved(t.withRotation(t.IDENTITY, [0, 0, 90]), [1, 0, 0]), [0, 1, 0]);
compare(t.moved(t.withRotation(t.IDENTITY, [90, 0, 90]), [0, 1, 0]), [0, 0, 1]); // X first, then Z
for (const tilt of [90, -90]) {
  const upright = t.withRotation(t.IDENTITY, [20, tilt, 30]);
  compare(t.withRotation(t.IDENTITY, t.decompose(upright).rotation), upright);
}
const quarter = t.withRotation(t.IDENTITY, [0, 0, 90]);
compare(t.movedBounds(quarter, [0, 0, 0, 1, 2, 3]), [-2, 0, 0, 0, 1, 3]);
return [worst, t.withScale(t.IDENTITY, [1, 0, 1])];
"""


def with_crate(document, binary):
    """A closed cube of a metre before the pane."""
    corners = [(x, y, z) for x in (-0.5, 0.5) for y in (0.5, 1.5) for z in (0.5, 1.5)]
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    indices = [side[i] for side in sides for i in (0, 1, 2, 0, 2, 3)]
    points = b"".join(struct.pack("<3f", *corner) for corner in corners)
    views, accessors = document["bufferViews"], document["accessors"]
    views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(points)})
    views.append({"buffer": 0, "byteOffset": len(binary) + len(points), "byteLength": 72})
    accessors.append({"bufferView": len(views) - 2, "componentType": 5126, "count": 8,
                      "type": "VEC3", "min": [-0.5, 0.5, 0.5], "max": [0.5, 1.5, 1.5]})
    accessors.append({"bufferView": len(views) - 1, "componentType": 5123, "count": 36,
                      "type": "SCALAR"})
    document["meshes"].append({"primitives": [{
        "attributes": {"POSITION": len(accessors) - 2}, "indices": len(accessors) - 1}]})
    document["nodes"].append({"name": "Crate", "mesh": len(document["meshes"]) - 1})
    document["nodes"][0]["children"].append(len(document["nodes"]) - 1)
    return binary + points + struct.pack("<36H", *indices)


class Placing(PageTest):
    def matrix(self, name="#3"):
        return self.view()["overrides"]["nodes"].get(name, {}).get("matrix")

    def test_matrices_come_apart_and_together_again(self):
        self.load()
        worst, flat = self.browser.run(ALGEBRA)
        self.assertLess(worst, 1e-9)
        self.assertIsNone(flat)

    def test_fields_move_turn_and_scale_the_selected_part_and_reset_puts_it_back(self):
        self.load()
        first = self.changed_by(lambda: self.select("Pane"))  # outlined
        moved = self.changed_by(lambda: self.enter("Position X", 0.75, "#panel-properties"))
        self.assertEqual([0.75, 0, 0, 1], self.matrix()[12:])
        self.assertNotEqual(first, moved)
        turned = self.changed_by(lambda: self.enter("Rotation Y", 130, "#panel-properties"))
        self.assertNotEqual(moved, turned)
        sin, cos = math.sin(math.radians(130)), math.cos(math.radians(130))
        expected = [cos, 0, -sin, 0, 0, 1, 0, 0, sin, 0, cos, 0, 0.75, 0, 0, 1]
        for got, expected in zip(self.matrix(), expected):
            self.assertAlmostEqual(expected, got, places=12)
        shown = self.browser.run("""return ['X', 'Y', 'Z'].map((axis) => document
          .querySelector(`#panel-properties [aria-label="Rotation ${axis}"]`).value);""")
        self.assertEqual(["0", "130", "0"], shown)  # and not 180, 50, 180, which is the same
        self.changed_by(lambda: self.enter("Scale Y", 0.5, "#panel-properties"))
        self.assertAlmostEqual(0.5, self.matrix()[5], places=12)
        back = self.changed_by(lambda: self.press("Reset", "#panel-properties"))
        self.assertIsNone(self.matrix())
        self.assertEqual(first, back)

    def test_lights_below_what_was_moved_are_taken_over_where_they_stand(self):
        self.load()
        self.select("Room")
        self.changed_by(lambda: self.enter("Position Y", 0.5, "#panel-properties"))
        self.panel("lights")
        self.changed_by(lambda: self.enter("Intensity", 30, "#panel-lights"))
        [lamp] = self.view()["lights"]
        for got, expected in zip(lamp["position"], [0, 3.1, 1.6]):
            self.assertAlmostEqual(expected, got, places=6)

    def test_edits_without_a_scene_are_undone(self):
        self.load()
        self.assertEqual([1, 0], self.browser.run("""
          const { Model } = await import('/viewer/model.js');
          const model = new Model();
          model.edit('Exposure', (view) => { view.exposure_ev = 1; });
          const edited = model.view.exposure_ev;
          model.undo();
          return [edited, model.view.exposure_ev];"""))

    def test_a_part_that_is_hidden_and_shown_stays_where_it_was_put(self):
        self.load()
        self.select("Pane")
        self.changed_by(lambda: self.enter("Position Y", 0.5, "#panel-properties"))
        self.changed_by(lambda: self.press("Hide Pane"))
        self.assertEqual({"visible": False, "matrix": self.matrix()},
                         self.view()["overrides"]["nodes"]["#3"])
        self.changed_by(lambda: self.press("Show all"))
        self.assertEqual(0.5, self.matrix()[13])
        self.assertEqual(True, self.view()["overrides"]["nodes"]["#3"].get("visible", True))

    def test_a_scale_of_nothing_is_not_taken(self):
        self.load()
        self.select("Pane")
        self.enter("Scale X", 0, "#panel-properties")
        self.assertEqual("1", self.browser.run("""return document
          .querySelector('#panel-properties [aria-label="Scale X"]').value;"""))
        self.assertIsNone(self.matrix())


class Dragging(PageTest):
    def front(self):
        return self.changed_by(lambda: self.enter("Standard views", "front"))

    def test_a_part_follows_the_pointer_along_an_axis(self):
        self.load()
        self.select("Pane")
        self.front()
        self.focus_picture()
        self.browser.keys("g")
        start, tip = self.handle("center"), self.handle("x")
        self.changed_by(lambda: self.browser.drag(tip, (tip[0] + 60, tip[1] + 25)))
        x, y, z = self.view()["overrides"]["nodes"]["#3"]["matrix"][12:15]
        self.assertGreater(x, 0.1)
        self.assertEqual((0, 0), (y, z))
        now = self.handle("center")
        self.assertAlmostEqual(start[0] + 60, now[0], delta=1.5)
        self.assertAlmostEqual(start[1], now[1], delta=1.5)
        self.focus_picture()
        self.browser.keys("g")
        self.assertFalse(self.browser.run(
            "return document.getElementById('gizmo').hasAttribute('data-shown')"))

    def test_a_light_follows_the_pointer_across_the_screen_and_undo_is_one_step(self):
        self.load()
        self.panel("lights")
        first = self.front()
        start = self.handle("center")
        moved = self.changed_by(
            lambda: self.browser.drag(start, (start[0] - 70, start[1] + 40)))
        self.assertNotEqual(first, moved)
        now = self.handle("center")
        self.assertAlmostEqual(start[0] - 70, now[0], delta=1.5)
        self.assertAlmostEqual(start[1] + 40, now[1], delta=1.5)
        [lamp] = self.view()["lights"]
        self.assertAlmostEqual(1.6, lamp["position"][2], places=9)  # stays in its plane
        self.assertLess(lamp["position"][0], -0.3)
        self.assertEqual(first, self.changed_by(lambda: self.press("Undo")))

    def test_a_spot_light_is_aimed_by_its_ball_and_shows_its_cones(self):
        self.load()
        self.panel("lights")
        self.changed_by(lambda: self.press("Add a spot light"))
        self.front()
        center, ball = self.handle("center"), self.handle("ball")
        self.assertGreater(ball[1], center[1])  # it shines down
        self.assertIn("M", self.browser.run(
            "return document.querySelector('.gizmo-outline').getAttribute('d')"))
        aim = (center[0] + 150, center[1])
        self.changed_by(lambda: self.browser.drag(ball, aim))
        x = self.view()["lights"][-1]["direction"][0]
        self.assertGreater(x, 0.9)
        now = self.handle("ball")  # as far out as it goes, on the line to the pointer
        self.assertGreater(now[0], center[0] + 60)
        self.assertAlmostEqual(center[1], now[1], delta=6)

    def test_a_cut_follows_its_arrow_is_tilted_by_its_ball_and_lets_light_in_or_not(self):
        self.load()
        self.panel("section")
        self.changed_by(lambda: self.press("Cut X"))
        self.front()
        self.assertEqual([[-1, 0, 0, 0]], self.view()["clip_planes"])
        tip = self.handle("n")
        self.changed_by(lambda: self.browser.drag(tip, (tip[0] - 20, tip[1])))
        [plane] = self.view()["clip_planes"]
        self.assertEqual([-1, 0, 0], plane[:3])
        self.assertLess(plane[3], -0.05)  # cut at a smaller x
        self.assertAlmostEqual(tip[0] - 20, self.handle("n")[0], delta=1.5)
        self.changed_by(lambda: self.browser.click("#panel-section input[type=checkbox]"))
        self.assertEqual([{"plane": plane, "shadows": False, "cap": False}],
                         self.view()["clip_planes"])
        ball = self.handle("ball")
        self.changed_by(lambda: self.browser.drag(ball, (ball[0] + 20, ball[1] - 60)))
        [tilted] = self.view()["clip_planes"]
        self.assertFalse(tilted["shadows"])
        self.assertGreater(tilted["plane"][1], 0.2)
        self.changed_by(lambda: self.press("Remove", "#panel-section"))
        self.assertEqual([], self.view()["clip_planes"])

    def test_what_is_cut_open_is_closed_in_its_own_material_or_a_colour(self):
        files = support.multipart({"crate.glb": room(with_crate)})
        self.load(scene=self.daemon.post_scene(*files).json()["id"])
        self.enter("Standard views", "right")
        self.panel("section")
        self.changed_by(lambda: self.press("Cut X"))
        opened = self.changed_by(lambda: self.enter("X at", -0.25, "#panel-section"))  # lit
        closed = self.changed_by(lambda: self.enter("Cut bodies", "closed", "#panel-section"))
        self.assertTrue(opened != closed, "the cut is closed")
        [plane] = self.view()["clip_planes"]
        self.assertEqual((True, True), (plane["shadows"], plane["cap"]))
        colored = self.changed_by(lambda: self.enter("Cut bodies", "colored", "#panel-section"))
        self.assertTrue(closed != colored, "the cut has its colour")
        self.browser.run("""const field = document.querySelector('#panel-section [type=color]');
          field.value = '#0000ff';
          field.dispatchEvent(new Event('input'));""")
        self.settle()
        [plane] = self.view()["clip_planes"]
        self.assertEqual([0, 0, 1], plane["cap"])
        self.changed_by(lambda: self.press("Flip", "#panel-section"))
        self.assertEqual([0, 0, 1], self.view()["clip_planes"][0]["cap"])
        self.press("Undo")
        back = self.changed_by(lambda: self.enter("Cut bodies", "open", "#panel-section"))
        self.assertTrue(opened == back, "the cut is open as before")
        self.changed_by(lambda: self.browser.click("#panel-section input[type=checkbox]"))
        choice = "return document.querySelector('#panel-section select')"
        self.assertIsNone(self.browser.run(choice))

    def test_other_lights_are_chosen_by_their_dots(self):
        self.load()
        self.panel("lights")
        self.changed_by(lambda: self.press("Add a point light"))
        self.assertIn("Point", self.browser.run(
            "return document.querySelector('.light[data-open]').innerText"))
        self.front()
        self.browser.run("""document.querySelector('.gizmo-dot').dispatchEvent(
          new MouseEvent('click', { bubbles: true }));""")
        self.assertIn("Lamp", self.browser.run(
            "return document.querySelector('.light[data-open]').innerText"))

    def test_a_light_of_the_scene_keeps_the_way_its_texels_lie(self):
        self.load()
        kept = self.browser.run("""const { lightMembers } = await import('/viewer/lights.js');
          const spot = { type: 'spot', name: 'Lamp', node: 4, position: [0, 1, 0],
            direction: [0, -1, 0], up: [1, 0, 0] };
          return [lightMembers(spot), lightMembers({ ...spot, up: [0, 1, 0] }),
            lightMembers({ ...spot, type: 'point' })];""")
        self.assertEqual([1, 0, 0], kept[0]["up"])
        self.assertNotIn("up", kept[1])  # along the direction it would say nothing
        self.assertNotIn("up", kept[2])


if __name__ == "__main__":
    support.run_tests()
