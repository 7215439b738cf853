"""The steps of launch and recovery. Facts behind them: docs/operations.md and the autopilots' own sources.

PX4 takes off by command and then wants a primed stream before OFFBOARD; ArduPilot takes off in GUIDED, where a
velocity sent before the altitude is reached cancels the climb.
"""

import math
from dataclasses import dataclass
from typing import ClassVar

from gcs.fleet.track import is_link_lost
from gcs.mission.drone import Control, Drone, Goal
from gcs.mission.script import Done, Failed, Moment, Step, last_words
from gcs.ports import CommandKind, FlightMode, Landed, UavTrack, Verdict, VerdictResult

ALTITUDE_REACHED_M = 1.0
SLOWEST_CLIMB_MPS = 1.0
STUCK_BELOW_MPS = 0.2
CLEAR_BELOW_M = 15.0  # a drone on the next pad must be this much lower before one descends
PAD_NEIGHBOUR_M = 20.0
WAIT_TOLD_S = 60.0  # over its pad for another one below: those that land take less, one that hangs there is told of
WAIT_AGAIN_S = 300.0  # and told of again, as long as that one is heard: nobody comes down on it
UNHEARD_S = 60.0  # where one that is not heard for so long is now nobody knows; it is not waited for without end
STAND_DOWN_S = 8.0  # an order's five repeats, a second each, and the heartbeat that shows what came of them
DISARM_PATIENCE_S = 15.0  # ArduPilot disarms 2 s after touch-down (measured), PX4 likewise


@dataclass(frozen=True)
class Ready(Step):
    """Wait for the vehicle's own flags, not for an ACK: arming succeeds before the position is good (measured)."""

    timeout_s: float
    what: ClassVar[str] = "getting ready"

    def check(self, at: Moment) -> Done | Failed | None:
        """Ready, or in a state that no campaign may start from."""
        status, track = at.drone.status, at.drone.track
        if (
            status is None
            or track is None
            or is_link_lost(status, at.now_s)
            or track.is_stale
            or not status.position_ready
        ):
            return None
        if status.autopilot not in LAUNCH_STEPS:
            return Failed(f"drone {at.drone.system_id} is neither PX4 nor ArduPilot ({status.autopilot})")
        if at.drone.is_airborne:
            return Failed(f"drone {at.drone.system_id} is in the air already; land it before a campaign starts")
        if not (0.0 <= track.east_m <= at.crew.size_m[0] and 0.0 <= track.north_m <= at.crew.size_m[1]):
            place = f"{track.east_m:.0f} m east, {track.north_m:.0f} m north of the area's corner"
            return Failed(f"drone {at.drone.system_id} stands outside the area ({place}); move it or the area")
        at.drone.pad_m = (track.east_m, track.north_m)
        return Done()


@dataclass(frozen=True)
class Turn(Step):
    """Wait until all are ready and the drone before has climbed clear; then go on as this autopilot wants it."""

    timeout_s: float = 3600.0
    what: ClassVar[str] = "waiting for its turn"

    def check(self, at: Moment) -> Done | Failed | None:
        """One after the other, the highest layer first."""
        if any(other.pad_m is None for other in at.crew.drones):
            return None
        if at.drone.index > 0:
            before = at.crew.drones[at.drone.index - 1]
            clear_m = min(at.crew.settings.launch_gap_m, at.drone.layer_alt_m)
            if before.track is None or before.track.alt_home_m < clear_m or _may_be_overtaken(before):
                return None
        assert at.drone.status is not None
        landed = at.drone.status.autopilot == "px4" and at.drone.status.mode in NOT_ARMABLE
        return Done(then=(*(AFTER_LANDING if landed else ()), *LAUNCH_STEPS[at.drone.status.autopilot]))


@dataclass(frozen=True)
class Order(Step):
    """Command the vehicle; its refusal, after retries, is the step's failure and carries its words."""

    kind: CommandKind
    timeout_s: float = 60.0

    def title(self) -> str:
        """For messages."""
        return f"order {self.kind.value!r}"

    def begin(self, at: Moment) -> None:
        """Landing and returning are flown by the autopilot."""
        at.drone.forget_orders()

    def check(self, at: Moment) -> Done | Failed | None:
        """Until the final verdict, or until the vehicle is seen to obey: its answer may be lost."""
        verdict = at.drone.order(self.kind, at.crew.link, at.now_s)  # first, so that an answer in time is logged
        if verdict is None and at.drone.obeys_already:
            at.drone.control = Control.AUTOPILOT
            return Done()
        if verdict is None:
            return None
        if not verdict.accepted:
            return Failed(refusal(verdict))
        if self.kind in {CommandKind.LAND, CommandKind.RETURN}:
            at.drone.control = Control.AUTOPILOT
        return Done()


