"""Verdicts in virtual time: repeats, refusals with the vehicle's words, superseded orders."""

import math
from dataclasses import replace
from types import SimpleNamespace

import pytest

from gcs.links.commands import (
    ACK_TIMEOUT_S,
    MAX_ATTEMPTS,
    CommandTransaction,
    LongCommand,
    NotSendableError,
    encode_command,
)
from gcs.links.session import VehicleSession
from gcs.links.wire import Fields
from gcs.ports import CommandKind, Landed, VehicleCommand, VehicleStatus, VerdictResult

PX4 = VehicleStatus(system_id=3, autopilot="px4", alt_amsl_m=212.0, alt_home_m=2.0)
ARDUPILOT = replace(PX4, autopilot="ardupilot")


def order(kind: CommandKind, **values: object) -> VehicleCommand:
    return VehicleCommand(kind, 3, **values)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("kind", "status", "number", "first", "second"),
    [
        (CommandKind.ARM, PX4, 400, 1.0, 0.0),
        (CommandKind.DISARM, PX4, 400, 0.0, 0.0),
        (CommandKind.GUIDED, PX4, 176, 1.0, 6.0),
        (CommandKind.GUIDED, ARDUPILOT, 176, 1.0, 4.0),
        (CommandKind.HOLD, PX4, 176, 1.0, 4.0),
        (CommandKind.HOLD, ARDUPILOT, 176, 1.0, 17.0),
        (CommandKind.RETURN, PX4, 20, 0.0, 0.0),
        (CommandKind.LAND, ARDUPILOT, 21, 0.0, 0.0),
        (CommandKind.TERMINATE, ARDUPILOT, 185, 1.0, 0.0),
    ],
)
def test_orders_in_the_vehicles_dialect(
    kind: CommandKind, status: VehicleStatus, number: int, first: float, second: float
) -> None:
    wire = encode_command(order(kind), status)
    assert (wire.number, wire.params[0], wire.params[1]) == (number, first, second)


def test_takeoff_altitude_is_amsl_for_px4_and_above_home_for_ardupilot() -> None:
    takeoff = order(CommandKind.TAKEOFF, altitude_m=120.0)
    assert encode_command(takeoff, PX4).params[6] == pytest.approx(330.0)
    assert encode_command(takeoff, ARDUPILOT).params[6] == 120.0


@pytest.mark.parametrize("altitude_m", [None, 0.0, -5.0, math.nan, math.inf])
def test_takeoff_without_a_sound_altitude_is_never_sent(altitude_m: float | None) -> None:
    with pytest.raises(NotSendableError, match="altitude"):
        encode_command(order(CommandKind.TAKEOFF, altitude_m=altitude_m), PX4)


def test_px4_takeoff_needs_a_known_altitude() -> None:
    with pytest.raises(NotSendableError, match="altitude"):
        encode_command(order(CommandKind.TAKEOFF, altitude_m=10.0), VehicleStatus(3, autopilot="px4"))


class Wire:
    def __init__(self) -> None:
        self.sent: list[tuple[LongCommand, int]] = []
        self.everywhere: list[bool] = []

    def __call__(self, wire: LongCommand, confirmation: int, *, everywhere: bool = False) -> None:
        self.sent.append((wire, confirmation))
        self.everywhere.append(everywhere)


def run(kind: CommandKind = CommandKind.ARM) -> tuple[CommandTransaction, Wire]:
    command = order(kind, altitude_m=10.0)
    return CommandTransaction(command, encode_command(command, ARDUPILOT), 0.0), Wire()


def test_repeats_count_up_and_end_in_a_timeout() -> None:
    transaction, wire = run()
    for tick in range(100):
        transaction.step(tick * 0.1, ARDUPILOT, wire)
    assert [confirmation for _, confirmation in wire.sent] == list(range(MAX_ATTEMPTS))
    assert transaction.verdict is not None
    assert transaction.verdict.result is VerdictResult.TIMEOUT
    assert transaction.verdict.duration_s == pytest.approx(MAX_ATTEMPTS * ACK_TIMEOUT_S, abs=0.2)


def test_acceptance_ends_the_repeats() -> None:
    transaction, wire = run()
    transaction.step(0.0, ARDUPILOT, wire)
    transaction.on_ack(0, 0.2)
    transaction.step(5.0, ARDUPILOT, wire)
    assert len(wire.sent) == 1
    assert transaction.verdict is not None
    assert transaction.verdict.accepted


def test_refusal_carries_the_vehicles_words() -> None:
    transaction, wire = run()
    transaction.step(0.0, ARDUPILOT, wire)
    transaction.on_text("PreArm: Need Position Estimate")
    transaction.on_ack(4, 0.1)
    transaction.on_text("Arm: Compass not healthy")
    assert transaction.verdict is None
    transaction.step(0.7, ARDUPILOT, wire)
    assert transaction.verdict is not None
    assert transaction.verdict.result is VerdictResult.REFUSED
    assert "Need Position Estimate" in transaction.verdict.reason
    assert "Compass not healthy" in transaction.verdict.reason


