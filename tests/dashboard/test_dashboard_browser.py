"""What an operator does, in a real browser."""

import re
import time
from collections.abc import Callable

import pytest
from operator_desk import KEY, Desk
from playwright.sync_api import Locator, Page, expect

from gcs.ports import RequestKind

pytestmark = pytest.mark.browser
Shot = Callable[[Page, str], None]


def sign_in(page: Page) -> None:
    page.get_by_label("Key").fill(KEY)
    page.get_by_role("button", name="Sign in").click()
    expect(page.get_by_test_id("actor")).to_contain_text("operator")


def hold(page: Page, button: Locator) -> None:
    """Press and keep pressing until the page has taken it: taken when no button is being held."""
    button.scroll_into_view_if_needed()
    expect(button).to_be_enabled()
    button.hover()
    page.mouse.down()
    expect(page.locator("button.holding")).to_have_count(1)
    expect(page.locator("button.holding")).to_have_count(0)
    page.mouse.up()


def control(page: Page, name: str) -> Locator:
    return page.get_by_role("group", name=re.compile("Controls of")).get_by_role("button", name=re.compile(name))


def fly_demo(page: Page, policy: str = "random") -> None:
    sign_in(page)
    page.get_by_label("Mission").select_option("demo")
    page.get_by_label("Policy", exact=True).select_option(policy)
    page.get_by_role("button", name="Create").click()
    hold(page, control(page, "^Start demo"))
    expect(page.get_by_test_id("campaign-state")).to_have_text("flying")


def slot_of(page: Page) -> int:
    found = re.search(r"slot (\d+) of", page.get_by_test_id("slot-clock").inner_text())
    assert found is not None
    return int(found[1])


def kinds(desk: Desk) -> list[RequestKind]:
    return [request.kind for request in desk.flight.requests]


def test_a_visitor_sees_the_fleet_and_is_offered_nothing_that_flies(page: Page, shot: Shot):
    expect(page.get_by_test_id("link")).to_have_text("live")
    expect(page.get_by_test_id("drone-1")).to_contain_text("82%")
    expect(page.get_by_role("button", name=re.compile("EMERGENCY STOP"))).to_be_disabled()
    expect(page.get_by_role("button", name="Create")).to_have_count(0)
    shot(page, "dashboard_visitor")


def test_a_wrong_key_is_told_and_not_kept(page: Page):
    page.get_by_label("Key").fill("nonsense")
    page.get_by_role("button", name="Sign in").click()
    expect(page.get_by_role("alert").filter(has_text="not known")).to_be_visible()
    assert page.evaluate("sessionStorage.length") == 0


def test_a_campaign_is_created_started_paused_resumed_and_aborted(page: Page, desk: Desk, shot: Shot):
    fly_demo(page)
    expect(page.get_by_test_id("slot-clock")).to_contain_text(re.compile(r"slot [4-9] of 60"))
    expect(page.get_by_test_id("drone-2")).to_contain_text("OFFBOARD")
    control(page, "^Pause").click()
    expect(page.get_by_test_id("campaign-state")).to_have_text("paused")
    shot(page, "dashboard_paused")
    hold(page, control(page, "^Resume"))
    expect(page.get_by_test_id("campaign-state")).to_have_text("flying")
    hold(page, control(page, "^Abort"))
    expect(page.get_by_test_id("campaign-state")).to_have_text("recovering")
    assert kinds(desk) == [RequestKind.START, RequestKind.PAUSE, RequestKind.RESUME, RequestKind.ABORT]
    assert {request.actor for request in desk.flight.requests} == {"one-time-key"}


def test_the_map_shows_drones_that_move_and_users_by_age(page: Page, shot: Shot):
    fly_demo(page)
    expect(page.get_by_test_id("map")).to_have_attribute("data-users", "60")
    expect(page.get_by_test_id("map")).to_have_attribute("data-drones", "2")
    slot, before = slot_of(page), drawn_map(page)
    expect(page.get_by_test_id("slot-clock")).not_to_contain_text(f"slot {slot} of")
    until_drawn_anew(page, before)
    expect(page.get_by_text("Users' AoI, slots")).to_be_visible()
    shot(page, "dashboard_flying")


def drawn_map(page: Page) -> bytes:
    return page.get_by_test_id("map").screenshot()


