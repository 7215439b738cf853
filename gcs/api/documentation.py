"""/docs: the OpenAPI document as one page, made here, without scripts and without the Internet."""

from html import escape
from typing import Any

from fastapi import FastAPI
from starlette.requests import Request
from starlette.responses import HTMLResponse, Response

STYLE = """
body { font: 1rem/1.5 system-ui, sans-serif; max-width: 60rem; margin: 2rem auto; padding: 0 1rem; color: #222 }
summary { cursor: pointer; padding: .3rem 0 } code { background: #eee; padding: 0 .3em }
.method { display: inline-block; min-width: 4rem; font-weight: 600 }
details { border-top: 1px solid #ddd } details > div { padding: 0 0 1rem 4rem }
table { border-collapse: collapse } td, th { text-align: left; padding: .2rem 1rem .2rem 0; vertical-align: top }
@media (prefers-color-scheme: dark) { body { background: #181818; color: #ddd } code { background: #333 } }
"""


def install(app: FastAPI) -> None:
    """Serve it at /docs."""

    async def docs(request: Request) -> Response:  # noqa: ARG001 the same for all
        return HTMLResponse(render(app.openapi()))

    app.add_api_route("/docs", docs, include_in_schema=False, response_class=HTMLResponse)


def render(document: dict[str, Any]) -> str:
    """Every operation with what it takes and gives; names of bodies lead to their shapes."""
    title = escape(f"{document['info']['title']} {document['info']['version']}")
    operations = [
        _operation(path, method, operation)
        for path, methods in document["paths"].items()
        for method, operation in methods.items()
    ]
    schemas = [_schema(name, schema) for name, schema in document.get("components", {}).get("schemas", {}).items()]
    intro = (
        'The machine-readable document is <a href="/openapi.json">/openapi.json</a>. Send a key as '
        "<code>Authorization: Bearer KEY</code>; a repeated change with the same "
        "<code>Idempotency-Key</code> acts once. The stream is <code>WS /api/v1/stream</code>."
    )
    return (
        f'<!doctype html><html lang="en"><head><meta charset="utf-8"><title>{title}</title>'
        f"<style>{STYLE}</style></head>"
        f"<body><h1>{title}</h1><p>{intro}</p><h2>Operations</h2>{''.join(operations)}"
        f"<h2>Shapes</h2>{''.join(schemas)}</body></html>"
    )


def _operation(path: str, method: str, operation: dict[str, Any]) -> str:
    rows = [
        (item["name"], f"{item['in']}{', needed' if item.get('required') else ''}", _type(item.get("schema", {})))
        for item in operation.get("parameters", [])
    ]
    bodies = operation.get("requestBody", {}).get("content", {}).values()
    rows += [("body", "", _type(media.get("schema", {}))) for media in bodies]
    answers = [
        (code, escape(answer.get("description", "")), _answer_type(answer))
        for code, answer in operation.get("responses", {}).items()
    ]
    return (
        f'<details><summary><span class="method">{escape(method.upper())}</span> <code>{escape(path)}</code></summary>'
        f"<div><p>{escape(operation.get('description', operation.get('summary', '')))}</p>"
        f"{_table('takes', rows)}{_table('answers', answers)}</div></details>"
    )


def _answer_type(answer: dict[str, Any]) -> str:
    return ", ".join(_type(media.get("schema", {})) for media in answer.get("content", {}).values())


def _schema(name: str, schema: dict[str, Any]) -> str:
    needed = set(schema.get("required", []))
    rows = [
        (key, "needed" if key in needed else "", _type(value)) for key, value in schema.get("properties", {}).items()
    ]
    words = escape(schema.get("description", ""))
    body = _table("members", rows) if rows else f"<p>{_type(schema)}</p>"
    return f'<details id="{escape(name)}"><summary>{escape(name)}</summary><div><p>{words}</p>{body}</div></details>'


def _table(head: str, rows: list[tuple[str, str, str]]) -> str:
    """Cells two and three are HTML already."""
    if not rows:
        return ""
    lines = [f"<tr><td><code>{escape(name)}</code></td><td>{how}</td><td>{what}</td></tr>" for name, how, what in rows]
    return f"<table><tr><th colspan='3'>{escape(head)}</th></tr>{''.join(lines)}</table>"


def _type(schema: dict[str, Any]) -> str:
    """A type in a few words, as HTML."""
    if "$ref" in schema:
        name = escape(schema["$ref"].rpartition("/")[2])
        return f'<a href="#{name}">{name}</a>'
    for word in ("anyOf", "oneOf"):
        if word in schema:
            return " or ".join(_type(part) for part in schema[word])
    if "enum" in schema or "const" in schema:
        return escape(", ".join(map(str, schema.get("enum", [schema.get("const")]))))
    if schema.get("type") == "array":
        return f"list of {_type(schema.get('items', {}))}"
    return escape(str(schema.get("format") or schema.get("type") or "anything"))
