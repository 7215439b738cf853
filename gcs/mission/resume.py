"""Taking a campaign up again that another process of this server flew: what becomes of each drone. Pure rules.

Between the two processes the vehicles flew by their own rules: a setpoint stream that ends leaves PX4 holding in
POSCTL after 1 s (COM_OF_LOSS_T, COM_OBL_RC_ACT 0), ArduPilot in GUIDED at rest after 3 s (GUID_TIMEOUT); a take-off
under way is finished, a landing goes on. So what a vehicle does now, not what was ordered, decides what it is told
next: no order is repeated that may have been obeyed.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from gcs.fleet.track import is_link_lost
from gcs.mission.drone import Control, Drone
from gcs.mission.order import CampaignOrder, FleetLimits
from gcs.mission.script import Done, Failed, Moment, Step
from gcs.mission.steps import ALTITUDE_REACHED_M, HOME_STEPS, REGAIN_STEPS, Climb, Down, FlyTo, launch_steps
from gcs.ports import CampaignState, Checkpoint, DroneCheckpoint, FlightMode, SlotRecord, VehicleStatus

LAUNCH_PATIENCE_S = 60.0  # nobody is in a slot yet: a launch rather waits than fails
PATIENCE_S = 5.0  # five missed heartbeats: a vehicle that says nothing for so long has lost its link
LANDING_S = 900.0
STREAM_LOST_MODES = frozenset({"POSCTL", "AUTO.LOITER"})
"""Where PX4 goes by itself when setpoints stop (COM_OBL_RC_ACT 0 and 5): our doing, so far as can be told."""


class ResumeError(ValueError):
    """The records do not allow the campaign to be taken up; one line that says why."""


@dataclass(frozen=True)
class Resumption:
    """``checkpoint`` was taken at ``taken_s`` on the present flight clock (negative: before it began)."""

    checkpoint: Checkpoint
    records: tuple[SlotRecord, ...]
    taken_s: float
    going_home: str = ""  # why it cannot go on, or empty

    @property
    def limits(self) -> FleetLimits:
        """What the plans so far counted on."""
        return FleetLimits(self.checkpoint.max_speed_mps, self.checkpoint.max_accel_mps2)

    @property
    def state(self) -> CampaignState:
        """A campaign that was flying but never opened its books is brought to its launch points again."""
        state = self.checkpoint.state
        unopened = state in {CampaignState.FLYING, CampaignState.PAUSED} and not self.records
        return CampaignState.LAUNCHING if unopened else state

    def without(self, system_id: int) -> "Resumption":
        """A person has ordered this drone something before it was taken over: it is not ours any more."""
        drones = tuple(
            replace(drone, control=Control.RELEASED.value) if drone.system_id == system_id else drone
            for drone in self.checkpoint.drones
        )
        return replace(self, checkpoint=replace(self.checkpoint, drones=drones))

    @property
    def slot_start_s(self) -> float:
        """Of the slot after the newest record; a record may be newer than the checkpoint."""
        since_s = self.taken_s - self.checkpoint.slot_elapsed_s
        if not self.records or self.checkpoint.slot >= self.records[-1].slot:
            return since_s
        newest, before = self.records[-1], self.records[max(0, self.checkpoint.slot)]
        return since_s + newest.time_s - before.time_s


def check_resumption(resumption: Resumption, order: CampaignOrder) -> None:
    """Raises ResumeError when the records are not those of ``order``, or have a hole."""
    records = resumption.records
    drones = tuple(drone.system_id for drone in resumption.checkpoint.drones)
    if drones != order.system_ids:
        raise ResumeError(f"it flew with drones {drones}, and this server has {order.system_ids} for it")
    if [record.slot for record in records] != list(range(len(records))):
        raise ResumeError("its slot records have a hole")
    recorded = tuple(user.user_id for user in records[-1].users) if records else ()
    if records and recorded != order.user_ids[: len(recorded)]:
        raise ResumeError("its users are not those of the records; was the trace changed?")


RISING_MPS = 0.3
RISE_PATIENCE_S = 10.0


@dataclass(frozen=True)
class Rise(Step):
    """A take-off under way is finished by the vehicle; one that was cut off is not waited for: it is flown up."""

    timeout_s: float = 300.0
    what = "finishing its take-off"

    def check(self, at: Moment) -> Done | Failed | None:
        """At its layer, or in the air and not rising any more."""
        track = at.drone.track
        if track is None:
            return None
        arrived = track.alt_home_m >= at.drone.layer_alt_m - ALTITUDE_REACHED_M
        given_up = at.after_s > RISE_PATIENCE_S and at.drone.is_airborne and track.vel_up_mps < RISING_MPS
        return Done() if arrived or given_up else None


GO_ON_STEPS: tuple[Step, ...] = (*REGAIN_STEPS, Climb(), FlyTo(home=False))
"""From the air to the launch point: what is left of the climb is flown under our velocity."""


@dataclass(frozen=True)
class Settle(Step):
    """An armed vehicle on the ground: either its take-off comes, or it disarms itself after 10 s. Then go on."""

    timeout_s: float = 60.0
    what = "waiting whether it takes off or disarms"

    def check(self, at: Moment) -> Done | Failed | None:
        """The vehicle tells which order it had taken up."""
        if at.drone.is_airborne:
            return Done(then=(Rise(), *GO_ON_STEPS))
        if at.drone.status is not None and not at.drone.status.armed:
            return Done(then=launch_steps(at.crew.settings.ready_timeout_s))
        return None


@dataclass(frozen=True)
class Takeover:
    """What one drone is to do; ``reason`` where it is not ours any more."""

    control: Control
    steps: tuple[Step, ...] = ()
    active: bool = False
    landed: bool = False
    halted: bool = False  # no part in the slots until its steps are done
    reason: str = ""
    silent: bool = False  # waited for, as a drone whose link is dead


def has_reported(drones: Sequence[Drone], was: Checkpoint, now_s: float) -> bool:
    """Everyone who was ours has been heard with a place: the campaign can be judged."""
    ours = [drone for drone, then in zip(drones, was.drones, strict=True) if then.control != Control.RELEASED]
    return all(_is_heard(drone, now_s) for drone in ours)


def takeover(state: CampaignState, was: DroneCheckpoint, drone: Drone, now_s: float, ready_s: float) -> Takeover:
    """The table: campaign's state, what the drone was and what it does now, to what it is to do."""
    status = drone.status
    if was.control == Control.RELEASED:
        return Takeover(Control.RELEASED, reason="it was released before the campaign was taken up")
    if status is None or not _is_heard(drone, now_s):
        return _unheard(state, was)
    return _in_the_air(state, was, status) if drone.is_airborne else _on_ground(state, was, status, ready_s)


