"""An area of one's own: drawn, typed, and carried in files."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from operator_desk import Desk
from playwright.sync_api import Page, expect
from test_dashboard_browser import sign_in

pytestmark = pytest.mark.browser
Shot = Callable[[Page, str], None]


def open_draft(page: Page) -> None:
    sign_in(page)
    page.get_by_label("Mission").select_option("demo")
    page.get_by_label("Policy", exact=True).select_option("random")
    page.get_by_role("button", name="Change the area").click()
    expect(page.get_by_test_id("map")).to_have_attribute("data-obstacles", "3")


def created(page: Page, desk: Desk) -> dict[str, object]:
    """The area of the campaign that the page has the server create."""
    page.get_by_role("button", name="Create").click()
    expect(page.get_by_text("drawn created")).to_be_visible()
    (record,) = desk.store.campaigns.newest(1, 0)
    return dict(record.document)


def test_an_obstacle_is_drawn_with_clicks_and_the_launch_point_set(page: Page, desk: Desk, shot: Shot):
    open_draft(page)
    box = page.get_by_test_id("map").bounding_box()
    assert box is not None
    middle = (box["width"] / 2, box["height"] / 2)

    def click(east_px: float, south_px: float) -> None:
        at = {"x": middle[0] + east_px, "y": middle[1] + south_px}
        page.locator(".maplibregl-canvas").click(position=at)  # type: ignore[arg-type]

    page.get_by_role("button", name="Draw obstacle").click()
    for corner in ((-90, 60), (-40, 60), (-40, 100), (-90, 100)):
        click(*corner)
    page.keyboard.press("Enter")
    expect(page.get_by_test_id("map")).to_have_attribute("data-obstacles", "4")
    shot(page, "dashboard_draft")
    page.get_by_role("button", name="Set launch point").click()
    click(-20, 30)
    document = created(page, desk)
    drawn = document["area"]["obstacles"][3]  # type: ignore[index]
    assert (drawn["name"], len(drawn["polygon_m"])) == ("obstacle 4", 4)
    (east_m, north_m), *_ = drawn["polygon_m"]
    assert 300.0 < east_m < 800.0
    assert 200.0 < north_m < 600.0
    assert document["fleet"]["launch_m"] != [[800.0, 600.0]]  # type: ignore[index]


def test_a_plan_comes_in_and_goes_out_and_all_can_be_typed(page: Page, desk: Desk, tmp_path: Path):
    open_draft(page)
    fence = {"inclusion": True, "polygon": [[47.0, 8.0], [47.0, 8.02], [47.01, 8.02], [47.01, 8.0]], "version": 1}
    zone = {"inclusion": False, "polygon": [[47.002, 8.002], [47.002, 8.004], [47.004, 8.004]], "version": 1}
    plan = {
        "fileType": "Plan",
        "version": 1,
        "geoFence": {"circles": [], "polygons": [fence, zone], "version": 2},
        "mission": {"plannedHomePosition": [47.005, 8.01, 400], "items": [], "version": 2},
    }
    path = tmp_path / "field.plan"
    path.write_text(json.dumps(plan))
    page.get_by_label("Import GeoJSON or .plan").set_input_files(path)
    expect(page.get_by_test_id("map")).to_have_attribute("data-obstacles", "1")
    page.get_by_label("Height of no-fly zone 1").fill("140")
    page.get_by_label("Height of no-fly zone 1").press("Enter")
    with page.expect_download() as download:
        page.get_by_role("button", name="Export .plan").click()
    exported = json.loads(Path(download.value.path()).read_text("utf-8"))
    assert exported["geoFence"]["polygons"][0]["polygon"][0] == [47.0, 8.0]
    assert [one["inclusion"] for one in exported["geoFence"]["polygons"]] == [True, False]
    assert list(desk.store.campaigns.newest(1, 0)) == []
    document = created(page, desk)
    assert document["area"]["south_west"] == [47.0, 8.0]  # type: ignore[index]
    assert document["area"]["obstacles"][0]["height_m"] == 140  # type: ignore[index]
