"""What lies under the campaign on the map, by configuration; the page asks nobody else for anything."""

from typing import Literal

from fastapi import APIRouter
from starlette.responses import FileResponse

from gcs.api.bodies import View
from gcs.api.context import Context
from gcs.api.problems import Problem

router = APIRouter(prefix="/map", tags=["shelf"])
FILE = "tiles.pmtiles"


class MapView(View):
    """``url`` has {z}, {x}, {y} with tiles, is this server's file with pmtiles, and is null with none."""

    kind: Literal["none", "tiles", "pmtiles"]
    url: str | None
    attribution: str


@router.get("")
def map_view(context: Context) -> MapView:
    """The configured background; the plain one needs no network."""
    tiles = context.settings.map_tiles
    if tiles.pmtiles is not None:
        return MapView(kind="pmtiles", url=f"map/{FILE}", attribution=tiles.attribution)
    return MapView(kind="none" if tiles.url is None else "tiles", url=tiles.url, attribution=tiles.attribution)


@router.get(f"/{FILE}", response_class=FileResponse)
def pmtiles(context: Context) -> FileResponse:
    """The file, read in parts (Range)."""
    path = context.settings.map_tiles.pmtiles
    if path is None or not path.is_file():
        raise Problem(404, "no PMTiles file is configured: name one under [map] pmtiles")
    return FileResponse(path, media_type="application/vnd.pmtiles", headers={"cache-control": "private, max-age=3600"})
