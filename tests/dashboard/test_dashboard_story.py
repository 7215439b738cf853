"""An operator's whole shift in the browser: a real server, real sockets, mock drones. `kill -9` included."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from playwright.sync_api import BrowserContext, Page, expect
from real_flight import RealServer, real_server
from test_dashboard_browser import control, hold

from gcs.store.reading import EventFilter
from gcs.store.store import using_store

pytestmark = [pytest.mark.browser, pytest.mark.flight, pytest.mark.timeout(420)]
PATIENCE_MS = 90_000
Shot = Callable[[Page, str], None]


def state_is(page: Page, name: str) -> None:
    expect(page.get_by_test_id("campaign-state")).to_have_text(name, timeout=PATIENCE_MS)


def test_a_shift_from_signing_in_to_looking_back(built_page: Path, context: BrowserContext, tmp_path: Path, shot: Shot):
    with real_server(tmp_path) as server:
        page = context.new_page()
        page.goto(server.url)
        prepare(page, server, shot)
        fly(page, shot)
        stop_and_release(page)
        lose_and_regain(page, server, shot)
        come_home(page)
        look_back(page, shot)
    with using_store(server.store_url) as store:
        kinds = {event.kind for event in store.events.find(EventFilter())}
        verdicts = store.orders.newest()
    assert {"api.start", "api.pause", "api.resume", "safety.stop", "campaign.resumed", "api.abort"} <= kinds
    assert [(order.actor, order.system_id, order.command, order.result) for order in verdicts] == [
        ("ann", 2, "rtl", "accepted")
    ] * 2


def prepare(page: Page, server: RealServer, shot: Shot) -> None:
    """Nothing is shown without a key; red lines keep the start back until the drones are ready by their own flags."""
    expect(page.get_by_text("shows nothing without a key")).to_be_visible(timeout=PATIENCE_MS)
    page.get_by_label("Key").fill(server.key)
    page.get_by_role("button", name="Sign in").click()
    expect(page.get_by_test_id("actor")).to_contain_text("ann (operator)")
    page.get_by_label("Mission", exact=True).select_option("field")
    page.get_by_role("button", name="Create").click()
    checklist = page.get_by_test_id("preflight")
    expect(checklist).to_contain_text(re.compile("Not ready|Ready"))
    expect(checklist).to_have_attribute("data-red", "0", timeout=PATIENCE_MS)
    expect(checklist).to_contain_text(re.compile(r"Ready: \d+ checks of 2 UAVs, none red"))
    shot(page, "story_1_preflight")


def fly(page: Page, shot: Shot) -> None:
    hold(page, control(page, "^Start field"))
    state_is(page, "flying")
    expect(page.get_by_test_id("slot-clock")).to_contain_text(
        re.compile(r"slot ([2-9]|\d\d) of 60"), timeout=PATIENCE_MS
    )
    expect(page.get_by_test_id("drone-1")).to_contain_text("to return")
    shot(page, "story_2_flying")
    control(page, "^Pause").click()
    state_is(page, "paused")
    hold(page, control(page, "^Resume"))
    state_is(page, "flying")
    page.get_by_label("Mark UAV 2").check()
    hold(page, page.get_by_role("button", name=re.compile("^Return: UAV 2 ")))
    expect(page.get_by_test_id("drone-2")).to_contain_text("rtl: accepted", timeout=PATIENCE_MS)
    expect(page.get_by_test_id("drone-2")).to_contain_text(re.compile("RTL"), timeout=PATIENCE_MS)


def stop_and_release(page: Page) -> None:
    page.keyboard.press("Shift+Escape")
    stop = page.get_by_role("group", name="Emergency stop")
    expect(stop).to_contain_text("STOPPED")
    hold(page, stop.get_by_role("button", name=re.compile("Release")))
    expect(stop).to_contain_text("EMERGENCY STOP")
    state_is(page, "paused")


def lose_and_regain(page: Page, server: RealServer, shot: Shot) -> None:
    server.kill()
    expect(page.get_by_test_id("lost")).to_be_visible()
    expect(control(page, "^Abort")).to_be_disabled()
    shot(page, "story_3_lost")
    server.start()
    expect(page.get_by_test_id("lost")).to_have_count(0, timeout=PATIENCE_MS)
    expect(page.get_by_test_id("link")).to_have_text("live")
    state_is(page, "paused")  # as it was left
    hold(page, control(page, "^Resume"))
    state_is(page, "flying")


def come_home(page: Page) -> None:
    """The stop halted UAV 2 on its way home, and it was not the campaign's any more: it needs its order again."""
    hold(page, page.get_by_role("button", name=re.compile("^Return: UAV 2 ")))
    expect(page.get_by_test_id("drone-2")).to_contain_text(re.compile("RTL"), timeout=PATIENCE_MS)
    hold(page, control(page, "^Abort: return all"))
    state_is(page, "recovering")
    state_is(page, "aborted")


def look_back(page: Page, shot: Shot) -> None:
    page.get_by_role("link", name="Replay field").click()
    replay = page.get_by_test_id("replay")
    expect(replay).to_have_attribute("data-position", re.compile(r"^[1-9]"))
    expect(page.get_by_test_id("map")).to_have_attribute("data-users", "30")
    expect(replay).to_have_attribute("data-samples", re.compile(r"^[1-9]\d+$"))
    expect(page.get_by_test_id("drone-1")).to_contain_text("armed · in air")
    page.get_by_label("Time of the replay, seconds").press("Home")
    expect(page.get_by_test_id("recorded-state")).to_have_text("recorded, launching")
    expect(page.get_by_test_id("drone-1")).to_contain_text("on ground")
    page.get_by_label("Time of the replay, seconds").press("End")
    expect(page.get_by_test_id("recorded-state")).to_have_text("recorded, aborted")
    log = page.get_by_role("region", name="Events")
    expect(log).to_contain_text(re.compile("stop", re.IGNORECASE))
    shot(page, "story_4_replay")
