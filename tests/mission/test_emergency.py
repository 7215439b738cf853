"""The latched stop: pressed until obeyed, and never against what a person orders that vehicle meanwhile."""

from dataclasses import dataclass, field, replace

import pytest

from gcs.mission.emergency import DISOBEYED_S, REPEAT_S, EmergencyStop
from gcs.ports import CommandKind, FlightMode, VehicleCommand, VehicleStatus, Verdict, VerdictResult

FLYING = VehicleStatus(1, "px4", FlightMode.GUIDED, armed=True)


@dataclass
class Ticket:
    verdict: Verdict | None = None


@dataclass
class DeadLink:
    """Takes orders and hears no answer."""

    orders: list[VehicleCommand] = field(default_factory=list)
    tickets: list[Ticket] = field(default_factory=list)

    def submit(self, command: VehicleCommand, now_s: float) -> Ticket:
        self.orders.append(command)
        self.tickets.append(Ticket())
        return self.tickets[-1]

    def give_up(self) -> None:
        self.tickets[-1].verdict = Verdict(self.orders[-1], VerdictResult.TIMEOUT)


def step(stop: EmergencyStop, link: DeadLink, now_s: float, status: VehicleStatus = FLYING) -> None:
    stop.step({1: status}, link, now_s)  # type: ignore[arg-type]


def test_without_an_answer_it_is_told_again_each_second() -> None:
    stop, link = EmergencyStop(), DeadLink()
    stop.press()
    step(stop, link, 0.0)
    link.give_up()
    step(stop, link, 1.5)
    step(stop, link, 1.5 + 0.9 * REPEAT_S)
    assert len(link.orders) == 1
    step(stop, link, 1.5 + REPEAT_S)
    assert [(order.kind, order.urgent) for order in link.orders] == [(CommandKind.HOLD, True)] * 2


@pytest.mark.parametrize("told", ["under way", "given up"])
def test_a_landing_that_a_person_orders_meanwhile_is_not_stopped_again(told: str) -> None:
    """The stop's own order was not answered yet: pressing on would take the vehicle out of its landing."""
    stop, link = EmergencyStop(), DeadLink()
    stop.press()
    step(stop, link, 0.0)
    if told == "given up":
        link.give_up()
        step(stop, link, 1.5)
    stop.leave(1, 2.0)
    for tick in range(100):
        step(stop, link, 2.0 + 0.1 * tick, replace(FLYING, mode=FlightMode.LAND))
    assert len(link.orders) == 1
    assert stop.stops(1), "the latch stays"
    step(stop, link, 2.0 + DISOBEYED_S + 10.0)
    assert len(link.orders) == 2, "it flies by our velocities still: it is told to hold again"
