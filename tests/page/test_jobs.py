# SPDX-License-Identifier: MIT
"""Jobs in the viewer: the view that shows becomes one, which is watched, paused and ended there."""
from page import PageTest, support


class Jobs(PageTest):
    def setUp(self):
        super().setUp()
        self.load()
        self.panel("jobs")

    def tearDown(self):
        for job in self.jobs():
            self.daemon.request("DELETE", f"/v1/jobs/{job['id']}")
            self.daemon.request("DELETE", f"/v1/jobs/{job['id']}?forget=true")
        super().tearDown()

    def jobs(self):
        return self.daemon.request("GET", "/v1/jobs").json()["jobs"]

    def said(self):
        return self.browser.run("return document.getElementById('panel-jobs').innerText")

    def wait_said(self, words):
        self.browser.wait(f"return document.getElementById('panel-jobs').innerText"
                          f".includes({words!r})", words)

    def wait_button(self, label):
        self.browser.wait(f"return document.querySelector('[aria-label=\"{label}\"]')", label)

    def submit(self, frames):
        self.enter("Frames of the job", frames, "#panel-jobs")
        self.press("Render this view as a job", "#panel-jobs")
        support.wait_until(self.jobs, "there is a job")
        return self.jobs()[0]["id"]

    def test_the_view_that_shows_becomes_a_job_whose_pictures_show(self):
        self.assertIn("There is no job", self.said())
        self.enter("Format of the frames", "webp", "#panel-jobs")
        job = self.submit("1-2")
        found = self.daemon.request("GET", f"/v1/jobs/{job}").json()
        view = self.view()
        self.assertEqual([view["width"], view["height"]],
                         [found["request"]["view"][key] for key in ("width", "height")])
        self.assertIn("turntable", found["request"])
        self.wait_said("done: 2 of 2 frames")
        self.browser.wait("""const image = document.querySelector('#panel-jobs img');
          return image?.complete && image.naturalWidth > 0 && image.src.includes('/frames/');""",
                          "the newest frame shows")
        self.assertEqual(f"/v1/jobs/{job}/results.tar", self.browser.run(
            "return document.querySelector('#panel-jobs a').getAttribute('href')"))

    def test_a_job_that_waits_tells_for_what(self):
        job = self.submit("1-500")
        self.wait_button(f"Pause {job[:8]}")
        self.press(f"Pause {job[:8]}", "#panel-jobs")
        self.wait_button(f"Resume {job[:8]}")
        scene = self.daemon.request("GET", f"/v1/jobs/{job}").json()["scene"]
        self.daemon.request("POST", "/v1/jobs", {"scene": scene, "after": [job], "name": "Later"})
        self.wait_said(f"waiting for {job[:8]}: 0 of 1 frames")

    def test_a_job_is_paused_resumed_cancelled_and_forgotten(self):
        job = self.submit("1-500")
        name = job[:8]
        self.wait_button(f"Pause {name}")
        self.press(f"Pause {name}", "#panel-jobs")
        self.wait_said("paused")
        self.press(f"Resume {name}", "#panel-jobs")
        self.wait_button(f"Cancel {name}")
        self.press(f"Cancel {name}", "#panel-jobs")
        self.wait_said("cancelled")
        self.browser.run("window.confirm = () => true")
        self.press(f"Forget {name}", "#panel-jobs")
        self.wait_said("There is no job")
        self.assertEqual([], self.jobs())

    def test_the_camera_goes_through_keys_of_the_view(self):
        self.enter("Camera of the frames", "keys", "#panel-jobs")
        self.press("Add this view as a key", "#panel-jobs")
        first = self.view()["camera"]
        x, y = self.center()
        self.changed_by(lambda: self.browser.drag((x, y), (x + 90, y + 20)))
        self.press("Add this view as a key", "#panel-jobs")
        self.enter("Frame of key 2", "4", "#panel-jobs")
        job = self.submit("1-4")
        path = self.daemon.request("GET", f"/v1/jobs/{job}").json()["request"]["camera_path"]
        self.assertEqual([1, 4], [key["frame"] for key in path["keys"]])
        self.assertEqual(first["eye"], path["keys"][0]["eye"])
        self.assertNotEqual(first["eye"], path["keys"][1]["eye"])
        self.wait_said("done: 4 of 4 frames")

    def test_a_list_that_is_none_is_refused_with_its_reason(self):
        self.expects_refusal = True
        self.enter("Frames of the job", "9-1", "#panel-jobs")
        self.press("Render this view as a job", "#panel-jobs")
        self.browser.wait("return document.getElementById('messages').innerText"
                          ".includes('ends before it begins')", "the reason")
        self.assertEqual([], self.jobs())


if __name__ == "__main__":
    support.run_tests()
