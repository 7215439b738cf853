"""How a recovery ends: no success while a drone of it is armed or was never seen to stand. Pure rules."""

from collections.abc import Sequence

from gcs.fleet.track import is_link_lost
from gcs.mission.drone import Drone
from gcs.mission.states import Trigger
from gcs.ports import FlightMode

COMING_DOWN_S = 900.0  # a landing or return of its own is waited for so long
_COMING_DOWN = frozenset({FlightMode.RETURN, FlightMode.LAND})


def is_down(drone: Drone) -> bool:
    """Seen disarmed, by the newest that was heard of it."""
    return drone.landed or (drone.status is not None and not drone.status.armed)


def is_coming_down(drone: Drone, now_s: float) -> bool:
    """Not ours any more, but heard, and on its way to the ground by itself."""
    status = drone.status
    return not is_down(drone) and status is not None and not is_link_lost(status, now_s) and status.mode in _COMING_DOWN


def left_in_the_air(drones: Sequence[Drone]) -> tuple[str, ...]:
    """One line for each drone that is armed, or was and was not seen to land; empty when all stand."""
    return tuple(_last_seen(drone) for drone in drones if not is_down(drone))


def ending_of(planned: Trigger, left: Sequence[str]) -> Trigger:
    """A flight to the last slot that leaves a drone up has failed; an aborted one stays aborted."""
    return Trigger.LANDED_FAILED if left and planned is Trigger.LANDED else planned


def _last_seen(drone: Drone) -> str:
    status, track = drone.status, drone.track
    who = f"drone {drone.system_id}"
    if status is None or track is None:
        return f"{who} was not heard and not seen to land; it needs a pilot"
    place = f"{status.lat_deg:.6f}, {status.lon_deg:.6f}, {track.alt_home_m:.0f} m above its home"
    doing = "flying" if drone.is_airborne else "armed on the ground"
    mode = status.mode_name or status.mode.value
    return f"{who} was last seen {doing} at {place} in mode {mode}, {track.age_s:.0f} s ago; it needs a pilot"
