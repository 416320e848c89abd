# SPDX-License-Identifier: MIT
"""The one error of this package: a reply that says no, or none at all."""
from __future__ import annotations

import json
from typing import Any, Mapping, Optional


class VitrailError(Exception):
    """The members of a problem (RFC 9457), or status 0 and code "no_reply" when nobody answered."""

    def __init__(self, problem: Mapping[str, Any]) -> None:
        self.status: int = problem.get("status", 0)
        self.code: str = problem.get("code", "no_reply")
        self.title: str = problem.get("title", "")
        self.detail: str = problem.get("detail", "")
        self.pointer: Optional[str] = problem.get("pointer")  # RFC 6901, into what was sent
        self.request_id: Optional[str] = problem.get("request_id")
        self.revision: Optional[int] = problem.get("revision")  # the present one, at 412
        self.retry_after_s: Optional[float] = problem.get("retry_after_s")
        super().__init__(self.detail or self.title or f"status {self.status}")

    def __str__(self) -> str:
        return f"{self.code}: {self.args[0]}"


def error_of(status: int, body: bytes, retry_after: Optional[str]) -> VitrailError:
    """From a reply of status 400 or more; a body that is no problem is quoted."""
    try:
        problem = json.loads(body)
        assert isinstance(problem, dict)
    except (ValueError, AssertionError):
        problem = {"code": "unknown", "detail": body[:200].decode("utf-8", "replace")}
    problem["status"] = status
    if retry_after and retry_after.isdigit():
        problem["retry_after_s"] = float(retry_after)
    return VitrailError(problem)
