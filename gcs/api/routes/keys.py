"""API keys, for admins."""

from dataclasses import asdict
from typing import Annotated

from fastapi import APIRouter, Path

from gcs.api.bodies import KeyBody, KeyView, NewKeyView
from gcs.api.context import Context, Who
from gcs.api.problems import Problem
from gcs.store.keys import Role

router = APIRouter(prefix="/keys", tags=["keys"])
KeyId = Annotated[str, Path(pattern="^[0-9a-f]{8}$")]


@router.get("")
def keys(context: Context) -> list[KeyView]:
    """Every key that ever was, without secrets."""
    return [KeyView(**asdict(record)) for record in context.store.keys.all()]


@router.post("", status_code=201)
def add(body: KeyBody, context: Context, who: Who) -> NewKeyView:
    """A new key; its text is shown in this answer only."""
    context.audit(who.name, "keys.added", f'{body.role} key for "{body.name}"')
    record, text = context.store.keys.add(body.name, Role(body.role))
    return NewKeyView(**asdict(record), key=text)


@router.delete("/{key_id}", status_code=204)
def revoke(key_id: KeyId, context: Context, who: Who) -> None:
    """A revoked key stops working at once."""
    if not context.store.keys.revoke(key_id):
        raise Problem(404, f"there is no active key {key_id}")
    context.audit(who.name, "keys.revoked", f"key {key_id} revoked")
