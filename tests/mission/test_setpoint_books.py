"""What each UAV was told, in numbers: counted by hand against the books, which a crash must not have to guess."""

from dataclasses import dataclass
from typing import cast

import pytest

from gcs.mission.setpoint_books import SetpointBooks
from gcs.ports import SetpointSummary, VelocitySetpoint
from gcs.safety.gate import GateAction, SealedSetpoint


@dataclass(frozen=True)
class Told:
    """A setpoint after the gate, without the gate."""

    setpoint: VelocitySetpoint
    action: GateAction


def told(system_id: int, north_mps: float, east_mps: float, action: GateAction = GateAction.PASSED) -> SealedSetpoint:
    return cast("SealedSetpoint", Told(VelocitySetpoint(system_id, (north_mps, east_mps, -9.0), 0.0), action))


def test_counts_gaps_top_speed_and_acts_of_the_gate() -> None:
    books = SetpointBooks()
    books.add([told(2, 3.0, 4.0), told(1, 0.0, 0.0, GateAction.HELD)], 10.0)
    books.add([told(2, 6.0, 8.0, GateAction.SLOWED)], 10.1)
    books.add([told(2, 0.0, 1.0, GateAction.BENT), told(1, 1.0, 0.0)], 10.4)
    first, second = books.close()
    assert first == SetpointSummary(1, 2, pytest.approx(0.4), 1.0, 0, 0, 1)
    assert second == SetpointSummary(2, 3, pytest.approx(0.3), 10.0, 1, 1, 0), "climbing is no horizontal speed"


def test_a_gap_over_the_end_of_a_slot_counts_in_the_next_one() -> None:
    books = SetpointBooks()
    books.add([told(1, 1.0, 0.0)], 0.0)
    assert [line.sent for line in books.close()] == [1]
    books.add([told(1, 1.0, 0.0)], 2.5)
    (line,) = books.close()
    assert (line.sent, line.longest_gap_s, line.top_speed_mps) == (1, 2.5, 1.0)


def test_a_drone_that_was_told_nothing_has_no_line() -> None:
    books = SetpointBooks()
    assert books.close() == ()
    books.add([told(1, 1.0, 0.0)], 0.0)
    books.close()
    books.add([told(2, 1.0, 0.0)], 1.0)
    assert [line.system_id for line in books.close()] == [2]
