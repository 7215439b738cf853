"""Writes ``gcs/client/models.py``: ``python -m gcs openapi | python gcs/client/write_models.py``.

Only what answers are made of; pydantic does the parsing. Fields that a newer server adds are passed over.
"""

import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

HEAD = '''"""What the server answers, as types. Written by ``gcs/client/write_models.py``; do not change by hand."""

from __future__ import annotations

from datetime import datetime
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict


class Answer(BaseModel):
    """Frozen; fields that a newer server adds are passed over."""

    model_config = ConfigDict(frozen=True, extra="ignore")
'''
SCALARS = {"string": "str", "integer": "int", "number": "float", "boolean": "bool", "null": "None"}
REQUESTS = ("Body", "Format", "Subscribe")  # ends of the names of what a client sends
ANSWERS = ("VerdictBody",)


def models(document: Mapping[str, Any]) -> dict[str, dict[str, str]]:
    """Class -> field -> annotation, with `` = None`` and the like where the server may leave it out."""
    schemas: Mapping[str, Any] = document["components"]["schemas"]
    return {
        name: {field: _field(schema, field, body) for field, body in schema["properties"].items()}
        for name, schema in schemas.items()
        if "properties" in schema and (name in ANSWERS or not name.endswith(REQUESTS))
    }


def annotation(schema: Mapping[str, Any]) -> str:  # noqa: PLR0911 - one line a kind of schema
    """A JSON schema as a Python type."""
    if "$ref" in schema:
        name: str = schema["$ref"].rpartition("/")[2]
        return "str" if name == "Severity" else name
    for word in ("anyOf", "oneOf"):
        if word in schema:
            return " | ".join(annotation(part) for part in schema[word])
    if "const" in schema or "enum" in schema:
        return f"Literal[{', '.join(_literal(v) for v in schema.get('enum', [schema.get('const')]))}]"
    match schema.get("type"):
        case "array" if "prefixItems" in schema:
            return f"tuple[{', '.join(annotation(part) for part in schema['prefixItems'])}]"
        case "array":
            return f"list[{annotation(schema.get('items', {}))}]"
        case "object":
            values = schema.get("additionalProperties")
            return f"dict[str, {annotation(values) if isinstance(values, dict) else 'Any'}]"
        case "string" if schema.get("format") == "date-time":
            return "datetime"
        case str(kind):
            return SCALARS[kind]
        case _:
            return "Any"


def source(document: Mapping[str, Any]) -> str:
    """The module's text."""
    schemas = document["components"]["schemas"]
    parts = [HEAD]
    for name, fields in models(document).items():
        words = " ".join(schemas[name].get("description", name).split()).replace('"', "'")
        lines = [f"class {name}(Answer):", f'    """{words}"""', ""]
        lines += [f"    {field}: {text}" for field, text in fields.items()]
        parts.append("\n".join(lines))
    return "\n\n".join(parts) + "\n"


def _field(schema: Mapping[str, Any], field: str, body: Mapping[str, Any]) -> str:
    kind = annotation(body)
    if field in schema.get("required", ()):
        return kind
    default = body.get("default")
    return f"{kind} = {_literal(default)}" if default is not None else f"{kind} = None"


def _literal(value: Any) -> str:
    return json.dumps(value) if isinstance(value, str) else repr(value)


if __name__ == "__main__":
    Path(__file__).with_name("models.py").write_text(source(json.load(sys.stdin)), encoding="utf-8")
