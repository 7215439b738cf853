"""Every operation of the server's OpenAPI document, with every query parameter, has a method in both clients.

Each public method is called with made-up arguments against a transport that only notes what was asked.
"""

import asyncio
import inspect
import re
from collections.abc import Iterator
from datetime import UTC, datetime
from typing import Any

import httpx
import pytest

from gcs.cli.openapi import openapi_document
from gcs.client import ApiError, AsyncClient, Client, calls

DOCUMENT = openapi_document()
OPERATIONS = {
    (method.upper(), path): operation
    for path, operations in DOCUMENT["paths"].items()
    for method, operation in operations.items()
}
MADE_OF_OTHERS = ("aclose", "close", "first", "stream", "wait")  # no call of their own, or the stream
MADE_UP = {"Sequence": [{"user": "u1"}], "MissionLike": "demo", "datetime": datetime.now(UTC), "float": 1.5, "str": "x"}
MADE_UP |= {"int": 7, "bool": True}
STREAM_ONLY_FOR_THE_PAGE = {"DeltaMessage", "FixesMessage"}


def made_up(parameter: inspect.Parameter) -> Any:
    """An argument unlike the default, so that it is sent; ``places=False`` for example."""
    if isinstance(parameter.default, bool):
        return not parameter.default
    words = str(parameter.annotation)
    return next(value for kind, value in MADE_UP.items() if kind in words)


def arguments(method: Any) -> Iterator[dict[str, Any]]:
    """What must be given, and then with all that may be given."""
    parameters = [p for p in inspect.signature(method).parameters.values() if p.name != "self"]
    yield {p.name: made_up(p) for p in parameters if p.default is p.empty}
    yield {p.name: made_up(p) for p in parameters}


def public(client: type) -> list[str]:
    return [name for name, _ in inspect.getmembers(client, inspect.isfunction) if not name.startswith("_")]


def operation_of(request: httpx.Request) -> tuple[str, str]:
    """The document's own name of what was asked; a fixed path before one with a parameter."""
    for method, path in sorted(OPERATIONS, key=lambda operation: operation[1].count("{")):
        if method == request.method and re.fullmatch(re.sub(r"\{\w+\}", "[^/]+", path), request.url.path):
            return method, path
    raise AssertionError(f"the server has no {request.method} {request.url.path}")


def asked_by(kind: type[Client | AsyncClient]) -> dict[tuple[str, str], set[str]]:
    """Operation -> the query parameters that some call of some method sent."""
    asked: dict[tuple[str, str], set[str]] = {}

    def note(request: httpx.Request) -> httpx.Response:
        asked.setdefault(operation_of(request), set()).update(request.url.params.keys())
        return httpx.Response(418)

    async def ask(client: Client | AsyncClient, name: str, given: dict[str, Any]) -> None:
        answer = getattr(client, name)(**given)
        await answer  # the waiting client has raised already

    client = kind("http://test", transport=httpx.MockTransport(note))
    for name in set(public(kind)) - set(MADE_OF_OTHERS):
        for given in arguments(getattr(kind, name)):
            with pytest.raises(ApiError, match="418"):
                asyncio.run(ask(client, name, given))
    return asked


@pytest.mark.parametrize("kind", [Client, AsyncClient])
def test_every_operation_and_query_parameter_has_a_method(kind: type[Client | AsyncClient]) -> None:
    asked = asked_by(kind)
    assert set(OPERATIONS) - set(asked) == set(), "add a method to gcs/client/aio.py, then run make client"
    for name, operation in OPERATIONS.items():
        known = {item["name"] for item in operation.get("parameters", ()) if item["in"] == "query"}
        assert asked[name] == known, f"{name}: parameters of the method"


def test_both_clients_have_the_same_methods() -> None:
    assert set(public(Client)) - {"close"} == set(public(AsyncClient)) - {"aclose"}


def test_every_message_of_the_stream_is_known() -> None:
    messages = {name for name in DOCUMENT["components"]["schemas"] if name.endswith("Message")}
    assert {kind.__name__ for kind in calls.STREAM.values()} == messages - STREAM_ONLY_FOR_THE_PAGE


def test_a_server_that_is_not_there_is_told_sooner_than_one_that_is_slow() -> None:
    times = calls.timeouts(calls.TIMEOUT_S)
    assert (times.connect, times.read) == (5.0, 70.0)
    assert calls.timeouts(2.0).connect == 2.0
