"""Pages that are made from the software itself when the site is built: REST calls, commands, the notebook.

MkDocs calls ``on_files`` (https://www.mkdocs.org/user-guide/plugins/#events).
"""

import argparse
import importlib
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import nbclient
import nbformat
from jupyter_client.manager import KernelManager
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

from gcs.cli.openapi import openapi_document

DOCS = Path(__file__).parents[1]
NOTEBOOK = DOCS / "notebooks" / "results.ipynb"
REST_INTRO = """Made from the server's own OpenAPI document (`gcs openapi`, or `/openapi.json` of a server). Send
the key as `Authorization: Bearer KEY`. The stream's messages are among the shapes; its address is
`WS /api/v1/stream?rate_hz=5&topics=snapshot&topics=events`."""


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the made pages."""
    for name, text in pages().items():
        files.append(File.generated(config, name, content=text))
    return files


def pages() -> dict[str, str]:
    """Path under docs -> Markdown."""
    return {
        "reference/rest.md": rest_page(openapi_document()),
        "reference/commands.md": commands_page(),
        "notebooks/results.md": notebook_page(executed(NOTEBOOK)),
    }


def rest_page(document: dict[str, Any]) -> str:
    """Every operation by its noun, then every shape."""
    by_tag: dict[str, list[str]] = {}
    for path, methods in document["paths"].items():
        for method, operation in methods.items():
            tag = (operation.get("tags") or ["other"])[0]
            by_tag.setdefault(tag, []).append(_operation(path, method, operation))
    parts = ["# Every call", REST_INTRO]
    for tag, operations in by_tag.items():
        parts += [f"## {tag.capitalize()}", *operations]
    parts.append("## Shapes")
    parts += [_shape(name, schema) for name, schema in document["components"]["schemas"].items()]
    return "\n\n".join(parts) + "\n"


def commands_page() -> str:
    """``--help`` of every command."""
    parts = ["# Every command", "All three also run as `python -m gcs`, `python -m policy`, `python -m sitl_mock`."]
    for program, parser in _programs():
        parts.append(f"## {program}")
        for title, one in _parsers(program, parser):
            parts += [f"### {title}" if title != program else "", f"```text\n{one.format_help().strip()}\n```"]
    return "\n\n".join(part for part in parts if part) + "\n"


def executed(notebook: Path) -> dict[str, Any]:
    """Run now, so that its answers are those of the results that are shipped; a cell that fails fails the site."""
    cells = nbformat.read(notebook, as_version=4)
    place = {"metadata": {"path": str(DOCS.parent)}}
    with tempfile.TemporaryDirectory() as sockets:
        kernel = KernelManager(kernel_name="python3", transport="ipc", ip=f"{sockets}/kernel")
        try:
            nbclient.NotebookClient(cells, km=kernel, timeout=300, resources=place).execute()
        finally:
            kernel.shutdown_kernel(now=True)  # the client leaves a kernel that it was given running
    return dict(cells)


def notebook_page(notebook: dict[str, Any]) -> str:
    """Words, code and its text answers."""
    parts: list[str] = []
    for cell in notebook["cells"]:
        source = "".join(cell["source"]).strip()
        parts.append(source if cell["cell_type"] == "markdown" else f"```python\n{source}\n```")
        parts += [f"```text\n{text}\n```" for text in map(_answer, cell.get("outputs", ())) if text]
    parts.append("The file is `docs/notebooks/results.ipynb`; this page is what it answered when the site was built.")
    return "\n\n".join(parts) + "\n"


def _answer(output: dict[str, Any]) -> str:
    text = output.get("text") or output.get("data", {}).get("text/plain", "")
    return "".join(text).strip("\n")


def _operation(path: str, method: str, operation: dict[str, Any]) -> str:
    rows = [
        (f"`{item['name']}`", item["in"], _type(item["schema"]), item["schema"].get("description", ""))
        for item in operation.get("parameters", [])
    ]
    bodies = operation.get("requestBody", {}).get("content", {}).values()
    rows += [("body", "", _type(media["schema"]), "") for media in bodies]
    answers = [
        (code, _type(media.get("schema", {})))
        for code, answer in operation["responses"].items()
        for kind, media in (answer.get("content") or {"": {}}).items()
        if code.startswith("2")
    ]
    words = " ".join(operation.get("description", operation["summary"]).split())
    lines = [f"### `{method.upper()} {path}`", words]
    if rows:
        lines.append(_table(("takes", "in", "type", ""), rows))
    lines.append("Answers " + ", ".join(f"{code}: {kind}" for code, kind in answers) + ".")
    return "\n\n".join(lines)


def _shape(name: str, schema: dict[str, Any]) -> str:
    needed = schema.get("required", ())
    rows = [
        (f"`{field}`", "" if field in needed else "optional", _type(body))
        for field, body in schema.get("properties", {}).items()
    ]
    words = " ".join(schema.get("description", "").split())
    table = _table(("field", "", "type"), rows) if rows else f"One of {_type(schema)}."
    return "\n\n".join(part for part in (f"### {name}", words, table) if part)


def _table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    cells = [tuple(str(cell).replace("|", "\\|").replace("\n", " ") for cell in row) for row in rows]
    lines = [f"| {' | '.join(head)} |", f"|{' --- |' * len(head)}", *(f"| {' | '.join(row)} |" for row in cells)]
    return "\n".join(lines)


def _type(schema: dict[str, Any]) -> str:
    """A type in a few words; names lead to their shapes."""
    if "$ref" in schema:
        name = schema["$ref"].rpartition("/")[2]
        return f"[{name}](#{name.lower()})"
    for word in ("anyOf", "oneOf", "allOf"):
        if word in schema:
            return " or ".join(_type(part) for part in schema[word])
    if "enum" in schema or "const" in schema:
        return ", ".join(f"`{value}`" for value in schema.get("enum", [schema.get("const")]))
    if schema.get("type") == "array":
        parts = schema.get("prefixItems")
        return f"({', '.join(map(_type, parts))})" if parts else f"list of {_type(schema.get('items', {}))}"
    return str(schema.get("format") or schema.get("type") or "anything")


def _programs() -> Iterator[tuple[str, argparse.ArgumentParser]]:
    for program, module in (
        ("gcs", "gcs.__main__"),
        ("policy", "policy.__main__"),
        ("sitl-mock", "sitl_mock.__main__"),
    ):
        yield program, importlib.import_module(module).parser()


def _parsers(name: str, parser: argparse.ArgumentParser) -> Iterator[tuple[str, argparse.ArgumentParser]]:
    """The parser and every one below it."""
    yield name, parser
    for action in parser._actions:  # noqa: SLF001 - argparse has no other way to its subcommands
        if isinstance(action, argparse._SubParsersAction):  # noqa: SLF001
            for word, below in action.choices.items():
                yield from _parsers(f"{name} {word}", below)
