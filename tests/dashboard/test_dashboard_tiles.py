"""What lies under the campaign: a PMTiles file of the server, tiles of another one, and what is said when they fail."""

import io
from collections.abc import Iterator
from pathlib import Path

import pytest
from operator_desk import Desk
from PIL import Image
from playwright.sync_api import BrowserContext, Page, Route, expect
from tile_files import pmtiles, png

from gcs.api.settings import MapTiles
from gcs.store.store import using_store

pytestmark = pytest.mark.browser
GREEN = (40, 160, 60)
URL = "https://tiles.example.org/{z}/{x}/{y}.png"


@pytest.fixture
def open_desk(built_page: Path, tmp_path: Path) -> Iterator[Desk]:
    with using_store(f"sqlite:///{tmp_path / 'tiles.sqlite3'}") as store:
        desk = Desk(store)
        yield desk
        desk.stop()


def is_green(page: Page) -> bool:
    """The map's corner, outside of any campaign and any control."""
    shot = page.get_by_test_id("map").screenshot()
    red, green, blue = Image.open(io.BytesIO(shot)).convert("RGB").getpixel((60, 250))  # type: ignore[misc]
    return green > red + 50 and green > blue + 50


def wait_until_green(page: Page) -> None:
    for _ in range(100):
        if is_green(page):
            return
        page.wait_for_timeout(100)
    pytest.fail("the tiles are not on the map")


def test_a_pmtiles_file_lies_under_the_campaign(open_desk: Desk, context: BrowserContext, tmp_path: Path):
    file = tmp_path / "world.pmtiles"
    file.write_bytes(pmtiles(png(GREEN)))
    open_desk.map_tiles = MapTiles(pmtiles=file, attribution="drawn for this test")
    open_desk.start()
    page = context.new_page()
    page.goto(open_desk.url)
    wait_until_green(page)
    expect(page.get_by_text("drawn for this test")).to_be_attached()


def test_tiles_of_another_server_are_asked_of_it_and_of_nobody_else(open_desk: Desk, context: BrowserContext):
    open_desk.map_tiles = MapTiles(url=URL)
    open_desk.start()
    page = context.new_page()
    asked: list[str] = []

    def answer(route: Route) -> None:
        asked.append(route.request.url)
        headers = {"access-control-allow-origin": "*"}
        route.fulfill(body=png(GREEN), content_type="image/png", headers=headers)

    context.route(lambda url: not url.startswith(open_desk.url), answer)
    page.goto(open_desk.url)
    wait_until_green(page)
    assert asked
    assert all(url.startswith("https://tiles.example.org/") for url in asked), asked


def test_a_broken_file_is_told_and_the_map_works_without_it(open_desk: Desk, context: BrowserContext, tmp_path: Path):
    file = tmp_path / "broken.pmtiles"
    file.write_bytes(b"no tiles at all" * 20)
    open_desk.map_tiles = MapTiles(pmtiles=file)
    open_desk.start()
    page = context.new_page()
    page.goto(open_desk.url)
    expect(page.get_by_text("No map below the campaign")).to_be_visible()
    expect(page.get_by_test_id("drone-1")).to_contain_text("82%")