def until_drawn_anew(page: Page, before: bytes) -> None:
    """The clock is told before the picture is drawn, and software WebGL on a busy machine takes its time."""
    deadline_s = time.monotonic() + 10.0
    while drawn_map(page) == before:
        assert time.monotonic() < deadline_s, "the map shows what it showed a slot ago"


def test_letting_go_early_does_nothing(page: Page, desk: Desk):
    fly_demo(page)
    button = control(page, "^Abort")
    button.hover()
    page.mouse.down()
    expect(button).to_have_class(re.compile("holding"))
    page.mouse.up()
    expect(button).not_to_have_class(re.compile("holding"))
    button.click()
    slot = slot_of(page)
    expect(page.get_by_test_id("slot-clock")).not_to_contain_text(f"slot {slot} of")
    assert RequestKind.ABORT not in kinds(desk)


def test_the_emergency_stop_latches_and_is_released_by_holding(page: Page, desk: Desk, shot: Shot):
    fly_demo(page)
    page.keyboard.press("Shift+Escape")
    stop = page.get_by_role("group", name="Emergency stop")
    expect(stop).to_contain_text("STOPPED")
    expect(stop).to_contain_text("latched")
    page.reload()
    expect(stop).to_contain_text("STOPPED")
    shot(page, "dashboard_stopped")
    hold(page, stop.get_by_role("button", name=re.compile("Release")))
    expect(stop).to_contain_text("EMERGENCY STOP")
    assert kinds(desk)[1:] == [RequestKind.EMERGENCY_STOP, RequestKind.RESET_STOP]


def test_the_emergency_stop_is_the_first_thing_that_tab_reaches(page: Page):
    sign_in(page)
    page.evaluate("document.activeElement.blur()")
    page.reload()
    expect(page.get_by_role("button", name=re.compile("EMERGENCY STOP"))).to_be_enabled()
    page.keyboard.press("Tab")
    expect(page.get_by_role("button", name=re.compile("EMERGENCY STOP"))).to_be_focused()


def test_an_order_is_held_by_key_and_answered_in_the_vehicles_words(page: Page, desk: Desk):
    fly_demo(page)
    card = page.get_by_test_id("drone-2")
    card.get_by_role("button", name=re.compile("UAV 2")).first.click()
    button = card.get_by_role("button", name=re.compile("^Return: UAV 2"))
    button.focus()
    page.keyboard.down("Enter")
    expect(card).to_contain_text("rtl: refused (Mode change denied: no GPS)")
    page.keyboard.up("Enter")
    command = desk.flight.requests[-1].command
    assert command is not None
    assert (command.kind, command.system_id) == ("rtl", 2)


def test_a_silent_drone_is_a_warning_and_its_values_are_not_shown_as_live(page: Page, desk: Desk, shot: Shot):
    fly_demo(page)
    desk.flight.battery[1] = 0.22
    desk.flight.lose(2)
    alerts = page.get_by_role("region", name="Alerts").get_by_role("listitem")
    expect(alerts.first).to_contain_text("UAV 2")
    expect(alerts.first).to_have_class("warning")
    expect(alerts.last).to_contain_text("UAV 1: battery at 22%")
    expect(page.get_by_test_id("drone-2").locator(".values .stale, .battery.stale")).to_have_count(6)
    shot(page, "dashboard_silent_drone")
    expect(page.get_by_test_id("mute")).to_have_attribute("data-sounded", "warning")
    page.get_by_role("button", name=re.compile("Acknowledge as one-time-key: UAV 2 is not heard")).click()
    expect(alerts.filter(has_text="is not heard any more")).to_have_count(0)
    expect(alerts.first).to_contain_text("no heartbeat")
    log = page.get_by_role("region", name="Events").get_by_role("listitem")
    expect(log.filter(has_text='"UAV 2 is not heard any more" acknowledged · one-time-key')).to_have_count(1)
    page.reload()
    expect(alerts.first).to_contain_text("no heartbeat")
    expect(alerts.filter(has_text="is not heard any more")).to_have_count(0)


