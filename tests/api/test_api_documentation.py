"""/docs: complete, and nothing in it comes from elsewhere."""

import re

from api_server import Server

from gcs.api.documentation import render


def test_every_operation_is_there_and_no_other_host_is_asked(keyed: Server) -> None:
    with keyed.client() as client:
        page, document = client.get("/docs"), client.get("/openapi.json").json()
    assert page.status_code == 200
    for path in document["paths"]:
        assert f"<code>{path}</code>" in page.text
    for name in document["components"]["schemas"]:
        assert f'id="{name}"' in page.text
    assert "<script" not in page.text
    assert not re.search(r"(src|href)=['\"]?(https?:)?//", page.text)
    assert "http" not in page.headers["content-security-policy"]


def test_what_a_document_says_cannot_become_markup() -> None:
    document = {
        "info": {"title": "<b>t</b>", "version": "1"},
        "paths": {"/<x>": {"get": {"description": "<script>", "responses": {}}}},
    }
    page = render(document)
    assert "<script>" not in page
    assert "&lt;script&gt;" in page
    assert "<code>/&lt;x&gt;</code>" in page
