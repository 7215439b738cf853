"""One vehicle's MAVLink session, sans-IO: messages in, status out; what is to be sent goes to a callback."""

from collections import deque
from functools import partial
from typing import Any, Final, Protocol

from gcs.links.boot_clock import BootClock
from gcs.links.commands import (
    CommandTransaction,
    LongCommand,
    NotSendableError,
    RefusedTicket,
    encode_command,
    withdraws,
)
from gcs.links.modes import PX4
from gcs.links.parameters import ParameterReader, decode_value, limits_from
from gcs.links.status import UPDATES, changed, with_heartbeat, with_position
from gcs.links.subscriptions import Subscriptions
from gcs.links.texts import TextJoiner
from gcs.links.wire import Fields
from gcs.ports import CommandTicket, VehicleCommand, VehicleStatus

_PREARM_BIT: Final = 1 << 28  # MAV_SYS_STATUS_PREARM_CHECK
_POS_HORIZ_ABS: Final = 16  # the same bit in ESTIMATOR_STATUS_FLAGS and EKF_STATUS_FLAGS
_EKF_CONST_POS: Final = 128  # EKF_CONST_POS_MODE: no position at all
_CAPABILITY_PARAM_C_CAST: Final = 131_072  # MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_C_CAST
_TEXTS_KEPT: Final = 20
_MOTOR_WORDS: Final = ("motor failure", "potential thrust loss")
"""PX4's failure detector and ArduPilot's thrust check; their health flags do not tell."""


class Send(Protocol):
    """Sends a message to the vehicle; the target ids are filled in. ``everywhere``: over all its links."""

    def __call__(self, name: str, fields: Fields, *, everywhere: bool = False) -> None: ...


