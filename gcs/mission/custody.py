"""Who flies a drone, tick by tick: ours, silent, taken by a person, brought down by itself, or to be taken back.

Pure rules. A mode that we did not order is a person's or a failsafe's and is never fought, with one exception: PX4
falls out of OFFBOARD by itself when setpoints stay away for COM_OF_LOSS_T (1 s), so a change to where that leads, just
after a dead link or a stall of this machine was *measured*, is our own doing, and the drone is taken back once for
each such gap. The measure is the vehicle's own clock (gcs/links/uplink.py); while what it last got is not known,
nothing is decided: it is told to hold and asked on. What cannot be told apart is the pilot's.
"""

import math

from gcs.fleet.track import is_link_lost
from gcs.mission.drone import Control, Drone
from gcs.mission.order import DEFAULT_TIMEOUT_S
from gcs.mission.resume import STREAM_LOST_MODES
from gcs.mission.watch import DropOut, Fate
from gcs.ports import CampaignState, FlightMode, VehicleStatus

GAP_SHARE = 0.9  # of the vehicle's setpoint time-out: a link dead for so long may have ended its stream
SILENCE_SHARE = 0.8  # the same by its own clock; time requests and setpoints do not leave and arrive at one moment
UNKNOWN_SHARE = 0.5  # the newest that it is known to have got was sent longer ago, the usual delay taken off: wait
GAP_MEMORY_S = 6.0  # a mode change shows in a heartbeat, once a second, and heartbeats get lost too
GAP_MARGIN_S = 1.5  # heartbeats come late: a gap that ended longer before the last one in our mode is no excuse
SILENT_GIVE_UP_S = 60.0  # nothing heard for so long: it is not waited for any longer
PILOTS_WORDS = "pilot took over"  # PX4 says so when sticks win (COM_RC_OVERRIDE)
_OWN_WAY_DOWN = frozenset({FlightMode.RETURN, FlightMode.LAND})
_WAITING = frozenset({FlightMode.GUIDED, FlightMode.HOLD, FlightMode.TAKEOFF})
_CLIMBING = frozenset({FlightMode.GUIDED, FlightMode.HOLD, FlightMode.TAKEOFF})
_LANDING = frozenset({*_OWN_WAY_DOWN, FlightMode.GUIDED, FlightMode.HOLD, FlightMode.TAKEOFF})


def link_gap(status: VehicleStatus, now_s: float) -> bool:
    """One way of the link is dead at this moment, for as long as ends a setpoint stream."""
    timeout_s = GAP_SHARE * _timeout_s(status)
    heard_s = max(status.heartbeat_s or -math.inf, status.position_s or -math.inf)
    deaf = status.answered_s is not None and now_s - status.answered_s > timeout_s
    return deaf or now_s - heard_s > timeout_s


def note_link(drone: Drone, status: VehicleStatus, now_s: float) -> None:
    """Remember when what it got of ours, or we of it, last stayed away for as long as ends a setpoint stream."""
    if link_gap(status, now_s):
        drone.gap_s = now_s
    for silence in status.silences:
        if silence.length_s >= SILENCE_SHARE * _timeout_s(status) and silence.ended_s > drone.excused_s:
            drone.gap_s = max(drone.gap_s, silence.ended_s)
    if drone.is_streamed and status.heartbeat_s is not None and _is_expected(drone, status):
        drone.ours_s = status.heartbeat_s


def is_unreachable(drone: Drone, now_s: float) -> bool:
    """Nothing is heard of it, or it fell out of our stream and does not answer: it cannot be taken back yet."""
    status = drone.status
    if status is None or drone.track is None or is_link_lost(status, now_s):
        return True
    fallen_out = drone.control is Control.GUIDED and status.mode_name in STREAM_LOST_MODES
    return fallen_out and not drone.halted and (link_gap(status, now_s) or _is_unknown(status, now_s))


def judge_custody(drone: Drone, state: CampaignState, now_s: float, stalled_s: float) -> DropOut | None:
    """What has become of a drone that is ours; None: nothing. ``stalled_s``: when this machine last stalled."""
    status = drone.status
    if status is None or is_unreachable(drone, now_s):
        return _silence(drone, now_s) if drone.is_streamed else None
    if drone.control is Control.AUTOPILOT:
        return _by_autopilot(drone, status, state)
    if not status.armed:
        return DropOut(Fate.RELEASE, f"it disarmed in mode {status.mode_name}")
    if _is_expected(drone, status):
        back = drone.silent_s is not None and not drone.halted and drone.control is Control.GUIDED
        return DropOut(Fate.REGAIN, "it is heard again") if back else None
    memory_s = min(GAP_MEMORY_S, now_s - drone.ours_s + GAP_MARGIN_S)
    return _in_another_mode(status, gap=now_s - max(drone.gap_s, stalled_s) < memory_s)


def _in_another_mode(status: VehicleStatus, *, gap: bool) -> DropOut:
    if status.mode in _OWN_WAY_DOWN:
        return DropOut(Fate.FOLLOW, f"its failsafe or a pilot brings it down ({status.mode_name})")
    if gap and status.mode_name in STREAM_LOST_MODES and not _pilot_spoke(status):
        return DropOut(Fate.REGAIN, f"its setpoint stream was cut and it went to {status.mode_name}")
    return DropOut(Fate.RELEASE, f"a pilot or its failsafe changed the mode to {status.mode_name or status.mode}")


def _is_unknown(status: VehicleStatus, now_s: float) -> bool:
    """What we sent lately may or may not have reached it: its answer has not come yet."""
    usual_s = UNKNOWN_SHARE * _timeout_s(status) + (status.latency_s or 0.0)
    return status.reached_s is not None and now_s - status.reached_s > usual_s


def _timeout_s(status: VehicleStatus) -> float:
    return status.limits.setpoint_timeout_s or DEFAULT_TIMEOUT_S


def _silence(drone: Drone, now_s: float) -> DropOut | None:
    if drone.silent_s is None:
        mode = "" if drone.status is None else drone.status.mode_name
        words = f"it went to {mode} and does not answer" if mode in STREAM_LOST_MODES else "its link is dead"
        return DropOut(Fate.SILENT, f"{words}; it is told to hold and waited for")
    if now_s - drone.silent_s <= SILENT_GIVE_UP_S:
        return None
    words = f"its link is lost for more than {SILENT_GIVE_UP_S:.0f} s; told to return, its own failsafe flies it"
    return DropOut(Fate.RELEASE, words)


def _by_autopilot(drone: Drone, status: VehicleStatus, state: CampaignState) -> DropOut | None:
    """It climbs or lands by itself: on the ground its mode is nobody's business."""
    if not drone.is_airborne or drone.landed:
        return None
    climbing = state is CampaignState.LAUNCHING
    if status.mode in (_CLIMBING if climbing else _LANDING) or status.mode_name == drone.parked_in:
        return None
    if climbing and status.mode in _OWN_WAY_DOWN:
        return DropOut(Fate.FOLLOW, f"its failsafe or a pilot brings it down ({status.mode_name})")
    return DropOut(Fate.RELEASE, f"a pilot or its failsafe changed the mode to {status.mode_name or status.mode}")


def _is_expected(drone: Drone, status: VehicleStatus) -> bool:
    """Its mode is what our orders lead to."""
    if drone.halted or drone.control is Control.STREAM:
        return status.mode in _WAITING or status.mode_name == drone.parked_in
    return status.mode is FlightMode.GUIDED or drone.obeys_already


def _pilot_spoke(status: VehicleStatus) -> bool:
    return any(PILOTS_WORDS in text.lower() for text in status.texts[-3:])
