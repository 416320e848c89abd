# SPDX-License-Identifier: MIT
"""Turning and scaling by the rings and the square over the picture, in steps with Shift."""
import math
import struct

from page import PageTest, support

RING_PX = 94  # of a ring that is seen from straight above
MIDDLE = (0, (0.5 + struct.unpack("<f", struct.pack("<f", 2.2))[0]) / 2, 0)  # of the pane

ALGEBRA = """
const t = await import('/viewer/transforms.js');
const l = await import('/viewer/lights.js');
let worst = 0;
const compare = (a, b) => a.forEach((value, i) => {
  worst = Math.max(worst, Math.abs(value - b[i]));
});
for (const degrees of [-200, -35, 12, 90, 180, 275])
  t.AXES.forEach((axis, at) => {
    const angles = [0, 0, 0];
    angles[at] = degrees;
    compare(t.turnAbout(axis, degrees), t.withRotation(t.IDENTITY, angles));
  });
const axis = t.unit([1, 2, -0.5]);
const point = [3, -1, 2];
compare(t.moved(t.turnAbout(axis, 77, point), point), point);
compare(t.moved(t.turnAbout(axis, 77, point), t.add(point, axis)), t.add(point, axis));
compare(t.multiply(t.turnAbout(axis, 77, point), t.turnAbout(axis, -77, point)), t.IDENTITY);
compare(t.moved(t.scaleAbout(3, point), [4, -1, 2]), [6, -1, 2]);
for (const direction of [[0, -1, 0], [1, 2, 3], [0.1, 0, -5]])
  for (const degrees of [-150, 0, 20, 90]) {
    const light = { type: 'rect', direction };
    compare([l.rollOf({ ...light, ...l.rolled(light, degrees) })], [degrees]);
    const turned = { ...light, ...l.turnedLight(light, t.unit(direction), degrees) };
    compare([l.rollOf(turned)], [degrees]); // a turn about its direction is a roll
    compare(turned.direction, t.unit(direction));
  }
return [worst, t.turnAbout([0, 1, 0], 90)];
"""


def times(a, b):
    """Product of two column-major matrices."""
    return [sum(a[4 * k + row] * b[4 * column + k] for k in range(4))
            for column in range(4) for row in range(4)]


