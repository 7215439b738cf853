"""A recorded campaign on the page: played, searched, left, and never in the way of a flight."""

import re
from collections.abc import Callable

import pytest
from operator_desk import Desk
from playwright.sync_api import Page, expect
from test_dashboard_access import complaints
from test_dashboard_browser import control, fly_demo, hold

from gcs.ports import RequestKind

pytestmark = pytest.mark.browser
Shot = Callable[[Page, str], None]


def position(page: Page) -> float:
    return float(page.get_by_test_id("replay").get_attribute("data-position") or "nan")


def land(page: Page, desk: Desk) -> None:
    """Fly some slots, with a warning among them, and end the campaign."""
    fly_demo(page)
    expect(page.get_by_test_id("slot-clock")).to_contain_text(re.compile(r"slot ([3-9]|\d\d) of 60"))
    desk.flight.lose(2)
    expect(page.get_by_test_id("slot-clock")).to_contain_text(re.compile(r"slot ([6-9]|\d\d) of 60"))
    hold(page, control(page, "^Abort"))
    expect(page.get_by_test_id("campaign-state")).to_have_text("recovering")
    desk.flight.finish()
    expect(page.get_by_test_id("campaign-state")).to_have_text("done")


def test_a_flown_campaign_is_replayed_with_the_same_views_and_left_again(page: Page, desk: Desk, shot: Shot):
    land(page, desk)
    assert desk.store.journal.flush(10.0)
    page.get_by_role("link", name="Replay demo").click()
    replay = page.get_by_test_id("replay")
    expect(replay).to_be_visible()
    expect(page.get_by_test_id("map")).to_have_attribute("data-users", "60")
    expect(page.get_by_test_id("map")).to_have_attribute("data-drones", "2")
    expect(page.get_by_test_id("recorded-state")).to_have_text("recorded")
    expect(replay).to_have_attribute("data-position", re.compile(r"^[1-9]"))  # it plays by itself
    page.get_by_role("button", name="Pause the replay").click()
    slider = page.get_by_label("Time of the replay, seconds")
    slider.focus()
    slider.press("Home")
    assert position(page) == 0.0
    log = page.get_by_role("region", name="Events").get_by_role("listitem")
    early = log.count()
    page.get_by_role("button", name="One slot on").click()
    assert position(page) == 1.0
    page.get_by_role("button", name="Next alert").click()
    expect(log.first).to_contain_text("UAV 2 is not heard any more")
    assert log.count() > early
    expect(page.get_by_role("region", name="Metrics over the slots")).to_have_attribute("data-first-slot", "1")
    shot(page, "dashboard_replay")
    assert complaints(page) == []
    slider.press("End")
    expect(page.get_by_test_id("recorded-state")).to_have_text("recorded, done")
    page.get_by_role("button", name="Leave replay").click()
    expect(page.get_by_test_id("campaign-state")).to_have_text("done")


def test_its_speed_is_any_it_offers_no_orders_and_gives_way_to_a_flight(page: Page, desk: Desk):
    land(page, desk)
    assert desk.store.journal.flush(10.0)
    page.get_by_role("link", name="Replay demo").click()
    page.get_by_label("Speed of the replay").press("End")
    expect(page.get_by_test_id("replay-speed")).to_have_text("1000×")
    expect(page.get_by_role("button", name="Play", exact=True)).to_be_visible()  # at its end already
    page.get_by_label("Speed of the replay").press("Home")
    expect(page.get_by_test_id("replay-speed")).to_have_text("1×")
    page.get_by_test_id("drone-1").get_by_role("button", name=re.compile("UAV 1")).first.click()
    expect(page.get_by_role("group", name=re.compile("Orders to"))).to_have_count(0)
    expect(page.get_by_role("group", name=re.compile("Controls of"))).to_have_count(0)
    page.keyboard.press("Shift+Escape")
    expect(page.get_by_role("group", name="Emergency stop")).to_contain_text("STOPPED")
    assert desk.flight.requests[-1].kind is RequestKind.EMERGENCY_STOP
    expect(page.get_by_role("region", name="Alerts")).to_contain_text("UAV 2: no heartbeat")  # of the present
    desk.flight.fly_on()
    expect(page.get_by_test_id("replay")).to_have_count(0)
    expect(page.get_by_test_id("replay-notice")).to_contain_text("a campaign is in the air")
    expect(page.get_by_test_id("campaign-state")).to_have_text("flying")


def test_what_was_not_flown_says_so(page: Page, desk: Desk):
    page.goto(f"{desk.url}#replay=0123456789abcdef")
    expect(page.get_by_test_id("replay-notice")).to_contain_text("there is no campaign")
    page.get_by_role("button", name="Close").click()
    expect(page.get_by_test_id("replay-notice")).to_have_count(0)
