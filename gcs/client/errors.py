"""How a call can end badly: the server said no, or nobody answered."""

from typing import Any

import httpx


class ClientError(Exception):
    """Either of the two below."""


class UnreachableError(ClientError):
    """No answer: the server is not there, or too slow. A change may have been made or not: look, then repeat."""


class ApiError(ClientError):
    """A problem document (RFC 9457): ``detail`` says what is wrong, where, and how to mend it."""

    def __init__(self, status: int, detail: str, document: dict[str, Any]) -> None:
        super().__init__(f"{status}: {detail}")
        self.status, self.detail, self.document = status, detail, document

    @property
    def state(self) -> str | None:
        """The campaign's state, with a 409 on one."""
        return self.document.get("state")

    @property
    def errors(self) -> list[dict[str, str]]:
        """With a 422: ``where`` and ``detail`` of each fault."""
        return list(self.document.get("errors", []))


def raise_problem(response: httpx.Response) -> None:
    """Raise ApiError unless the answer is a good one."""
    if response.is_success:
        return
    try:
        document = response.json()
    except ValueError:
        document = {}
    if not isinstance(document, dict):
        document = {}
    detail = str(document.get("detail") or response.reason_phrase or "no reason was given")
    raise ApiError(response.status_code, detail, document)