class Turning(PageTest):
    def begin(self, name="Pane"):
        """A part with its handles, seen from the front; the middle of the handles."""
        self.load()
        self.select(name)
        self.focus_picture()
        self.browser.keys("g")
        self.changed_by(lambda: self.enter("Standard views", "front"))
        return self.handle("center")

    def around(self, middle, degrees, hold=None):
        """Drags the ring that faces us, counter-clockwise from the right."""
        points = [(middle[0] + RING_PX * math.cos(math.radians(degrees * i / 8)),
                   middle[1] - RING_PX * math.sin(math.radians(degrees * i / 8)))
                  for i in range(9)]
        self.changed_by(lambda: self.browser.drag_along(points, hold=hold))

    def matrix(self, key="#3"):
        return self.view()["overrides"]["nodes"][key]["matrix"]

    def test_turns_are_exact_and_rolls_come_back(self):
        self.load()
        worst, quarter = self.browser.run(ALGEBRA)
        self.assertLess(worst, 1e-9)
        self.assertEqual([0, 0, -1, 0, 0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1], quarter)

    def test_a_ring_turns_a_part_about_its_middle_and_one_undo_takes_it_back(self):
        middle = self.begin()
        first = self.settle()
        self.around(middle, 60)
        matrix = self.matrix()
        angle = math.degrees(math.atan2(matrix[1], matrix[0]))
        self.assertAlmostEqual(60, angle, delta=1)  # the pointer has whole pixels
        self.assertAlmostEqual(angle, round(angle, 1), places=9)
        for got, expected in zip(times(matrix, [0] * 12 + [*MIDDLE, 1])[12:], MIDDLE):
            self.assertAlmostEqual(expected, got, places=9)
        now = self.handle("center")
        self.assertAlmostEqual(middle[0], now[0], delta=0.5)
        self.assertAlmostEqual(middle[1], now[1], delta=0.5)
        self.assertEqual(first, self.changed_by(lambda: self.press("Undo")))

    def test_with_shift_a_ring_goes_in_steps_of_fifteen_degrees(self):
        self.around(self.begin(), 50, hold="Shift")
        matrix = self.matrix()
        self.assertEqual(math.sin(math.radians(45)), matrix[1])
        self.assertEqual("45", self.browser.run("""return document
          .querySelector('#panel-properties [aria-label="Rotation Z"]').value;"""))

    def test_a_ring_can_be_turned_more_than_once_around(self):
        middle = self.begin()
        self.around(middle, 400, hold="Shift")  # 400 is 26.7 steps
        angle = math.degrees(math.atan2(self.matrix()[1], self.matrix()[0]))
        self.assertAlmostEqual(45, angle, places=9)

    def test_a_ring_that_is_seen_from_its_side_is_rolled_along(self):
        middle = self.begin()
        start = (middle[0], middle[1] - 85)  # above the arm of y
        self.changed_by(lambda: self.browser.drag(start, (start[0], start[1] + 49)))
        matrix = self.matrix()
        self.assertAlmostEqual(1, matrix[0], places=12)  # about X
        self.assertAlmostEqual(49 / RING_PX, math.atan2(matrix[6], matrix[5]), delta=0.02)

    def test_a_part_below_a_turned_and_scaled_one_turns_about_the_axes_of_the_world(self):
        self.load()
        self.select("Room")
        self.changed_by(lambda: self.enter("Rotation Y", 90, "#panel-properties"))
        self.changed_by(lambda: self.enter("Scale X", 0.5, "#panel-properties"))
        self.select("Pane")
        self.focus_picture()
        self.browser.keys("g")
        self.changed_by(lambda: self.enter("Standard views", "front"))
        self.around(self.handle("center"), 90, hold="Shift")
        world = times(self.matrix("#0"), self.matrix())
        quarter = [0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]
        for got, expected in zip(world[:12], times(quarter, self.matrix("#0"))[:12]):
            self.assertAlmostEqual(expected, got, places=9)

    def test_one_undo_takes_one_drag_back_however_long_it_took(self):
        middle = self.begin()
        first = self.settle()
        moves = [{"type": "pointerMove", "duration": 0, "x": round(middle[0] + x),
                  "y": round(middle[1] - y)} for x, y in ((RING_PX, 0), (80, 50), (50, 80))]
        self.changed_by(lambda: self.browser.actions([{
            "type": "pointer", "id": "mouse", "parameters": {"pointerType": "mouse"}, "actions": [
                moves[0], {"type": "pointerDown", "button": 0}, moves[1],
                {"type": "pause", "duration": 1200}, moves[2],
                {"type": "pointerUp", "button": 0}]}]))
        turned = self.settle()
        below = (middle[0], middle[1] + RING_PX)
        self.browser.drag_along([(middle[0] + RING_PX, middle[1]), below])
        self.settle()
        self.assertEqual(turned, self.changed_by(lambda: self.press("Undo")))
        self.assertEqual(first, self.changed_by(lambda: self.press("Undo")))

    def test_the_square_scales_a_part_about_its_middle(self):
        middle = self.begin()
        x, y = self.handle("scale")
        to = (middle[0] + 1.5 * (x - middle[0]), middle[1] + 1.5 * (y - middle[1]))
        self.changed_by(lambda: self.browser.drag((x, y), to, hold="Shift"))
        matrix = self.matrix()
        for at, expected in ((0, 1.5), (5, 1.5), (10, 1.5), (13, -0.5 * MIDDLE[1])):
            self.assertAlmostEqual(expected, matrix[at], places=9)

    def test_with_shift_a_part_moves_in_round_steps(self):
        self.begin()
        x, y = self.handle("x")
        self.changed_by(lambda: self.browser.drag((x, y), (x + 63, y), hold="Shift"))
        moved = self.matrix()[12]
        self.assertGreater(moved, 0.2)
        self.assertAlmostEqual(moved, round(moved, 1), places=12)


