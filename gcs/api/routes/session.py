"""Who the client is, for the page's sign-in."""

from fastapi import APIRouter

from gcs.api.bodies import SessionView
from gcs.api.context import Context, Who

router = APIRouter(tags=["session"])


@router.get("/me")
def me(context: Context, who: Who) -> SessionView:
    """Name and role of the key that was sent, or of the open reader on loopback."""
    settings = context.settings
    return SessionView(actor=who.name, role=who.role, version=settings.version, open_reading=settings.open_reading)
