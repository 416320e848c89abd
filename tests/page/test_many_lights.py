# SPDX-License-Identifier: MIT
"""Four thousand lights in the viewer: listed, walked, opened and edited without delay."""
from page import PageTest, room, support

COUNT = 4095  # and the lamp of the room: all that an outline lists
ROWS = "return document.querySelectorAll('.light').length"
FOCUS = "return document.activeElement.innerText"
OPEN = "return document.querySelector('.light[data-open]').innerText"


def with_candles(document, binary):
    """Weak lights over the floor, each of which reaches little."""
    for i in range(COUNT):
        document["nodes"].append({
            "name": f"Candle {i}", "translation": [-2 + i % 64 / 16, 0.05, -2 + i // 64 / 16],
            "extensions": {"KHR_lights_punctual": {"light": 1}}})
        document["nodes"][0]["children"].append(len(document["nodes"]) - 1)
    document["extensions"]["KHR_lights_punctual"]["lights"].append(
        {"type": "point", "intensity": 0.01, "range": 0.08})
    return binary


class ManyLights(PageTest):
    auto = "measured"  # no machine has time for maps of so many lights

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        files = support.multipart({"candles.glb": room(with_candles)})
        cls.scene = cls.daemon.post_scene(*files).json()["id"]

    def setUp(self):
        super().setUp()
        self.load()
        self.panel("lights")

    def head(self, index):
        self.browser.run("document.querySelector(`[data-key='light-${arguments[0]}']`).focus()",
                         index)

    def test_only_those_in_sight_are_in_the_page_and_keys_reach_all(self):
        self.assertLess(self.browser.run(ROWS), 60)
        self.assertIn("4\u202f096 lights", self.browser.run(
            "return document.getElementById('panel-lights').innerText"))
        self.head(0)
        self.browser.keys("Down", "Down")
        self.assertIn("Candle 1", self.browser.run(FOCUS))
        self.browser.keys("End")
        self.assertIn(f"Candle {COUNT - 1}", self.browser.run(FOCUS))
        self.assertLess(self.browser.run(ROWS), 60)
        self.assertEqual("4096 of 4096", self.browser.run("""
          const row = document.activeElement.closest('.light');
          return `${row.getAttribute('aria-posinset')} of ${row.getAttribute('aria-setsize')}`;"""))
        self.browser.keys("Home")
        self.assertIn("Lamp", self.browser.run(FOCUS))

    def test_rows_follow_the_one_that_is_open_without_gap_or_overlap(self):
        for index in (2, COUNT):
            self.head(0)
            self.browser.keys(*(["Down"] * 2 if index == 2 else ["End"]), "Enter")
            self.assertIn(f"Candle {index - 1}", self.browser.run(OPEN))
            gaps = self.browser.run("""const rows = [...document.querySelectorAll('.light')]
              .map((row) => [Number(row.getAttribute('aria-posinset')), row]);
              return rows.slice(1).map(([at, row], i) => at === rows[i][0] + 1
                ? row.getBoundingClientRect().top - rows[i][1].getBoundingClientRect().bottom
                : 0).filter((gap) => Math.abs(gap) > 1);""")
            self.assertEqual([], gaps)
            end = self.browser.run("""const list = document.querySelector('.lights');
              return list.getBoundingClientRect().bottom - Math.max(...[...list.children].map(
                (row) => row.getBoundingClientRect().bottom));""")
            if index == COUNT:
                self.assertAlmostEqual(1, end, delta=1.1)  # the last one ends with the list

    def test_what_is_being_typed_stays_while_the_list_scrolls(self):
        self.browser.run("document.querySelector('.light-fields [type=number]').select()")
        self.browser.keys("1", "2")
        self.browser.run("document.getElementById('panel-lights').scrollTop = 40000;")
        self.browser.wait("""return document.getElementById('panel-lights').innerText
          .includes('Candle 12')""", "the rows there")
        self.assertEqual(["12", True], self.browser.run("""
          const field = document.querySelector('.light-fields [type=number]');
          return [field.value, field === document.activeElement];"""))
        self.browser.keys("Enter")
        support.wait_until(lambda: (self.view()["lights"] or [{}])[0].get("intensity") == 12,
                           "the lamp is edited")

    def sent(self):
        """Lengths of the patches that went up the socket since it was asked last."""
        return self.browser.run("""const patches = window.patches ?? [];
          if (!window.patches) {
            const send = WebSocket.prototype.send;
            WebSocket.prototype.send = function (text) {
              if (JSON.parse(text).type === 'patch') window.patches.push(text.length);
              return send.call(this, text);
            };
          }
          window.patches = [];
          return patches;""")

    def wait_for_lights(self, is_right, what):
        support.wait_until(lambda: is_right(self.view()["lights"]), what, timeout_s=60)
        lengths = self.sent()
        self.assertTrue(all(length < 300 for length in lengths), lengths)
        return len(lengths)

    def test_an_edit_sends_only_the_light_that_changed(self):
        def intensity(value):
            self.enter("Intensity", value, "#panel-lights")
        self.sent()
        intensity(12)
        self.wait_for_lights(lambda lights: lights and lights[0]["intensity"] == 12,
                             "all lights are the view's, by one request")
        before = self.view()["lights"]
        intensity(14)
        self.assertEqual(1, self.wait_for_lights(lambda lights: lights[0]["intensity"] == 14,
                                                 "the lamp is edited"))
        self.head(5)
        self.browser.keys("Enter")
        self.press("Remove", "#panel-lights")
        self.assertEqual(1, self.wait_for_lights(lambda lights: len(lights) == COUNT,
                                                 "a light is gone"))
        self.press("Add a disk light", "#panel-lights")
        self.assertEqual(1, self.wait_for_lights(lambda lights: len(lights) == COUNT + 1,
                                                 "a light is new"))
        lights = self.view()["lights"]
        self.assertEqual([{**before[0], "intensity": 14}, *before[1:5], *before[6:]], lights[:-1])
        self.assertEqual("disk", lights[-1]["type"])

    def test_opening_and_editing_one_of_them_touches_only_the_rows_in_sight(self):
        changed = self.browser.run("""
          const count = (records) => records.reduce((sum, record) => sum
            + (record.type === 'childList'
              ? [...record.addedNodes, ...record.removedNodes].reduce((nodes, node) => nodes + 1
                  + (node.querySelectorAll?.('*').length ?? 0), 0)
              : 1), 0);
          const observer = new MutationObserver(() => {});
          observer.observe(document.body,
            {subtree: true, childList: true, attributes: true, characterData: true});
          const counted = (act) => {
            observer.takeRecords();
            act();
            return count(observer.takeRecords());
          };
          const heads = () => [...document.querySelectorAll('.light-head')];
          const open = [3, 5, 7].map((at) => counted(() => heads()[at].click()));
          const edit = [1, 2, 3].map((value) => counted(() => {
            const field = document.querySelector('.light-fields [type=number]');
            field.value = value;
            field.dispatchEvent(new Event('change'));
          }));
          return {open, edit};""")
        for act in ("open", "edit"):
            for nodes in changed[act]:
                self.assertGreater(nodes, 0, changed)
                self.assertLess(nodes, COUNT, changed)  # a row has several


if __name__ == "__main__":
    support.run_tests()