def test_in_progress_extends_the_wait() -> None:
    transaction, wire = run()
    transaction.step(0.0, ARDUPILOT, wire)
    transaction.on_ack(5, 0.1)
    for tick in range(80):
        transaction.step(0.1 + tick * 0.1, ARDUPILOT, wire)
    assert len(wire.sent) == 1
    assert transaction.verdict is None


def test_unsupported_is_told_apart_from_refused() -> None:
    transaction, wire = run()
    transaction.step(0.0, ARDUPILOT, wire)
    transaction.on_ack(3, 0.1)
    transaction.step(1.0, ARDUPILOT, wire)
    assert transaction.verdict is not None
    assert transaction.verdict.result is VerdictResult.UNSUPPORTED


def test_takeoff_is_not_repeated_to_a_vehicle_that_climbs() -> None:
    transaction, wire = run(CommandKind.TAKEOFF)
    transaction.step(0.0, ARDUPILOT, wire)
    transaction.step(1.1, replace(ARDUPILOT, landed=Landed.TAKING_OFF), wire)
    assert len(wire.sent) == 1
    assert transaction.verdict is not None
    assert transaction.verdict.accepted


def test_an_answer_before_the_question_is_no_verdict() -> None:
    transaction, _ = run()
    transaction.on_ack(0, 0.0)
    assert transaction.verdict is None


def test_an_urgent_order_goes_everywhere_and_does_not_wait_long() -> None:
    command = order(CommandKind.HOLD, urgent=True)
    transaction, wire = CommandTransaction(command, encode_command(command, ARDUPILOT), 0.0), Wire()
    for tick in range(10):
        transaction.step(tick * 0.1, ARDUPILOT, wire)
    assert len(wire.sent) >= 3
    assert all(wire.everywhere)


@pytest.mark.parametrize(
    ("older", "newer", "kept"),
    [
        (CommandKind.RETURN, CommandKind.HOLD, False),
        (CommandKind.LAND, CommandKind.HOLD, False),
        (CommandKind.TAKEOFF, CommandKind.HOLD, False),
        (CommandKind.ARM, CommandKind.HOLD, False),
        (CommandKind.HOLD, CommandKind.LAND, False),
        (CommandKind.RETURN, CommandKind.LAND, False),
        (CommandKind.TAKEOFF, CommandKind.DISARM, False),
        (CommandKind.GUIDED, CommandKind.ARM, True),
        (CommandKind.TERMINATE, CommandKind.HOLD, True),
        (CommandKind.LAND, CommandKind.DISARM, True),
    ],
)
def test_an_older_order_is_not_repeated_after_one_that_it_would_undo(
    older: CommandKind, newer: CommandKind, *, kept: bool
) -> None:
    """Both are unanswered: what a vehicle hears last must be what was ordered last."""
    session, sent = VehicleSession(3, "udp"), []
    session.status = replace(ARDUPILOT, parameters_settled=True)

    def send(name: str, fields: Fields, *, everywhere: bool = False) -> None:
        if name == "COMMAND_LONG" and fields["command"] not in {511, 512}:
            sent.append(fields["command"])

    first = session.submit(order(older, altitude_m=10.0), 0.0)
    session.flush(0.0, send)
    session.submit(order(newer, altitude_m=10.0), 0.3)
    for tick in range(30):
        session.flush(0.3 + 0.1 * tick, send)
    number = encode_command(order(older, altitude_m=10.0), ARDUPILOT).number
    assert (number in sent[1:]) is kept
    assert (first.verdict is None) is kept
    if not kept:
        assert first.verdict is not None
        assert first.verdict.reason == f"superseded by {newer.value}"


def test_after_a_reboot_parameters_are_read_again_and_a_failed_motor_is_forgotten() -> None:
    """Repaired, or set otherwise: most parameters act from a reboot on."""
    session = VehicleSession(3, "udp")

    def hear(name: str, **fields: object) -> None:
        session.receive(name, SimpleNamespace(**fields), 0.0)

    def place(boot_ms: int) -> None:
        hear("GLOBAL_POSITION_INT", time_boot_ms=boot_ms, lat=1, lon=1, alt=0, relative_alt=0, vx=0, vy=0, vz=0)

    hear("STATUSTEXT", text="Motor failure detected", id=0, chunk_seq=0)
    session.status = replace(session.status, parameters_settled=True, parameters_missing=("GF_ACTION",))
    place(60_000)
    assert not session.status.motors_ok
    for tick in range(6):
        place(1_000 + 100 * tick)
    assert session.reboots == 1
    assert (session.status.motors_ok, session.status.parameters_settled) == (True, False)
    assert session.status.parameters_missing == ()
