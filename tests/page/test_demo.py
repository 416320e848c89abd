# SPDX-License-Identifier: MIT
"""A page without a scene: one click to the demo."""
from page import PageTest, support

WELCOME = "return !document.getElementById('welcome').hidden"


class Demo(PageTest):
    size = (640, 420)

    def test_one_click_makes_the_demo_scene_and_opens_it(self):
        self.daemon.request("DELETE", "/v1/scenes/" + self.scene)
        self.browser.go(f"http://127.0.0.1:{self.daemon.port}/")
        self.browser.wait(WELCOME, "the welcome shows")
        self.press("Open the demo scene", "#welcome")
        self.browser.wait("return document.title === 'demo – Vitrail'", "the demo is open")
        self.settle()
        self.assertFalse(self.browser.run(WELCOME))
        (scene,) = self.daemon.request("GET", "/v1/scenes").json()["scenes"]
        self.assertEqual("demo", scene["name"])
        self.assertIn(scene["id"], self.browser.run("return location.hash"))

    def test_a_server_that_cannot_says_why_and_the_button_stays(self):
        self.expects_refusal = True
        with support.Daemon("--max-upload-bytes", "10240") as daemon:
            self.browser.go(f"http://127.0.0.1:{daemon.port}/")
            self.browser.wait(WELCOME, "the welcome shows")
            self.press("Open the demo scene", "#welcome")
            self.browser.wait("return document.getElementById('messages').textContent"
                              ".includes('this server takes up to 10240')", "it says why")
            self.assertFalse(self.browser.run(
                "return document.querySelector('.welcome-ways button:last-child').disabled"))


if __name__ == "__main__":
    support.run_tests()
