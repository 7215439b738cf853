"""A recording with telemetry: the page says of every moment what it said in flight, and no more than was known then."""

import re
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from operator_desk import Desk
from playwright.sync_api import Browser, Locator, Page, expect
from recorded_flight import (
    CLIMB_S,
    FAILED_WORDS,
    HEARD_AT_S,
    LAUNCH_S,
    LENGTH_S,
    LOST_AT_S,
    LOST_WORDS,
    PAUSE_S,
    PAUSED_AT_S,
    SLOT_S,
    record_campaign,
    record_failed_launch,
)
from test_dashboard_access import complaints
from test_dashboard_browser import cut_off, sign_in

from gcs.store.store import open_store

pytestmark = pytest.mark.browser
Shot = Callable[[Page, str], None]


@pytest.fixture(scope="module")
def opened(built_page: Path, browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    """One server, one recording and one page for all that only look."""
    store = open_store(f"sqlite:///{tmp_path_factory.mktemp('recorded') / 'page.sqlite3'}")
    desk = Desk(store)
    record_failed_launch(store)
    campaign_id = record_campaign(store)
    desk.start()
    context = browser.new_context(viewport={"width": 1280, "height": 800}, reduced_motion="reduce")
    page = context.new_page()
    page.goto(desk.url)
    sign_in(page)
    page.goto(f"{desk.url}#replay={campaign_id}")
    expect(page.get_by_test_id("replay")).to_have_attribute("data-samples", str(int(LENGTH_S) + 1))
    yield page
    context.close()
    desk.stop()
    store.close()


@pytest.fixture
def recorded(opened: Page) -> Page:
    """The replay of a campaign that is over, standing still."""
    opened.set_viewport_size({"width": 1280, "height": 800})
    seek(opened, 0)
    pause = opened.get_by_role("button", name="Pause the replay")
    if pause.count():
        pause.click()
    return opened


def seek(page: Page, at_s: float) -> None:
    page.get_by_label("Time of the replay, seconds").fill(str(round(at_s)))


def card(page: Page, system_id: int) -> Locator:
    return page.get_by_test_id(f"drone-{system_id}")


def says(page: Page, system_id: int, name: str, words: str | re.Pattern[str]) -> None:
    pair = card(page, system_id).locator(".values div").filter(has=page.get_by_text(name, exact=True))
    expect(pair.locator("dd")).to_have_text(words)


def test_every_view_shows_each_moment_from_the_pads_to_the_pads(recorded: Page, shot: Shot):
    page, state = recorded, recorded.get_by_test_id("recorded-state")
    seek(page, 0)
    expect(state).to_have_text("recorded, launching")
    expect(card(page, 1)).to_contain_text("AUTO.LOITER")
    expect(card(page, 1)).to_contain_text("disarmed · on ground")
    seek(page, 10)
    expect(card(page, 1)).to_contain_text("AUTO.TAKEOFF")
    says(page, 1, "height", "60 m")
    seek(page, PAUSED_AT_S - 2)
    expect(state).to_have_text("recorded")
    expect(card(page, 1)).to_contain_text("OFFBOARD")
    expect(card(page, 1)).to_contain_text("armed · in air")
    expect(card(page, 1)).to_contain_text(re.compile("82%, [1-9]% to return"))
    expect(card(page, 1)).to_contain_text("hold: refused (no GPS)")
    says(page, 1, "height", "120 m")
    says(page, 2, "height", "115 m")
    says(page, 1, "link", "98%")
    says(page, 1, "heading", re.compile(r"^\d+°$"))
    says(page, 1, "speed", re.compile(r"^[1-9][\d.]+ m/s$"))
    seek(page, PAUSED_AT_S + 20)
    expect(state).to_have_text("recorded, paused")
    expect(page.get_by_test_id("slot-clock")).to_contain_text("8 of 15 s")
    says(page, 1, "speed", "0.0 m/s")
    shot(page, "dashboard_replay_paused")
    seek(page, LENGTH_S)
    expect(state).to_have_text("recorded, done")
    expect(card(page, 2)).to_contain_text("disarmed · on ground")


def test_alerts_come_and_go_at_their_time_and_what_was_stale_is_stale(recorded: Page):
    page, then = recorded, recorded.get_by_test_id("recorded-alerts")
    seek(page, LOST_AT_S - 1)
    expect(then).to_have_count(0)
    page.get_by_role("button", name="Next alert").click()
    expect(then).to_contain_text(LOST_WORDS)
    expect(card(page, 2).locator(".stale")).to_have_count(0)
    seek(page, LOST_AT_S + 8)
    expect(then).to_contain_text("UAV 2: no heartbeat for 8 s")
    expect(then).to_contain_text("2 warnings, 0 cautions")
    expect(card(page, 2).locator(".stale")).not_to_have_count(0)
    expect(then.get_by_role("button")).to_have_count(0)  # nothing to acknowledge in what is over
    now = page.get_by_role("region", name="Alerts")  # of the present, where everybody is heard
    expect(now).to_contain_text("Now: 1 warning, 0 cautions")
    expect(now).not_to_contain_text("no heartbeat")
    seek(page, HEARD_AT_S)
    expect(then).to_contain_text("1 warning, 0 cautions")
    seek(page, HEARD_AT_S + 2)
    expect(then).to_have_count(0)  # acknowledged


def why(page: Page, system_id: int) -> Locator:
    return page.get_by_test_id(f"why-{system_id}")


def test_why_it_flew_so_is_what_was_told_then_and_its_lack_is_said(recorded: Page, shot: Shot):
    page, drawn = recorded, recorded.get_by_test_id("map")
    choose = card(page, 1).get_by_role("button", name=re.compile("UAV 1")).first
    seek(page, 5)
    choose.click()
    expect(why(page, 1)).to_have_count(0)  # on its way up
    expect(drawn).to_have_attribute("data-why-lines", "0")
    seek(page, LAUNCH_S + 5)
    told = [in_slot(page, LAUNCH_S + 5, "slot 0")]
    expect(drawn).to_have_attribute("data-why-lines", "5")
    expect(why(page, 1).get_by_role("row")).to_have_count(4)
    shot(page, "dashboard_replay_why")
    told.append(in_slot(page, LAUNCH_S + SLOT_S + 5, "slot 1"))
    assert told[0] != told[1]
    assert in_slot(page, LAUNCH_S + 5, "slot 0") == told[0]
    seek(page, LAUNCH_S + 3 * SLOT_S + PAUSE_S + 5)
    expect(why(page, 1)).to_contain_text("the version that flew kept no reasons")
    expect(drawn).to_have_attribute("data-why-lines", "0")
    seek(page, LAUNCH_S + 4 * SLOT_S + PAUSE_S + 5)
    expect(why(page, 1)).to_contain_text("The policy could not say why (RuntimeError: the network is gone).")
    shot(page, "dashboard_replay_no_reasons")
    choose.click()


def in_slot(page: Page, at_s: float, words: str) -> str:
    """Everything that is told of UAV 1, once it is told of this slot."""
    seek(page, at_s)
    expect(why(page, 1)).to_contain_text(re.compile(rf"flies \d+° at [\d.]+ m/s in {words}"))
    return why(page, 1).inner_text()


def test_a_launch_that_failed_shows_what_there_is_and_why(recorded: Page, shot: Shot):
    page, replay = recorded, recorded.get_by_test_id("replay")
    page.locator("#campaign-choice").select_option(label="demo · gcrl · failed")
    expect(replay).to_have_attribute("data-samples", str(int(CLIMB_S) + 1))
    page.get_by_label("Time of the replay, seconds").press("End")
    expect(page.get_by_test_id("recorded-state")).to_have_text("recorded, failed")
    expect(page.get_by_role("region", name="Campaign")).to_contain_text(f"failed: {FAILED_WORDS}")
    expect(card(page, 1)).to_contain_text("AUTO.TAKEOFF")
    says(page, 1, "height", "60 m")
    expect(page.get_by_test_id("map")).to_have_attribute("data-drones", "2")
    expect(page.get_by_role("region", name="Events").get_by_role("listitem").first).to_contain_text("failed")
    shot(page, "dashboard_replay_failed_launch")
    page.locator("#campaign-choice").select_option(label="demo · gcrl · done")
    expect(replay).to_have_attribute("data-samples", str(int(LENGTH_S) + 1))


def test_a_second_is_a_step_and_it_plays_in_real_seconds(recorded: Page):
    page, slider = recorded, recorded.get_by_label("Time of the replay, seconds")
    seek(page, 30)
    slider.press("ArrowRight")
    expect(page.get_by_test_id("replay")).to_have_attribute("data-at-s", "31.0")
    page.get_by_label("Speed of the replay").press("End")
    page.get_by_role("button", name="Play", exact=True).click()
    expect(page.get_by_test_id("replay")).to_have_attribute("data-at-s", f"{LENGTH_S:.1f}")
    expect(page.get_by_role("button", name="Play", exact=True)).to_be_visible()


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_nothing_to_mend_in_a_replay(recorded: Page, shot: Shot, scheme: str):
    recorded.emulate_media(color_scheme="dark" if scheme == "dark" else "light")
    seek(recorded, LOST_AT_S + 8)
    card(recorded, 1).get_by_role("button", name=re.compile("UAV 1")).first.click()
    expect(recorded.get_by_test_id("recorded-alerts")).to_be_visible()
    assert complaints(recorded) == []
    shot(recorded, f"dashboard_replay_{scheme}")


def test_a_replay_fits_a_phone(recorded: Page, shot: Shot):
    recorded.set_viewport_size({"width": 360, "height": 800})
    seek(recorded, LOST_AT_S + 8)
    assert recorded.evaluate("document.documentElement.scrollWidth") <= 360
    assert cut_off(recorded) == []
    shot(recorded, "dashboard_replay_360")