class Aiming(PageTest):
    around = Turning.around

    def front(self):
        self.changed_by(lambda: self.enter("Standard views", "front"))

    def add_light(self, kind):
        """A light over the scene that shines straight down."""
        self.panel("lights")
        self.changed_by(lambda: self.press(f"Add a {kind} light"))
        for label, value in (("Position X", 0), ("Position Y", 3.2), ("Position Z", 0),
                             ("Direction Y", -1), ("Direction X", 0), ("Direction Z", 0)):
            self.enter(label, value, "#panel-lights")
        support.wait_until(lambda: self.view()["lights"][-1]["direction"] == [0, -1, 0],
                           "the light shines down")

    def test_a_ring_turns_where_a_light_shines(self):
        self.load()
        self.add_light("spot")
        self.front()
        shown = """return [...document.querySelectorAll('.gizmo-ring')].map((ring) =>
          !ring.hasAttribute('hidden'));"""
        self.assertEqual([True, False, True], self.browser.run(shown))  # it shines along Y
        self.around(self.handle("center"), 92, hold="Shift")
        self.assertEqual([1, 0, 0], self.view()["lights"][-1]["direction"])
        self.assertEqual([False, True, True], self.browser.run(shown))

    def test_with_shift_the_ball_keeps_to_whole_angles(self):
        self.load()
        self.panel("lights")
        self.changed_by(lambda: self.press("Add a spot light"))
        self.front()
        center, ball = self.handle("center"), self.handle("ball")
        aim = (center[0] + 75, center[1] + 70)
        self.changed_by(lambda: self.browser.drag(ball, aim, hold="Shift"))
        x, y, z = self.view()["lights"][-1]["direction"]
        for angle in (math.degrees(math.asin(y)), math.degrees(math.atan2(x, z))):
            self.assertAlmostEqual(angle / 15, round(angle / 15), places=9)
        self.assertLess(y, -0.2)

    def test_a_rectangle_is_rolled_by_a_number(self):
        self.load()
        self.add_light("rect")
        self.changed_by(lambda: self.enter("Roll", 30, "#panel-lights"))
        for got, expected in zip(self.view()["lights"][-1]["up"], (0.5, 0, -math.sqrt(0.75))):
            self.assertAlmostEqual(expected, got, places=9)
        self.assertEqual(3, self.browser.run("""return [...document
          .querySelectorAll('.gizmo-ring:not([hidden])')].length"""))  # one of them rolls it

    def test_the_handle_of_a_cut_stays_in_sight(self):
        self.load()
        self.panel("section")
        self.changed_by(lambda: self.press("Cut X"))
        self.front()
        stem = """const [line] = document.getElementsByClassName('gizmo-stem');
          const { clientHeight } = document.getElementById('surface');
          return Number(line.getAttribute('y1')) / clientHeight;"""
        self.assertAlmostEqual(0.5, self.browser.run(stem), delta=0.02)
        self.focus_picture()
        self.changed_by(lambda: self.browser.keys(*["Up"] * 8, hold="Shift"))  # 0.4 of the height
        self.assertAlmostEqual(0.5, self.browser.run(stem), delta=0.02)

    def test_a_ring_and_a_number_tilt_a_cut_about_the_middle_of_the_picture(self):
        self.load()
        self.panel("section")
        self.changed_by(lambda: self.press("Cut X"))
        self.changed_by(lambda: self.enter("X at", 0.25, "#panel-section"))
        self.front()
        self.browser.wait("return document.querySelector('.gizmo-ring:not([hidden])')", "rings")
        stem = self.browser.run("""const [line] = document.getElementsByClassName('gizmo-stem');
          const box = document.getElementById('surface').getBoundingClientRect();
          return [box.x + Number(line.getAttribute('x1')), box.y + Number(line.getAttribute('y1'))];
          """)
        self.around(stem, 47, hold="Shift")
        half = math.sqrt(0.5)
        center = (0.25, 1.5, 0)  # where the cut and the way to the middle of the scene meet
        [plane] = self.view()["clip_planes"]
        self.assertEqual(4, len(plane))
        for got, expected in zip(plane, (-half, -half, 0, half * (center[0] + center[1]))):
            self.assertAlmostEqual(expected, got, places=9)
        self.changed_by(lambda: self.enter("Normal Y", 0, "#panel-section"))
        [plane] = self.view()["clip_planes"]
        self.assertEqual(0, plane[1])
        self.assertIn("X at", self.browser.run(
            "return document.getElementById('panel-section').innerText"))


if __name__ == "__main__":
    support.run_tests()