def _in_the_air(state: CampaignState, was: DroneCheckpoint, status: VehicleStatus) -> Takeover:
    if status.mode in {FlightMode.RETURN, FlightMode.LAND}:
        if state is CampaignState.RECOVERING or not was.active:
            return Takeover(Control.AUTOPILOT, (Down(LANDING_S),))
        return _gone(f"a pilot or its failsafe brings it down ({status.mode_name})")
    if not _is_ours(status):
        return _gone(f"a pilot or its failsafe changed the mode to {status.mode_name or status.mode}")
    return _regain(state, was)


def _on_ground(state: CampaignState, was: DroneCheckpoint, status: VehicleStatus, ready_s: float) -> Takeover:
    if state is CampaignState.LAUNCHING:
        return Takeover(Control.AUTOPILOT, (Settle(),) if status.armed else launch_steps(ready_s))
    if was.active:
        return _gone("it came down while the server was away")
    if status.armed:
        return Takeover(Control.AUTOPILOT, (Down(),))
    return Takeover(Control.AUTOPILOT, landed=True)


def _unheard(state: CampaignState, was: DroneCheckpoint) -> Takeover:
    """Nothing says that it is gone: it is waited for like any drone whose link is dead (``gcs/mission/custody.py``)."""
    if was.landed:
        return Takeover(Control.AUTOPILOT, landed=True)
    if state is CampaignState.LAUNCHING:
        return _gone("it was not heard after the restart")
    in_slots = was.active and state is not CampaignState.RECOVERING
    return Takeover(Control.GUIDED, () if in_slots else HOME_STEPS, active=in_slots, silent=True)


def _regain(state: CampaignState, was: DroneCheckpoint) -> Takeover:
    if state is CampaignState.LAUNCHING:
        rise = (Rise(),) if was.control == Control.AUTOPILOT else ()  # else it was at its layer already
        return Takeover(Control.AUTOPILOT, (*rise, *GO_ON_STEPS))
    if was.active and state is not CampaignState.RECOVERING:
        return Takeover(Control.STREAM, REGAIN_STEPS, active=True, halted=True)
    return Takeover(Control.STREAM, (*REGAIN_STEPS, *HOME_STEPS))


def _is_heard(drone: Drone, now_s: float) -> bool:
    status, track = drone.status, drone.track
    return status is not None and track is not None and not is_link_lost(status, now_s) and not track.is_stale


def is_stream_lost(status: VehicleStatus | None) -> bool:
    """In the air and in a mode that the end of a setpoint stream leads to."""
    return status is not None and status.armed and status.mode_name in STREAM_LOST_MODES


def _is_ours(status: VehicleStatus) -> bool:
    """Modes that our orders or the end of our stream lead to; any other one is a person's."""
    return status.mode is not FlightMode.PILOT or status.mode_name in STREAM_LOST_MODES


def _gone(reason: str) -> Takeover:
    return Takeover(Control.RELEASED, reason=reason)
