"""Errors as RFC 9457 problem documents: one shape for every refusal, whoever refuses.

``type`` stays about:blank (section 4.2.1): the status says what kind of problem it is, ``detail`` what went wrong,
where, and how to mend it. Answers never quote a client's input at length.
"""

import json
from collections.abc import Mapping, Sequence
from http import HTTPStatus
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from sqlalchemy.exc import OperationalError
from sqlalchemy.exc import TimeoutError as SqlTimeoutError
from starlette.exceptions import HTTPException
from starlette.responses import Response

from policy.mission_file import MissionError

MEDIA_TYPE = "application/problem+json"
MAX_ERRORS = 20  # a batch of 10,000 wrong fixes is told by its first ones


class Problem(Exception):  # noqa: N818 the RFC's word
    """Raised by routes; becomes a problem document."""

    def __init__(self, status: int, detail: str, headers: Mapping[str, str] | None = None, **members: Any) -> None:
        super().__init__(detail)
        self.status, self.detail, self.headers, self.members = status, detail, dict(headers or {}), members


def problem_response(
    status: int, detail: str, *, instance: str = "", headers: Mapping[str, str] | None = None, **members: Any
) -> Response:
    """The document; ASCII only, so that no text of a client can make it unsendable."""
    document = {"type": "about:blank", "title": HTTPStatus(status).phrase, "status": status, "detail": detail}
    body = json.dumps(document | {"instance": instance[:500]} | members, ensure_ascii=True, allow_nan=False)
    return Response(body, status, headers, media_type=MEDIA_TYPE)


def install(app: FastAPI) -> None:
    """Every way in which a request can end badly."""
    app.add_exception_handler(Problem, _on_problem)
    app.add_exception_handler(HTTPException, _on_http)
    app.add_exception_handler(RequestValidationError, _on_validation)
    app.add_exception_handler(MissionError, _on_unreadable_record)
    app.add_exception_handler(OperationalError, _on_store_away)
    app.add_exception_handler(SqlTimeoutError, _on_store_away)
    app.add_exception_handler(Exception, _on_defect)


async def _on_problem(request: Request, error: Exception) -> Response:
    assert isinstance(error, Problem)
    return problem_response(
        error.status, error.detail, instance=request.url.path, headers=error.headers, **error.members
    )


async def _on_http(request: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)
    details = {
        404: f"there is nothing at {request.url.path[:200]}; see /docs for what there is",
        405: f"{request.method[:20]} is not possible here; see the Allow header",
    }
    detail = details.get(error.status_code, str(error.detail))
    return problem_response(error.status_code, detail, instance=request.url.path, headers=error.headers)


async def _on_validation(request: Request, error: Exception) -> Response:
    assert isinstance(error, RequestValidationError)
    faults = error.errors()
    errors = [_fault(fault) for fault in faults[:MAX_ERRORS]]
    more = f" (and {len(faults) - 1} more)" if len(faults) > 1 else ""
    detail = f"{errors[0]['where']}: {errors[0]['detail']}{more}"
    return problem_response(422, detail, instance=request.url.path, errors=errors)


async def _on_unreadable_record(request: Request, error: Exception) -> Response:
    """A campaign of another version; documents that a client sends are answered for by ``campaign_documents``."""
    return problem_response(409, f"this version cannot read it: {error}", instance=request.url.path)


async def _on_store_away(request: Request, error: Exception) -> Response:
    """Locked, full, or its server is gone: nothing was done, and flying goes on without it."""
    words = str(error).splitlines()[0].rpartition(") ")[2][:200]
    detail = f"the store does not answer ({words}); nothing was done, see /readyz"
    return problem_response(503, detail, instance=request.url.path, headers={"retry-after": "5"})


async def _on_defect(request: Request, error: Exception) -> Response:  # noqa: ARG001 the server logs it
    """Ours, not the client's: told without insides; the log has the traceback."""
    return problem_response(500, "the server has a defect; its log says more", instance=request.url.path)


def _fault(fault: Mapping[str, Any]) -> dict[str, str]:
    """Where as a JSON pointer into the body, or the name of the parameter."""
    place: Sequence[Any] = fault["loc"]
    where = "/" + "/".join(str(part)[:60] for part in place[1:]) if place[0] == "body" else ".".join(map(str, place))
    return {"where": "body" if where == "/" else where, "detail": str(fault["msg"])[:300]}
