"""RFC 9457 problem documents: every refusal of the HTTP service has this one form."""

from collections.abc import Sequence
from http import HTTPStatus
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from starlette.exceptions import HTTPException

MEDIA_TYPE = "application/problem+json"


class ProblemError(Exception):
    """A refusal to be answered with a problem document."""

    def __init__(self, status: HTTPStatus, detail: str) -> None:
        """``detail`` says what is wrong, where, and how to mend it."""
        super().__init__(detail)
        self.status = status
        self.detail = detail


def problem(status: int, detail: str, errors: Sequence[dict[str, str]] = ()) -> JSONResponse:
    """The document; ``errors`` points at single faults as {"pointer", "detail"}."""
    content: dict[str, Any] = {
        "type": "about:blank",
        "title": HTTPStatus(status).phrase,
        "status": int(status),
        "detail": _printable(detail),
    }
    if errors:
        content["errors"] = list(errors)
    return JSONResponse(content, status_code=int(status), media_type=MEDIA_TYPE)


def install(app: FastAPI) -> None:
    """Answer all errors of ``app`` with problem documents."""

    @app.exception_handler(ProblemError)
    async def refused(_: Request, error: ProblemError) -> JSONResponse:
        return problem(error.status, error.detail)

    @app.exception_handler(HTTPException)
    async def http(_: Request, error: HTTPException) -> JSONResponse:
        return problem(error.status_code, str(error.detail))

    @app.exception_handler(RequestValidationError)
    async def invalid(_: Request, error: RequestValidationError) -> JSONResponse:
        faults = [_fault(entry) for entry in error.errors()[:20]]
        first = faults[0]
        return problem(HTTPStatus.UNPROCESSABLE_ENTITY, f"{first['pointer']}: {first['detail']}", faults)


def _fault(entry: dict[str, Any]) -> dict[str, str]:
    """Where and what, never the value: it may be huge, or nothing that JSON can say."""
    place = [str(part)[:60] for part in entry["loc"] if part != "body"]
    return {"pointer": _printable("#/" + "/".join(place)), "detail": _printable(str(entry["msg"]))}


def _printable(text: str) -> str:
    return text.encode("utf-8", "replace").decode("utf-8")