class VehicleSession:
    """Everything heard from and asked of one vehicle."""

    def __init__(self, system_id: int, address: str) -> None:
        self.status = VehicleStatus(system_id=system_id, address=address)
        self._boot_clock = BootClock()
        self._subscriptions = Subscriptions()
        self._parameters = ParameterReader()
        self._commands: dict[int, CommandTransaction] = {}
        self._texts: deque[str] = deque(maxlen=_TEXTS_KEPT)
        self._joiner = TextJoiner()
        self._estimator_ok = False
        self._prearm_ok = False
        self._motors_lost = False
        self._bytewise_params: bool | None = None

    @property
    def reboots(self) -> int:
        """How often the vehicle's boot time began anew."""
        return self._boot_clock.reboots

    def receive(self, name: str, message: Any, now_s: float) -> None:
        """Take one decoded message in: its name, and its fields as attributes."""
        self._subscriptions.on_message(name, now_s)
        update = UPDATES.get(name)
        if update is not None:
            self.status = update(self.status, message)
            if self._motors_lost:
                self.status = changed(self.status, motors_ok=False)
        match name:
            case "HEARTBEAT":
                self.status = with_heartbeat(self.status, message, now_s)
            case "GLOBAL_POSITION_INT":
                self._on_position(message, now_s)
            case "SYS_STATUS" | "EKF_STATUS_REPORT" | "ESTIMATOR_STATUS":
                self._on_readiness(name, message)
            case "STATUSTEXT":
                self._on_text(message)
            case "COMMAND_ACK":
                self._on_ack(message, now_s)
            case "PARAM_VALUE":
                self._on_param(message)
            case "SYSTEM_TIME" if message.time_unix_usec > 0:
                offset_s = message.time_unix_usec / 1e6 - now_s
                self.status = changed(self.status, clock_offset_s=offset_s)
            case "AUTOPILOT_VERSION":
                self._bytewise_params = not message.capabilities & _CAPABILITY_PARAM_C_CAST
            case _:
                pass

    def on_time(self, boot_s: float, asked_s: float) -> None:
        """The vehicle's time since boot, in answer to a request of ours that left at ``asked_s``."""
        self._boot_clock.answered(boot_s, asked_s)

    def submit(self, command: VehicleCommand, now_s: float) -> CommandTicket:
        """Open an order; it replaces unanswered ones with the same command number, and those that it withdraws."""
        try:
            wire = encode_command(command, self.status)
        except NotSendableError as reason:
            return RefusedTicket(command, str(reason))
        for number, earlier in list(self._commands.items()):
            if number == wire.number or withdraws(command.kind, earlier.command.kind):
                earlier.supersede(now_s, command.kind)
                del self._commands[number]
        transaction = CommandTransaction(command, wire, now_s)
        self._commands[wire.number] = transaction
        return transaction

    def flush(self, now_s: float, send: Send) -> None:
        """Send what is due: orders, rate requests, parameter requests."""
        for number, transaction in list(self._commands.items()):
            transaction.step(now_s, self.status, partial(_send_long, send))
            if transaction.done:
                del self._commands[number]
        for message_id in self._subscriptions.once(self.status.autopilot, now_s):
            _send_long(send, LongCommand(512, (float(message_id), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)), 0)
        missing, streams = self._subscriptions.due(self.status.autopilot, now_s)
        for message_id, rate_hz in missing:
            _send_long(send, _interval(message_id, rate_hz), 0)
        if streams:
            send("REQUEST_DATA_STREAM", {"req_stream_id": 0, "req_message_rate": 10, "start_stop": 1})
        name = self._parameters.next_request(self.status.autopilot, now_s)
        if name is not None:
            send("PARAM_REQUEST_READ", {"param_id": name, "param_index": -1})
        elif not self.status.parameters_settled and self._parameters.settled(self.status.autopilot, now_s):
            untold = self._parameters.missing(self.status.autopilot)
            self.status = changed(self.status, parameters_settled=True, parameters_missing=untold)

    def _on_position(self, message: Any, now_s: float) -> None:
        if message.lat == 0 and message.lon == 0:
            return  # both autopilots say so before their first fix; late on a jittery link it would be a jump to Africa
        booted = self._boot_clock.reboots
        measured_s = self._boot_clock.measured_s(message.time_boot_ms / 1e3, now_s)
        if self._boot_clock.reboots != booted:
            self._begin_anew()
        if measured_s is not None:
            self.status = with_position(self.status, message, measured_s)

    def _begin_anew(self) -> None:
        """It was rebooted: repaired, or with other parameters, most of which act from a reboot on."""
        self._motors_lost, self._parameters = False, ParameterReader()
        self.status = changed(self.status, motors_ok=True, parameters_settled=False, parameters_missing=())

    def _on_readiness(self, name: str, message: Any) -> None:
        """In the air the pre-arm checks have had their say; what counts then is the position."""
        if name == "SYS_STATUS":
            present = bool(message.onboard_control_sensors_present & _PREARM_BIT)
            self._prearm_ok = not present or bool(message.onboard_control_sensors_health & _PREARM_BIT)
        else:
            lost = name == "EKF_STATUS_REPORT" and bool(message.flags & _EKF_CONST_POS)
            self._estimator_ok = bool(message.flags & _POS_HORIZ_ABS) and not lost
        ready = self._estimator_ok and (self._prearm_ok or self.status.armed)
        self.status = changed(self.status, position_ready=ready)

    def _on_text(self, message: Any) -> None:
        text = self._joiner.take(message)
        if text is None:
            return
        self._texts.append(text)
        self._motors_lost |= any(words in text.lower() for words in _MOTOR_WORDS)
        self.status = changed(self.status, texts=tuple(self._texts), motors_ok=not self._motors_lost)
        for transaction in self._commands.values():
            transaction.on_text(text)

    def _on_ack(self, message: Any, now_s: float) -> None:
        transaction = self._commands.get(message.command)
        if transaction is not None:
            transaction.on_ack(message.result, now_s)

    def _on_param(self, message: Any) -> None:
        bytewise = self._bytewise_params
        if bytewise is None:
            bytewise = self.status.autopilot == PX4
        value = decode_value(message.param_value, message.param_type, bytewise=bytewise)
        if self._parameters.on_value(message.param_id.rstrip("\0"), value):
            limits = limits_from(self.status.autopilot, self._parameters.values)
            self.status = changed(self.status, limits=limits, parameters=dict(self._parameters.values))


def _send_long(send: Send, wire: LongCommand, confirmation: int, *, everywhere: bool = False) -> None:
    params = {f"param{number}": value for number, value in enumerate(wire.params, start=1)}
    send("COMMAND_LONG", {"command": wire.number, "confirmation": confirmation} | params, everywhere=everywhere)


def _interval(message_id: int, rate_hz: float) -> LongCommand:
    """MAV_CMD_SET_MESSAGE_INTERVAL (511)."""
    return LongCommand(511, (float(message_id), 1e6 / rate_hz, 0.0, 0.0, 0.0, 0.0, 0.0))
