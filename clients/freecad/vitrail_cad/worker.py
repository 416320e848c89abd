# SPDX-License-Identifier: MIT
"""Talks with the server beside the window's thread: jobs one at a time, frames as they come."""
import threading

import vitrail


class Worker:
    """do() and watch() return at once. tell(kind, value) is called on a thread of the worker:
    "frame" with a vitrail.Frame, "problem" with a sentence, "idle" when no job is left."""

    def __init__(self, tell):
        self.tell = tell
        self.jobs = {}  # by name, in order: a newer job of a name takes the place of an older one
        self.changed = threading.Condition()
        self.is_over = self.is_busy = False
        self.stream, self.generation = None, 0
        threading.Thread(target=self._work, daemon=True).start()

    def do(self, name, job):
        """job: a function without arguments, which may raise VitrailError or ValueError."""
        with self.changed:
            self.jobs[name] = job
            self.changed.notify()

    def is_idle(self):
        with self.changed:
            return not self.jobs and not self.is_busy

    def end(self):
        """Drops the jobs that wait and the frames to come."""
        with self.changed:
            self.is_over = True
            self.generation += 1
            self.jobs.clear()
            self.changed.notify()

    def _next(self):
        with self.changed:
            self.is_busy = False
            while not self.jobs and not self.is_over:
                self.changed.wait()
            if self.is_over:
                return None
            self.is_busy = True
            return self.jobs.pop(next(iter(self.jobs)))

    def _work(self):
        while (job := self._next()) is not None:
            try:
                job()
            except (vitrail.VitrailError, ValueError) as problem:
                self.tell("problem", sentence_of(problem))
            if self.is_idle_after():
                self.tell("idle", None)

    def is_idle_after(self):
        with self.changed:
            return not self.jobs

    def watch(self, view):
        """Frames of a view in place of those of the view before; None: of none."""
        with self.changed:
            self.generation += 1
            mine = self.generation
        if view is not None:
            threading.Thread(target=self._frames, args=(view, mine), daemon=True).start()

    def _frames(self, view, mine):
        try:
            for frame in view.stream():
                if self.generation != mine:
                    return
                self.tell("frame", frame)
            ended = "the server ended the picture: the view expired, or the server stops"
        except vitrail.VitrailError as problem:
            ended = sentence_of(problem)
        except (OSError, ValueError) as problem:  # the connection broke within a frame
            ended = f"the connection to the server broke: {problem}"
        if self.generation == mine:
            self.tell("problem", ended)


def sentence_of(problem):
    if isinstance(problem, vitrail.VitrailError) and problem.code == "no_reply":
        return f"the server does not answer ({problem.args[0]}); is vitraild running?"
    return str(problem)
