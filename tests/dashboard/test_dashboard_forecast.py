"""Before and while flying: the dry run's forecast, and why a drone flies as it does."""

import re
from collections.abc import Callable

import pytest
from operator_desk import Desk
from playwright.sync_api import Page, expect
from test_dashboard_browser import control, fly_demo, hold, sign_in

pytestmark = pytest.mark.browser
Shot = Callable[[Page, str], None]


def test_a_dry_run_foretells_the_four_metrics_and_stands_beside_the_curves(page: Page, desk: Desk, shot: Shot):
    sign_in(page)
    page.get_by_label("Mission").select_option("demo")
    page.get_by_label("Policy", exact=True).select_option("random")
    page.get_by_role("button", name="Dry run", exact=True).click()
    table = page.get_by_role("table", name=re.compile("Forecast for demo"))
    expect(table.get_by_role("row")).to_have_count(5)
    expect(table.get_by_role("row", name=re.compile("age of information"))).to_contain_text(re.compile(r"\d+\.\d\d"))
    assert desk.flight.requests == []
    page.get_by_role("button", name="Create").click()
    curves = page.get_by_role("region", name="Metrics over the slots")
    expect(curves).to_have_attribute("data-foretold", "60")
    hold(page, control(page, "^Start demo"))
    expect(page.get_by_test_id("slot-clock")).to_contain_text(re.compile(r"slot [3-9] of 60"))
    expect(curves.get_by_text("forecast").first).to_be_visible()
    expect(page.get_by_test_id("histogram")).to_have_attribute("data-users", "60")
    curves.scroll_into_view_if_needed()
    shot(page, "dashboard_forecast")


def test_a_chosen_drone_says_why(page: Page, shot: Shot):
    fly_demo(page)
    card = page.get_by_test_id("drone-1")
    card.get_by_role("button", name=re.compile("UAV 1")).first.click()
    why = page.get_by_role("region", name="Why UAV 1 flies so")
    expect(why).to_contain_text("looks 8 slots ahead")
    expect(why.get_by_role("row")).to_have_count(4)
    expect(why.get_by_role("row").first).to_contain_text("+0.30")
    expect(why).to_contain_text("Attends to")
    expect(page.get_by_test_id("map")).to_have_attribute("data-why-lines", "5")
    shot(page, "dashboard_why")
