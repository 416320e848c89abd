# SPDX-License-Identifier: MIT
"""A job: a list of frames that the server renders, whatever ends meanwhile."""
from __future__ import annotations

import hashlib
import os
from typing import TYPE_CHECKING, Any, Dict, Iterator, List

from .connection import query_of

if TYPE_CHECKING:
    from .client import Client

_PAGE = 500


class Job:
    """What is known of a job, which look() brings up to date. Thread: any, one at a time."""

    def __init__(self, client: "Client", members: Dict[str, Any]) -> None:
        self.client = client
        self.members = members

    @property
    def id(self) -> str:
        return self.members["id"]

    @property
    def state(self) -> str:
        """waiting (for other jobs), queued, running, done, failed or cancelled."""
        return self.members["state"]

    @property
    def has_ended(self) -> bool:
        return self.members["ended"] is not None

    @property
    def waits_for(self) -> List[str]:
        """Ids of the jobs that are to end before it begins, and have not yet."""
        return self.members["waits_for"]

    @property
    def path(self) -> str:
        return f"/v1/jobs/{self.id}"

    def look(self) -> "Job":
        self.members = self.client.get(self.path)
        return self

    def wait(self) -> "Job":
        """Until it has ended; a paused one is waited for, too."""
        while not self.has_ended:
            self.members = self.client.connection.request(
                "GET", self.path, headers={"Prefer": "wait=30"}).json()
        return self

    def _change(self, **members: Any) -> "Job":
        self.members = self.client.send("PATCH", self.path, members).json()
        return self

    def pause(self) -> "Job":
        return self._change(paused=True)

    def resume(self) -> "Job":
        return self._change(paused=False)

    def set_priority(self, priority: int) -> "Job":
        return self._change(priority=priority)

    def retry_failed(self) -> "Job":
        """Has failed frames rendered again, with new attempts."""
        return self._change(retry_failed=True)

    def cancel(self) -> "Job":
        """No more frames; those that are done stay."""
        self.members = self.client.connection.request("DELETE", self.path).json()
        return self

    def forget(self) -> None:
        """Removes one that has ended, with the results that the server keeps."""
        self.client.connection.request("DELETE", self.path + "?forget=true")

    def frames(self) -> Iterator[Dict[str, Any]]:
        """State, attempts and files of each, in the order of the list."""
        first, count = 0, 1
        while first < count:
            page = self.client.get(f"{self.path}/frames{query_of(first=first, count=_PAGE)}")
            yield from page["frames"]
            first, count = first + _PAGE, page["count"]

    def file(self, frame: int, output: str = "color") -> bytes:
        return self.client.connection.request(
            "GET", f"{self.path}/frames/{frame}/{output}").body

    def fetch(self, folder: "os.PathLike[str] | str") -> List[str]:
        """Brings the files that are made into a folder, and answers their paths. A file that is
        there with the same content is not sent again; each appears whole or not at all."""
        os.makedirs(folder, exist_ok=True)
        paths = []
        for frame in self.frames():
            for file in frame["files"]:
                path = os.path.join(folder, os.path.basename(file["file"]))
                if not _is_there(path, file["sha256"]):
                    content = self.client.connection.request("GET", file["href"]).body
                    draft = os.path.join(folder, f".{os.path.basename(path)}.part")
                    with open(draft, "wb") as out:
                        out.write(content)
                    os.replace(draft, path)
                paths.append(path)
        return paths


def _is_there(path: str, sha256: str) -> bool:
    try:
        with open(path, "rb") as file:
            return hashlib.sha256(file.read()).hexdigest() == sha256
    except OSError:
        return False
