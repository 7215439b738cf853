"""A red pre-flight line keeps everybody from starting but an admin, who holds another button and stands in the log.

The loop, its checklist and its log are the real ones; only the vehicles are small.
"""

import re
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from fake_fleet import FakeFleet, FakeVehicle
from operator_desk import Desk
from playwright.sync_api import BrowserContext, Page, expect
from test_dashboard_browser import control, hold, sign_in

from gcs.bootstrap import make_loop, make_preparer
from gcs.flight_loop import TICK_S
from gcs.store.keys import Role
from gcs.store.reading import EventFilter
from gcs.store.store import open_store
from policy.mission_file import load_mission

pytestmark = pytest.mark.browser


@pytest.fixture
def unready(built_page: Path, tmp_path: Path) -> Iterator[Desk]:
    """Two drones that never say that they can fly by position."""
    store = open_store(f"sqlite:///{tmp_path / 'override.sqlite3'}")
    vehicles = [FakeVehicle(i, 800.0 + 4.0 * i, 600.0, ready_at_s=1e9, home=(800.0, 600.0)) for i in (1, 2)]
    fleet = FakeFleet(load_mission("demo").scenario.area.frame, vehicles)
    loop = make_loop(fleet, fleet, store.journal, make_preparer((1, 2)))
    over = threading.Event()

    def fly() -> None:
        while not over.wait(TICK_S):
            loop.tick()

    thread = threading.Thread(target=fly)
    thread.start()
    running = Desk(store, loop)
    running.start()
    yield running
    over.set()
    thread.join(10.0)
    running.stop()
    store.close()


def wait_in_the_checklist(page: Page) -> None:
    page.get_by_label("Mission").select_option("demo")
    page.get_by_label("Policy", exact=True).select_option("random")
    page.get_by_role("button", name="Create").click()
    expect(page.get_by_test_id("preflight")).to_have_attribute("data-red", "2")
    expect(page.get_by_test_id("preflight")).to_contain_text("not ready by the vehicle's own flags")
    expect(control(page, "^Start demo")).to_be_disabled()


def test_only_an_admin_starts_in_spite_of_red_lines_and_the_log_names_who(unready: Desk, context: BrowserContext):
    secret = unready.store.keys.add("chief", Role.ADMIN)[1]
    page = context.new_page()
    page.goto(unready.url)
    sign_in(page)
    wait_in_the_checklist(page)
    anyway = page.get_by_role("button", name=re.compile("^Start in spite of 2 red lines"))
    expect(anyway).to_have_count(0)  # an operator is not offered it
    page.get_by_role("button", name="Sign out").click()
    page.get_by_label("Key").fill(secret)
    page.get_by_role("button", name="Sign in").click()
    expect(page.get_by_test_id("actor")).to_contain_text("chief (admin)")
    anyway.click()  # a click is not enough
    expect(page.get_by_test_id("preflight")).to_be_visible()
    hold(page, anyway)
    expect(page.get_by_test_id("campaign-state")).to_have_text("launching")
    words = re.compile("pre-flight overridden by chief: drone 1 position: not ready")
    expect(page.get_by_role("region", name="Alerts")).to_contain_text(words)
    expect(page.get_by_role("region", name="Events")).to_contain_text(words)
    deadline_s = time.monotonic() + 10.0
    while not (told := unready.store.events.find(EventFilter(kind="preflight.overridden"))):
        assert time.monotonic() < deadline_s
    assert [(one.actor, one.severity) for one in told] == [("chief", "warning")]
    (asked,) = unready.store.events.find(EventFilter(kind="api.start"))
    assert (asked.actor, "in spite of red" in asked.message) == ("chief", True)
