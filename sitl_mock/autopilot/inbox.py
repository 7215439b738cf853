"""What each received message does. Handlers take the vehicle, the frame and the peer that sent it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sitl_mock.autopilot import commands, events, failsafe, missions, orders, setpoints
from sitl_mock.autopilot.constants import MAV_TYPE_GCS, Result, Severity
from sitl_mock.autopilot.flight_commands import request_mode
from sitl_mock.autopilot.parameters import Param, from_wire, to_wire
from sitl_mock.autopilot.state import Later, Note, Vehicle
from sitl_mock.autopilot.streams import ALL_GROUPS, GROUPS

if TYPE_CHECKING:
    from collections.abc import Callable

    from sitl_mock.wire import Frame


def _on_heartbeat(vehicle: Vehicle, frame: Frame, _: int) -> None:
    if frame["type"] == MAV_TYPE_GCS:
        failsafe.heard_ground(vehicle, frame.system)


def _on_command(vehicle: Vehicle, frame: Frame, peer: int) -> None:
    order = orders.read(frame, peer)
    if any(later.values["command"] == order.command for later in vehicle.later):
        busy = {"command": order.command, "result": int(Result.IN_PROGRESS)}  # asked again (confirmation > 0)
        vehicle.reply(peer, "COMMAND_ACK", **busy, target_system=frame.system, target_component=frame.component)
        return
    verdict = commands.execute(vehicle, order)
    ack = {"command": order.command, "result": int(verdict.result)}
    to = {"target_system": frame.system, "target_component": frame.component}
    if verdict.then_s > 0.0:
        done = {"command": order.command, "result": int(Result.ACCEPTED)} | to
        vehicle.later.append(Later(vehicle.now_s + verdict.then_s, peer, done))
    # The acknowledgement goes before what the command made the vehicle say.
    vehicle.notes.insert(0, Note(peer, "COMMAND_ACK", ack | to))


def _on_set_mode(vehicle: Vehicle, frame: Frame, peer: int) -> None:
    mode = vehicle.flavour.modes.by_number(frame["custom_mode"])
    verdict = request_mode(vehicle, mode)
    if verdict.text:
        vehicle.say(Severity.CRITICAL, verdict.text)
    if vehicle.flavour.name == "ardupilot":  # handle_set_mode acknowledges as message 11
        to = {"target_system": frame.system, "target_component": frame.component}
        vehicle.reply(peer, "COMMAND_ACK", command=11, result=int(verdict.result), **to)


def _on_setpoint(vehicle: Vehicle, frame: Frame, _: int) -> None:
    setpoints.receive(vehicle, frame)


def _on_param_list(vehicle: Vehicle, _: Frame, peer: int) -> None:
    vehicle.params_due = [(who, at) for who, at in vehicle.params_due if who != peer] + [(peer, 0)]


def _on_param_read(vehicle: Vehicle, frame: Frame, peer: int) -> None:
    param = vehicle.params.find(frame["param_id"], frame["param_index"])
    if param is not None:
        say_param(vehicle, param, peer)


def _on_param_set(vehicle: Vehicle, frame: Frame, _: int) -> None:
    """Both flavours are silent about unknown names, and tell everybody what stands afterwards."""
    old = vehicle.params.find(frame["param_id"])
    if old is None:
        return
    value = from_wire(frame["param_value"], old.type, vehicle.flavour.encoding)
    param = vehicle.params.set(old.name, value) if value is not None else old
    assert param is not None
    vehicle.body.set_limits(vehicle.flavour.limits(vehicle.params, vehicle.airframe))
    say_param(vehicle, param, None)


def say_param(vehicle: Vehicle, param: Param, peer: int | None) -> None:
    values = {
        "param_id": param.name,
        "param_value": to_wire(param, vehicle.flavour.encoding),
        "param_type": int(param.type),
        "param_count": len(vehicle.params),
        "param_index": param.index,
    }
    vehicle.notes.append(Note(peer, "PARAM_VALUE", values))


def _on_data_stream(vehicle: Vehicle, frame: Frame, _: int) -> None:
    """The old way to ask for telemetry; PX4 does not know it."""
    if vehicle.flavour.name == "px4":
        return
    group, rate_hz = frame["req_stream_id"], frame["req_message_rate"] if frame["start_stop"] else 0
    groups = GROUPS.values() if group == ALL_GROUPS else [GROUPS.get(group, ())]
    interval_s = 1.0 / rate_hz if rate_hz else -1.0
    for name in (name for names in groups for name in names):
        vehicle.streams.set_interval(name, interval_s, vehicle.now_s)


def _on_timesync(vehicle: Vehicle, frame: Frame, peer: int) -> None:
    if frame["tc1"] == 0:
        vehicle.reply(peer, "TIMESYNC", tc1=round(vehicle.clock_s * 1e9), ts1=frame["ts1"])


def _on_ping(vehicle: Vehicle, frame: Frame, peer: int) -> None:
    if frame["target_system"] == 0 and frame["target_component"] == 0:
        to = {"target_system": frame.system, "target_component": frame.component}
        vehicle.reply(peer, "PING", time_usec=frame["time_usec"], seq=frame["seq"], **to)


def _on_mission(vehicle: Vehicle, frame: Frame, peer: int) -> None:
    missions.receive(vehicle, frame, peer)


def _on_setup_signing(vehicle: Vehicle, frame: Frame, _: int) -> None:
    """A new key, or none (zero key and zero time stamp). Once there is a key, only a signed message gets here."""
    if vehicle.armed:
        vehicle.say(Severity.ERROR, "ERROR: Won't setup signing when armed")
        return
    vehicle.signer.set_key(bytes(frame["secret_key"]), frame["initial_timestamp"])


_RECEIVE: dict[str, Callable[[Vehicle, Frame, int], None]] = {
    "HEARTBEAT": _on_heartbeat,
    "COMMAND_LONG": _on_command,
    "COMMAND_INT": _on_command,
    "SET_MODE": _on_set_mode,
    "SET_POSITION_TARGET_LOCAL_NED": _on_setpoint,
    "SET_POSITION_TARGET_GLOBAL_INT": _on_setpoint,
    "PARAM_REQUEST_LIST": _on_param_list,
    "PARAM_REQUEST_READ": _on_param_read,
    "PARAM_SET": _on_param_set,
    "REQUEST_DATA_STREAM": _on_data_stream,
    "REQUEST_EVENT": events.requested,
    "SETUP_SIGNING": _on_setup_signing,
    "TIMESYNC": _on_timesync,
    "PING": _on_ping,
    "MISSION_COUNT": _on_mission,
    "MISSION_ITEM": _on_mission,
    "MISSION_ITEM_INT": _on_mission,
    "MISSION_REQUEST": _on_mission,
    "MISSION_REQUEST_INT": _on_mission,
    "MISSION_REQUEST_LIST": _on_mission,
    "MISSION_CLEAR_ALL": _on_mission,
    "MISSION_SET_CURRENT": _on_mission,
}


def is_mine(vehicle: Vehicle, frame: Frame) -> bool:
    """Whether the message is addressed to this vehicle, alone or with all."""
    system = frame.values.get("target_system", 0)
    component = frame.values.get("target_component", 0)
    if frame.system == vehicle.system or system not in (0, vehicle.system):
        return False
    any_component = vehicle.flavour.broadcast_components and frame.name in {"COMMAND_LONG", "COMMAND_INT"}
    return any_component or component in (0, vehicle.component)


def receive(vehicle: Vehicle, frame: Frame, peer: int) -> None:
    """Takes one frame. What nobody handles, or is meant for others, is ignored."""
    handler = _RECEIVE.get(frame.name)
    if handler is not None and is_mine(vehicle, frame):
        handler(vehicle, frame, peer)
