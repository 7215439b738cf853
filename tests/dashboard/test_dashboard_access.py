"""For everybody: axe finds nothing to mend, in light and dark, and everything can be done by keyboard."""

import re
from typing import Any

import pytest
from operator_desk import KEY, PAGE, Desk
from playwright.sync_api import Page, expect
from test_dashboard_browser import fly_demo, kinds, sign_in

from gcs.ports import RequestKind

pytestmark = pytest.mark.browser
AXE = PAGE / "node_modules" / "axe-core" / "axe.min.js"
RULES = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa", "best-practice"]


def complaints(page: Page) -> list[str]:
    """What axe would have mended, a line each."""
    if not page.evaluate("'axe' in window"):
        page.evaluate(AXE.read_text("utf-8"))
    found: list[dict[str, Any]] = page.evaluate(
        "rules => axe.run({ runOnly: rules }).then(result => result.violations)", RULES
    )
    return [f"{one['id']}: {node['html'][:160]}" for one in found for node in one["nodes"]]


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_nothing_to_mend(page: Page, desk: Desk, scheme: str):
    page.emulate_media(color_scheme="dark" if scheme == "dark" else "light")
    assert complaints(page) == []
    sign_in(page)
    page.get_by_role("button", name="Change the area").click()
    expect(page.get_by_test_id("draft")).to_be_visible()
    assert complaints(page) == []
    page.get_by_role("button", name="Keep the mission's own area").click()
    fly_demo_signed_in(page)
    page.get_by_test_id("drone-1").get_by_role("button", name=re.compile("UAV 1")).first.click()
    expect(page.get_by_test_id("why-1")).to_be_visible()
    desk.flight.battery[1] = 0.22
    desk.flight.lose(2)
    expect(page.get_by_role("region", name="Alerts").get_by_role("listitem").first).to_have_class("warning")
    assert complaints(page) == []


def fly_demo_signed_in(page: Page) -> None:
    page.get_by_role("button", name="Sign out").click()
    fly_demo(page)


def test_a_campaign_is_flown_without_a_mouse(page: Page, desk: Desk):
    page.get_by_label("Key").focus()
    page.keyboard.type(KEY)
    page.keyboard.press("Enter")
    expect(page.get_by_test_id("actor")).to_contain_text("operator")
    page.get_by_label("Policy").focus()
    page.keyboard.type("random")
    reach(page, "Create")
    page.keyboard.press("Enter")
    reach(page, "Start demo", back=True)
    page.keyboard.down("Enter")
    expect(page.get_by_test_id("campaign-state")).to_have_text("flying")
    page.keyboard.up("Enter")
    page.keyboard.press("Shift+Escape")
    expect(page.get_by_role("group", name="Emergency stop")).to_contain_text("STOPPED")
    assert kinds(desk) == [RequestKind.START, RequestKind.EMERGENCY_STOP]


def reach(page: Page, name: str, *, back: bool = False) -> None:
    """Tab until the button of this name has the focus; every step must be visible."""
    wanted = page.get_by_role("button", name=re.compile(f"^{name}"))
    expect(wanted).to_be_enabled()
    for _ in range(60):
        if wanted.evaluate("button => button === document.activeElement"):
            return
        page.keyboard.press("Shift+Tab" if back else "Tab")
    pytest.fail(f"no number of Tabs reaches {name!r}")