@dataclass(frozen=True)
class Climb(Step):
    """Wait until the layer is reached; nothing is sent meanwhile."""

    timeout_s: float = 300.0
    what: ClassVar[str] = "climbing to its layer"

    def check(self, at: Moment) -> Done | Failed | None:
        """Reached, or the motors stopped, or no way up."""
        if at.drone.track is None or at.drone.status is None:
            return None
        if at.drone.track.alt_home_m >= at.drone.layer_alt_m - ALTITUDE_REACHED_M:
            return Done()
        if at.after_s > 5.0 and not at.drone.status.armed:
            return Failed(f"drone {at.drone.system_id} disarmed during take-off{last_words(at.drone)}")
        rises = at.drone.track.vel_up_mps >= STUCK_BELOW_MPS  # its clock or its climb may be slower than ours
        if at.after_s > 30.0 + at.drone.layer_alt_m / SLOWEST_CLIMB_MPS and not rises:
            stuck = f"stuck at {at.drone.track.alt_home_m:.0f} of {at.drone.layer_alt_m:.0f} m"
            return Failed(f"drone {at.drone.system_id} does not climb, {stuck}{last_words(at.drone)}")
        return None


@dataclass(frozen=True)
class Prime(Step):
    """Stream velocities that hold the place until the vehicle may be switched over."""

    timeout_s: float = 30.0
    what: ClassVar[str] = "priming the setpoint stream"

    def begin(self, at: Moment) -> None:
        """Hold where it is, at its layer."""
        at.drone.control = Control.STREAM
        at.drone.goal = _goal_here(at)

    def check(self, at: Moment) -> Done | Failed | None:
        """Long enough."""
        return Done() if at.after_s >= at.crew.settings.prime_s else None


@dataclass(frozen=True)
class Obeying(Step):
    """Wait until the vehicle's heartbeat shows that it follows our velocities."""

    timeout_s: float = 10.0
    what: ClassVar[str] = "switching to guided flight"

    def check(self, at: Moment) -> Done | Failed | None:
        """The mode, not the ACK."""
        if at.drone.status is None or at.drone.status.mode is not FlightMode.GUIDED:
            return None
        at.drone.control = Control.GUIDED
        return Done()


@dataclass(frozen=True)
class FlyTo(Step):
    """Fly to the launch point or home to the pad, in the drone's own layer, straight."""

    home: bool
    timeout_s: float = 900.0

    def title(self) -> str:
        """For messages."""
        return "flying home" if self.home else "flying to its launch point"

    def begin(self, at: Moment) -> None:
        """Set the goal."""
        point_m = at.drone.pad_m if self.home and at.drone.pad_m is not None else at.drone.launch_m
        speed_mps = min(at.crew.settings.transit_speed_mps, at.drone.top_mps)
        at.drone.goal = Goal(point_m, at.drone.layer_alt_m, speed_mps)

    def check(self, at: Moment) -> Done | Failed | None:
        """Within reach; the landing wants it closer and slow."""
        if at.drone.track is None or at.drone.goal is None:
            return None
        east_m, north_m = at.drone.goal.point_m
        distance_m = math.hypot(at.drone.track.east_m - east_m, at.drone.track.north_m - north_m)
        wanted_m = 1.0 if self.home else at.crew.settings.arrival_m
        return Done() if distance_m <= wanted_m and at.drone.track.speed_mps < 1.0 else None


@dataclass(frozen=True)
class Descend(Step):
    """Down over the pad under our velocity, once the drones below are clear."""

    timeout_s: float = 900.0
    what: ClassVar[str] = "descending to its pad"

    def check(self, at: Moment) -> Done | Failed | None:
        """Start when clear; done at the height where the autopilot lands by itself."""
        if at.drone.track is None or at.drone.goal is None:
            return None
        handover_m = at.crew.settings.landing_handover_m
        below = _below(at)
        at.drone.waits_for = below.system_id if below is not None and at.after_s >= WAIT_TOLD_S else None
        if below is None:
            at.drone.goal.alt_home_m = handover_m
        elif at.after_s >= WAIT_AGAIN_S and below.age_s <= UNHEARD_S:
            at.drone.waits_for = None  # so that it is told again
            return Done(then=(self,))
        return Done() if at.drone.track.alt_home_m <= handover_m + ALTITUDE_REACHED_M else None


@dataclass(frozen=True)
class Down(Step):
    """Wait until the vehicle has landed and disarmed itself; a vehicle that forgets to is told."""

    timeout_s: float = 300.0
    what: ClassVar[str] = "landing"

    def check(self, at: Moment) -> Done | Failed | None:
        """Disarmed is what counts."""
        if at.drone.status is None:
            return None
        if not at.drone.status.armed:
            at.drone.landed = True
            return Done()
        on_ground = at.drone.status.landed is Landed.ON_GROUND
        if on_ground and at.after_s > DISARM_PATIENCE_S:
            at.drone.order(CommandKind.DISARM, at.crew.link, at.now_s, attempts=10)
        return None


