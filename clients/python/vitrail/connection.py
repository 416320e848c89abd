# SPDX-License-Identifier: MIT
"""HTTP underneath the client: a kept-alive connection per thread, replies whole or as they come."""
from __future__ import annotations

import contextlib
import http.client
import json
import threading
import time
import urllib.parse
from typing import Any, Dict, Iterator, Mapping, Optional

from .errors import VitrailError, error_of

_IDLE_S = 30.0  # the server closes after 60; a connection older than this is made anew


def query_of(**members: Any) -> str:
    """The end of an address, of the members that are not None."""
    given = {name: value for name, value in members.items() if value is not None}
    return f"?{urllib.parse.urlencode(given)}" if given else ""


class Reply:
    """A reply below 400, read to its end."""

    def __init__(self, status: int, headers: Dict[str, str], body: bytes) -> None:
        self.status = status
        self.headers = headers  # by lowercase names
        self.body = body

    def json(self) -> Any:
        return json.loads(self.body)


def _headers_of(response: http.client.HTTPResponse) -> Dict[str, str]:
    return {name.lower(): value for name, value in response.getheaders()}


class Connection:
    """Thread: any; each has a connection of its own."""

    def __init__(self, url: str, timeout_s: float, retries: int) -> None:
        parts = urllib.parse.urlsplit(url)
        if parts.scheme not in ("http", "https") or not parts.hostname:
            raise ValueError(f"'{url}' is not an http or https address")
        self._parts = parts
        self._prefix = parts.path.rstrip("/")
        self._timeout_s = timeout_s
        self._retries = retries
        self._local = threading.local()

    def _open(self) -> http.client.HTTPConnection:
        kind = (http.client.HTTPSConnection if self._parts.scheme == "https"
                else http.client.HTTPConnection)
        return kind(self._parts.hostname or "", self._parts.port, timeout=self._timeout_s)

    def _kept(self) -> http.client.HTTPConnection:
        last = getattr(self._local, "used", 0.0)
        kept: Optional[http.client.HTTPConnection] = getattr(self._local, "connection", None)
        if kept is None or time.monotonic() - last > _IDLE_S:
            self.close()
            kept = self._local.connection = self._open()
        return kept

    def close(self) -> None:
        """Closes the connection of this thread."""
        kept = getattr(self._local, "connection", None)
        if kept is not None:
            kept.close()
        self._local.connection = None

    def _once(self, method: str, path: str, body: Optional[bytes],
              headers: Mapping[str, str]) -> Reply:
        connection = self._kept()
        try:
            connection.request(method, self._prefix + path, body, dict(headers))
            response = connection.getresponse()
            content = response.read()
        except (OSError, http.client.HTTPException) as failure:
            self.close()
            detail = f"{method} {path}: {failure or type(failure).__name__}"
            raise VitrailError({"detail": detail}) from failure
        self._local.used = time.monotonic()
        if response.status >= 400:
            raise error_of(response.status, content, response.getheader("Retry-After"))
        return Reply(response.status, _headers_of(response), content)

    def request(self, method: str, path: str, body: Optional[bytes] = None,
                headers: Optional[Mapping[str, str]] = None) -> Reply:
        """Tries again, as often as asked for, when the server is busy (503) and says when."""
        for left in range(self._retries, -1, -1):
            try:
                return self._once(method, path, body, headers or {})
            except VitrailError as problem:
                if left == 0 or problem.status != 503:
                    raise
                time.sleep(min(problem.retry_after_s or 1.0, 30.0))
        raise AssertionError("not reached")

    @contextlib.contextmanager
    def stream(self, path: str, accept: str) -> Iterator[http.client.HTTPResponse]:
        """A reply that is read as it comes, on a connection of its own."""
        connection = self._open()
        try:
            try:
                connection.request("GET", self._prefix + path, headers={"Accept": accept})
                response = connection.getresponse()
            except (OSError, http.client.HTTPException) as failure:
                detail = f"GET {path}: {failure or type(failure).__name__}"
                raise VitrailError({"detail": detail}) from failure
            with response:
                if response.status >= 400:
                    raise error_of(response.status, response.read(),
                                   response.getheader("Retry-After"))
                yield response
        finally:
            connection.close()
