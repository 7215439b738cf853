"""One order to one vehicle until its verdict (https://mavlink.io/en/services/command.html), sans-IO.

Repeats carry ``confirmation`` + 1; IN_PROGRESS extends the wait; a refusal waits a moment for the vehicle's own words.
"""

import math
from dataclasses import dataclass
from typing import Final, Protocol

from gcs.links.modes import ARDUPILOT, MODE_PARAMETERS, PX4
from gcs.ports import CommandKind, FlightMode, Landed, VehicleCommand, VehicleStatus, Verdict, VerdictResult

ACK_TIMEOUT_S: Final = 1.0
URGENT_TIMEOUT_S: Final = 0.3  # an emergency stop is not asked for at leisure
MAX_ATTEMPTS: Final = 5
IN_PROGRESS_TIMEOUT_S: Final = 10.0
WORDS_WAIT_S: Final = 0.5

# MAV_CMD (common.xml)
CMD_NAV_RETURN_TO_LAUNCH: Final = 20
CMD_NAV_LAND: Final = 21
CMD_NAV_TAKEOFF: Final = 22
CMD_DO_SET_MODE: Final = 176
CMD_DO_FLIGHTTERMINATION: Final = 185
CMD_COMPONENT_ARM_DISARM: Final = 400

_FORCE_MAGIC: Final = 21196.0  # MAV_CMD_COMPONENT_ARM_DISARM parameter 2
_MODE_FLAG_CUSTOM: Final = 1.0  # MAV_MODE_FLAG_CUSTOM_MODE_ENABLED

# MAV_RESULT (common.xml)
_ACCEPTED: Final = 0
_UNSUPPORTED: Final = 3
_IN_PROGRESS: Final = 5
_RESULT_NAMES: Final = {
    1: "temporarily rejected",
    2: "denied",
    3: "unsupported",
    4: "failed",
    6: "cancelled",
    7: "only as COMMAND_LONG",
    8: "only as COMMAND_INT",
    9: "unsupported frame",
}


@dataclass(frozen=True)
class LongCommand:
    """A COMMAND_LONG: number and seven parameters."""

    number: int
    params: tuple[float, float, float, float, float, float, float]


_MOVES: Final = frozenset(
    {CommandKind.TAKEOFF, CommandKind.GUIDED, CommandKind.HOLD, CommandKind.RETURN, CommandKind.LAND}
)
_ENDS: Final = frozenset({CommandKind.HOLD, CommandKind.RETURN, CommandKind.LAND, CommandKind.TERMINATE})


def withdraws(newer: CommandKind, older: CommandKind) -> bool:
    """An unanswered older order must not be repeated after the newer one: its repeat would undo it.

    A return that nobody answered, then a stop: the return's next repeat would take the vehicle out of its hold. Only
    a termination stands until it is answered.
    """
    if newer in _ENDS and older is CommandKind.ARM:
        return True
    if newer is CommandKind.DISARM:
        return older in {CommandKind.ARM, CommandKind.TAKEOFF}
    return newer in _MOVES | _ENDS and older in _MOVES


class NotSendableError(Exception):
    """This order cannot be put to this vehicle as it is now."""


def encode_command(command: VehicleCommand, status: VehicleStatus) -> LongCommand:
    """An order in the vehicle's own dialect; NotSendableError with the reason when there is none."""
    if command.kind is CommandKind.TAKEOFF:
        return _takeoff(command, status)
    if command.kind in _MODES:
        return _set_mode(_MODES[command.kind], status)
    if command.kind in {CommandKind.ARM, CommandKind.DISARM}:
        wanted = 1.0 if command.kind is CommandKind.ARM else 0.0
        return _long(CMD_COMPONENT_ARM_DISARM, wanted, _FORCE_MAGIC if command.force else 0.0)
    return _PLAIN[command.kind]


def _long(number: int, *params: float) -> LongCommand:
    p = (*params, *([0.0] * (7 - len(params))))
    return LongCommand(number, (p[0], p[1], p[2], p[3], p[4], p[5], p[6]))


_MODES: Final = {CommandKind.GUIDED: FlightMode.GUIDED, CommandKind.HOLD: FlightMode.HOLD}
_PLAIN: Final = {
    CommandKind.RETURN: _long(CMD_NAV_RETURN_TO_LAUNCH),
    CommandKind.LAND: _long(CMD_NAV_LAND, 0.0, 0.0, 0.0, math.nan, math.nan, math.nan),
    CommandKind.TERMINATE: _long(CMD_DO_FLIGHTTERMINATION, 1.0),
}


def _set_mode(mode: FlightMode, status: VehicleStatus) -> LongCommand:
    if status.autopilot not in MODE_PARAMETERS:
        raise NotSendableError(f"vehicle {status.system_id} has not said yet whether it is PX4 or ArduPilot")
    return _long(CMD_DO_SET_MODE, _MODE_FLAG_CUSTOM, *MODE_PARAMETERS[status.autopilot][mode])