@dataclass(frozen=True)
class StandDown(Step):
    """On the ground when its launch was called off; an order to arm or take off may still be obeyed.

    Its answer, its repeats and the heartbeat that shows it armed come seconds later: told to disarm, and to land once
    it flies or says that it cannot disarm, it is watched until nothing can come any more.
    """

    timeout_s: float = 60.0
    what: ClassVar[str] = "standing down"

    def begin(self, at: Moment) -> None:
        """Whatever its launch had ordered last is not asked for again."""
        at.drone.forget_orders()

    def check(self, at: Moment) -> Done | Failed | None:
        """Seen disarmed for long enough, or in the air after all."""
        drone, armed = at.drone, at.drone.status is not None and at.drone.status.armed
        verdict = drone.order(CommandKind.DISARM, at.crew.link, at.now_s, attempts=1)
        if drone.is_airborne or (armed and verdict is not None and verdict.result is VerdictResult.REFUSED):
            return Done(then=LAND_HERE_STEPS)
        if armed or at.after_s < STAND_DOWN_S:
            return None
        drone.landed = True
        return Done()


@dataclass(frozen=True)
class Follow(Step):
    """Its failsafe or a pilot brings it down: wait until it stands, and send nothing."""

    timeout_s: float = 1800.0
    what: ClassVar[str] = "coming down by itself"
    follows: ClassVar[bool] = True

    def check(self, at: Moment) -> Done | Failed | None:
        """Disarmed is what counts."""
        if at.drone.status is None or at.drone.status.armed:
            return None
        at.drone.landed = True
        return Done()


LAUNCH_STEPS: dict[str, tuple[Step, ...]] = {
    "px4": (
        Order(CommandKind.ARM),
        Order(CommandKind.TAKEOFF),
        Climb(),
        Prime(),
        Order(CommandKind.GUIDED),
        Obeying(),
        FlyTo(home=False),
    ),
    "ardupilot": (
        Order(CommandKind.GUIDED),
        Order(CommandKind.ARM),
        Order(CommandKind.TAKEOFF),
        Climb(),
        Prime(),
        Obeying(),
        FlyTo(home=False),
    ),
}
NOT_ARMABLE = frozenset({FlightMode.LAND, FlightMode.RETURN})  # PX4 stays in it after the landing of a campaign before
AFTER_LANDING: tuple[Step, ...] = (Order(CommandKind.HOLD),)
REGAIN_STEPS: tuple[Step, ...] = (Prime(), Order(CommandKind.GUIDED), Obeying())
HOME_STEPS: tuple[Step, ...] = (FlyTo(home=True), Descend(), Order(CommandKind.LAND), Down())
LAND_HERE_STEPS: tuple[Step, ...] = (Order(CommandKind.LAND), Down())
RETURN_STEPS: tuple[Step, ...] = (Order(CommandKind.RETURN), Down(timeout_s=900.0))
FOLLOW_STEPS: tuple[Step, ...] = (Follow(),)
STAND_DOWN_STEPS: tuple[Step, ...] = (StandDown(),)


def launch_steps(ready_timeout_s: float) -> tuple[Step, ...]:
    """From standing on the pad to the launch point in its layer."""
    return (Ready(ready_timeout_s), Turn())


def refusal(verdict: Verdict) -> str:
    """A verdict in the operator's words, with the vehicle's own."""
    order, drone = verdict.command.kind.value, verdict.command.system_id
    if verdict.result is VerdictResult.TIMEOUT:
        return f"drone {drone} did not answer {order!r} in {verdict.attempts} tries"
    words = f": {verdict.reason}" if verdict.reason else " without saying why"
    return f"drone {drone} answered {order!r} with {verdict.result.value}{words}"


def _goal_here(at: Moment) -> Goal:
    drone = at.drone
    point_m = (drone.track.east_m, drone.track.north_m) if drone.track is not None else drone.launch_m
    return Goal(point_m, drone.layer_alt_m, at.crew.settings.transit_speed_mps)


def _may_be_overtaken(before: Drone) -> bool:
    """Below its layer and not in a take-off's climb: after a restart or a regain it is flown up slowly, or hangs."""
    track = before.track
    if track is None or track.alt_home_m >= before.layer_alt_m - 2.0 * ALTITUDE_REACHED_M:
        return False
    return before.is_streamed or track.vel_up_mps < SLOWEST_CLIMB_MPS


def _below(at: Moment) -> UavTrack | None:
    """The drone that is in the air where this one comes down, of the campaign or any other of ours."""
    others = [d.track for d in at.crew.drones if d is not at.drone and d.is_airborne and not d.landed]
    tracks = [track for track in (*others, *at.crew.bystanders) if track is not None]
    return next((track for track in tracks if not _is_clear(at.drone.track, track)), None)


def _is_clear(own: UavTrack | None, other: UavTrack) -> bool:
    """The other is higher, elsewhere or already well below."""
    if own is None:
        return True
    apart_m = math.hypot(other.east_m - own.east_m, other.north_m - own.north_m)
    lower_m = own.alt_home_m - other.alt_home_m
    return lower_m < 0.0 or lower_m >= CLEAR_BELOW_M or apart_m > PAD_NEIGHBOUR_M
