"""The operator page, built beforehand; where it is not, a page that says how to build it."""

from pathlib import Path

from fastapi import FastAPI
from starlette.requests import Request
from starlette.responses import HTMLResponse, Response
from starlette.staticfiles import StaticFiles

NOT_BUILT = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>UAV crowdsensing</title></head>
<body style="font: 1rem/1.5 system-ui; max-width: 40rem; margin: 4rem auto; padding: 0 1rem">
<h1>The operator page is not built</h1>
<p>The server runs. Build the page with <code>python gcs/dashboard/build.py</code> and load this address again.</p>
<p>Meanwhile: <a href="/docs">the API</a>, <a href="/readyz">readiness</a>.</p>
</body></html>
"""


def install(app: FastAPI, dashboard: Path) -> None:
    """Serve ``dashboard`` at / when it is there."""
    if (dashboard / "index.html").is_file():
        app.mount("/", StaticFiles(directory=dashboard, html=True), name="dashboard")
    else:
        app.add_api_route("/", _not_built, include_in_schema=False, response_class=HTMLResponse)


async def _not_built(request: Request) -> Response:  # noqa: ARG001 the same for all
    return HTMLResponse(NOT_BUILT)