def _takeoff(command: VehicleCommand, status: VehicleStatus) -> LongCommand:
    """PX4 takes the altitude above mean sea level, ArduPilot above home."""
    if command.altitude_m is None or not math.isfinite(command.altitude_m) or command.altitude_m <= 0.0:
        raise NotSendableError("a take-off needs altitude_m above home, greater than 0")
    if status.autopilot == ARDUPILOT:
        return _long(CMD_NAV_TAKEOFF, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, command.altitude_m)
    if status.autopilot != PX4:
        raise NotSendableError(f"vehicle {status.system_id} has not said yet whether it is PX4 or ArduPilot")
    if status.alt_amsl_m is None or status.alt_home_m is None:
        raise NotSendableError(
            f"vehicle {status.system_id} has not reported its altitude; PX4 takes off to one above sea level"
        )
    home_amsl_m = status.alt_amsl_m - status.alt_home_m
    nan = math.nan
    return _long(CMD_NAV_TAKEOFF, nan, 0.0, 0.0, nan, nan, nan, home_amsl_m + command.altitude_m)


class Sender(Protocol):
    """Sends a command with its ``confirmation`` count; ``everywhere``: over all links of the vehicle."""

    def __call__(self, wire: LongCommand, confirmation: int, *, everywhere: bool = False) -> None: ...


class CommandTransaction:
    """A ticket (:class:`gcs.ports.CommandTicket`) that its session drives."""

    def __init__(self, command: VehicleCommand, wire: LongCommand, now_s: float) -> None:
        self.command = command
        self.wire = wire
        self.verdict: Verdict | None = None
        self._begun_s = now_s
        self._deadline_s = now_s
        self._attempts = 0
        self._refusal: tuple[VerdictResult, str] | None = None
        self._words: list[str] = []

    @property
    def done(self) -> bool:
        """The verdict is known."""
        return self.verdict is not None

    def step(self, now_s: float, status: VehicleStatus, send: Sender) -> None:
        """Send when due; give up after the last repeat."""
        if self.done or now_s < self._deadline_s:
            return
        if self._refusal is not None:
            self._finish(now_s, *self._refusal)
        elif self._attempts >= MAX_ATTEMPTS:
            self._finish(now_s, VerdictResult.TIMEOUT, f"no answer after {self._attempts} tries")
        elif self._attempts > 0 and self._already_happening(status):
            self._finish(now_s, VerdictResult.ACCEPTED, "the answer was lost, but the vehicle is climbing")
        else:
            urgent = self.command.urgent
            send(self.wire, self._attempts, everywhere=urgent)
            self._attempts += 1
            self._deadline_s = now_s + (URGENT_TIMEOUT_S if urgent else ACK_TIMEOUT_S)

    def on_ack(self, result: int, now_s: float) -> None:
        """The vehicle's COMMAND_ACK for this command number."""
        if self.done or self._refusal is not None or self._attempts == 0:
            return
        if result == _ACCEPTED:
            self._finish(now_s, VerdictResult.ACCEPTED, "")
        elif result == _IN_PROGRESS:
            self._deadline_s = now_s + IN_PROGRESS_TIMEOUT_S
        else:
            kind = VerdictResult.UNSUPPORTED if result == _UNSUPPORTED else VerdictResult.REFUSED
            self._refusal = (kind, _RESULT_NAMES.get(result, f"result {result}"))
            self._deadline_s = now_s + WORDS_WAIT_S

    def on_text(self, text: str) -> None:
        """A STATUSTEXT that came while the order was open."""
        if not self.done:
            self._words.append(text)

    def supersede(self, now_s: float, by: CommandKind) -> None:
        """A newer order makes this one moot."""
        if not self.done:
            self._finish(now_s, VerdictResult.NOT_SENT, f"superseded by {by.value}")

    def _already_happening(self, status: VehicleStatus) -> bool:
        """A repeated take-off is refused by a vehicle that obeyed the first one."""
        airborne = status.landed in {Landed.TAKING_OFF, Landed.IN_AIR}
        return self.command.kind is CommandKind.TAKEOFF and airborne

    def _finish(self, now_s: float, result: VerdictResult, reason: str) -> None:
        words = "; ".join(dict.fromkeys(self._words))
        if result is not VerdictResult.ACCEPTED and words:
            reason = f"{reason}: {words}" if reason else words
        self.verdict = Verdict(self.command, result, reason, self._attempts, now_s - self._begun_s)


class RefusedTicket:
    """A ticket for an order that was never sent."""

    def __init__(self, command: VehicleCommand, reason: str) -> None:
        self.verdict: Verdict | None = Verdict(command, VerdictResult.NOT_SENT, reason)
