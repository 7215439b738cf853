"""A typed client of the server: :class:`Client` waits, :class:`AsyncClient` awaits; both have the same methods.

It needs httpx, pydantic and websockets, and nothing of the server.
"""

from gcs.client.aio import AsyncClient
from gcs.client.errors import ApiError, ClientError, UnreachableError
from gcs.client.sync import Client

__all__ = ["ApiError", "AsyncClient", "Client", "ClientError", "UnreachableError"]