def test_loss_of_the_server_is_shown_large_and_the_page_comes_back_by_itself(page: Page, desk: Desk, shot: Shot):
    fly_demo(page)
    page.keyboard.press("Shift+Escape")
    expect(page.get_by_role("group", name="Emergency stop")).to_contain_text("latched")
    desk.stop()
    expect(page.get_by_test_id("lost")).to_be_visible()
    expect(page.get_by_test_id("link")).to_have_text("connection lost")
    stop = page.get_by_role("group", name="Emergency stop")
    expect(stop).to_contain_text("unconfirmed")  # somebody else may have released it since
    expect(stop.get_by_role("button", name=re.compile("STOPPED"))).to_be_enabled()
    expect(stop.get_by_role("button", name=re.compile("Release"))).to_be_disabled()
    expect(page.locator(".page")).to_have_class(re.compile("old"))
    expect(control(page, "^Abort")).to_be_disabled()
    shot(page, "dashboard_lost")
    desk.start()
    expect(page.get_by_test_id("lost")).to_have_count(0)
    expect(page.get_by_test_id("link")).to_have_text("live")
    expect(control(page, "^Abort")).to_be_enabled()


def test_the_page_fits_from_a_phone_to_a_wall_in_light_and_dark(page: Page, shot: Shot):
    fly_demo(page)
    control(page, "^Pause").click()  # what moves costs seconds at this size without a graphics card
    page.emulate_media(color_scheme="dark")
    for width, height in ((360, 800), (768, 800), (2560, 1440), (3840, 2160)):
        page.set_viewport_size({"width": width, "height": height})
        expect(page.get_by_test_id("map")).to_be_visible()
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        assert cut_off(page) == []
        expect(page.get_by_role("button", name=re.compile("EMERGENCY STOP"))).to_be_in_viewport(ratio=1.0)
        shot(page, f"dashboard_{width}")


def cut_off(page: Page) -> list[str]:
    """Buttons, fields and figures that reach out of the page's width, or are too narrow for their own words."""
    found: list[str] = page.evaluate(
        """() => [...document.querySelectorAll("button, input, select, figure, dd, .panel, .map-panel")]
          .filter((one) => one.offsetParent !== null && !one.closest(".sr"))
          .filter((one) => {
            const { left, right } = one.getBoundingClientRect();
            const full = one.matches("button, dd") && one.scrollWidth > one.clientWidth + 2;
            return left < -1 || right > innerWidth + 1 || full;
          })
          .map((one) => `${one.tagName} ${one.className} ${one.textContent.slice(0, 40)}`)"""
    )
    return found


def test_curves_of_before_are_there_after_a_reload(page: Page):
    fly_demo(page)
    expect(page.get_by_test_id("slot-clock")).to_contain_text(re.compile(r"slot [5-9] of 60"))
    page.reload()
    expect(page.get_by_role("region", name="Metrics over the slots")).to_have_attribute("data-first-slot", "1")


def test_alerts_move_no_button_under_a_hand(page: Page, desk: Desk):
    fly_demo(page)
    places = {name: control(page, name).bounding_box() for name in ("^Pause", "^Abort")}
    desk.flight.lose(2)
    expect(page.get_by_role("region", name="Alerts").get_by_role("listitem").first).to_be_visible()
    assert {name: control(page, name).bounding_box() for name in places} == places


def test_one_drone_is_stopped_at_once_and_released_by_holding(page: Page, desk: Desk):
    fly_demo(page)
    card = page.get_by_test_id("drone-2")
    card.get_by_role("button", name=re.compile("UAV 2")).first.click()
    card.get_by_role("button", name="Stop UAV 2 now").click()
    expect(page.get_by_role("region", name="Alerts")).to_contain_text("UAV 2: emergency stop")
    hold(page, card.get_by_role("button", name=re.compile("^Release UAV 2")))
    expect(card.get_by_role("button", name="Stop UAV 2 now")).to_be_visible()
    asked = [(request.kind, request.system_id) for request in desk.flight.requests[1:]]
    assert asked == [(RequestKind.EMERGENCY_STOP, 2), (RequestKind.RESET_STOP, 2)]


def test_orders_to_several_name_whom_they_reach_while_they_are_held(page: Page, desk: Desk):
    fly_demo(page)
    page.get_by_label("Mark all").check()
    button = page.get_by_role("button", name=re.compile("^Hold: UAVs 1 and 2 "))
    button.hover()
    page.mouse.down()
    expect(page.get_by_text("Keep holding. Hold: UAVs 1 and 2")).to_be_visible()
    expect(page.get_by_text("Keep holding.")).to_have_count(0)
    page.mouse.up()
    for system_id in (1, 2):
        expect(page.get_by_test_id(f"drone-{system_id}")).to_contain_text("hold: refused")
    commands = [request.command for request in desk.flight.requests[1:]]
    assert {command.system_id for command in commands if command is not None} == {1, 2}
