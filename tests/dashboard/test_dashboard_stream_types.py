"""The page's own description of the stream and the server's are one."""

import re
from pathlib import Path

import pytest
from pydantic import BaseModel

from gcs.api import schemas

TYPES = Path(__file__).resolve().parents[2] / "gcs" / "dashboard" / "src" / "core" / "types.ts"
INTERFACES = dict(re.findall(r"export interface (\w+) \{\n(.*?)\n\}", TYPES.read_text("utf-8"), flags=re.DOTALL))


def test_every_message_of_the_server_is_known_to_the_page():
    sent = {model.__name__ for model in schemas.Message.__subclasses__()} - {"Subscribe"}
    assert sent == set(INTERFACES)


@pytest.mark.parametrize("name", sorted(INTERFACES))
def test_fields_are_the_same_and_may_be_null_where_the_server_may_leave_them_out(name: str):
    model: type[BaseModel] = getattr(schemas, name)
    page = dict(re.findall(r"^ +(\w+): (.+);", INTERFACES[name], flags=re.MULTILINE))
    assert list(page) == list(model.model_fields)
    optional = {
        field for field, info in model.model_fields.items() if type(None) in getattr(info.annotation, "__args__", ())
    }
    assert {field for field, kind in page.items() if "null" in kind} == optional
