"""What both clients share: headers, retries, bodies, and answers turned into types. No I/O."""

import uuid
from collections.abc import Mapping, Sequence
from datetime import datetime
from functools import cache
from typing import Any, TypeVar

import httpx
from pydantic import TypeAdapter

from gcs.client import models

T = TypeVar("T")
TIMEOUT_S = 70.0  # a vehicle's own verdict may take a minute
CONNECT_TIMEOUT_S = 5.0  # a server that is not there must not keep a caller with an emergency waiting
RETRIES = 3
RETRY_AFTER_S = 0.5  # doubled each time, unless the server names a time
MAX_WAIT_S = 10.0
FINAL_STATES = frozenset({"done", "aborted", "failed"})
STREAM = {
    "hello": models.HelloMessage,
    "campaign": models.CampaignMessage,
    "snapshot": models.SnapshotMessage,
    "event": models.EventMessage,
    "problem": models.ProblemMessage,
}
Message = (
    models.HelloMessage | models.CampaignMessage | models.SnapshotMessage | models.EventMessage | models.ProblemMessage
)
MissionLike = str | Mapping[str, Any]


def headers(key: str | None) -> dict[str, str]:
    """For every request."""
    return {} if not key else {"authorization": f"Bearer {key}"}


def timeouts(timeout_s: float) -> httpx.Timeout:
    """Less for the connection than for the answer."""
    return httpx.Timeout(timeout_s, connect=min(timeout_s, CONNECT_TIMEOUT_S))


def idempotency() -> dict[str, str]:
    """One a change, kept over its retries: the server acts once."""
    return {"idempotency-key": uuid.uuid4().hex}


def parse(kind: type[T], response: httpx.Response) -> T:
    """The answer as ``kind``."""
    answer: T = _adapter(kind).validate_json(response.content)  # type: ignore[arg-type] # types are hashable
    return answer


def message(text: str | bytes) -> Message | None:
    """One message of the stream; None for a kind that this client does not know."""
    kind = TypeAdapter(dict[str, Any]).validate_json(text).get("type")
    found = STREAM.get(str(kind))
    return None if found is None else _adapter(found).validate_json(text)


def mission_body(mission: MissionLike, policy: str | None = None) -> dict[str, Any]:
    """A name at hand, or a whole document; ``policy`` instead of the mission's."""
    if isinstance(mission, str):
        return {"mission": mission} | ({} if policy is None else {"policy": policy})
    document = dict(mission)
    return document if policy is None else document | {"policy": {"name": policy}}


def without_none(values: Mapping[str, Any]) -> dict[str, Any]:
    """Parameters that were given; moments as RFC 3339."""
    return {
        name: value.isoformat() if isinstance(value, datetime) else value
        for name, value in values.items()
        if value is not None
    }


def rows(entries: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Fixes and receipts: ``time`` may be a datetime with its zone, RFC 3339 text or Unix seconds."""
    return [without_none(entry) for entry in entries]


def wait_s(attempt: int, response: httpx.Response | None) -> float:
    """How long to wait before trying again: what the server says, else doubling."""
    told = None if response is None else response.headers.get("retry-after", "")
    if told and told.isdecimal():
        return min(MAX_WAIT_S, float(told))
    return min(MAX_WAIT_S, RETRY_AFTER_S * 2.0**attempt)


def stream_address(base_url: str) -> str:
    """ws:// or wss:// of the server's stream."""
    return "ws" + base_url.rstrip("/").removeprefix("http") + "/api/v1/stream"


@cache
def _adapter(kind: Any) -> TypeAdapter[Any]:
    return TypeAdapter(kind)
