"""What is done with one drone when its part in the campaign changes: scripts and hands, no decisions."""

import math

from gcs.mission.drone import Control, Drone
from gcs.mission.resume import STREAM_LOST_MODES
from gcs.mission.script import Script
from gcs.mission.steps import (
    FOLLOW_STEPS,
    HOME_STEPS,
    LAND_HERE_STEPS,
    REGAIN_STEPS,
    RETURN_STEPS,
    STAND_DOWN_STEPS,
    Climb,
    FlyTo,
)
from gcs.ports import CampaignState

LAME_MPS = 5.0  # top speed of a drone with a failed motor


def take_back(drone: Drone, state: CampaignState, *, stopped: bool) -> None:
    """A cut link or a stall of this machine ended its stream: it is taken over again and goes on with what it did."""
    if drone.status is not None and drone.status.mode_name in STREAM_LOST_MODES:
        # each gap accounts for one change of mode, which may show only after it is heard again
        drone.gap_s, drone.excused_s = -math.inf, drone.status.reached_s or -math.inf
    drone.forget_orders()
    drone.park()
    if stopped:  # when a person takes the stop off
        drone.halted = True
        return
    after = {CampaignState.LAUNCHING: (Climb(), FlyTo(home=False)), CampaignState.RECOVERING: HOME_STEPS}
    going_home = HOME_STEPS if not drone.active and not drone.script.finished else ()
    drone.script = Script((*REGAIN_STEPS, *after.get(state, going_home)))
    drone.halted = drone.active


def send_home(drone: Drone) -> None:
    """Out of the slots and home in its own layer, under our control: one that does not obey yet is taken over first."""
    if drone.halted or drone.control is Control.STREAM:
        _regain_and_go_home(drone)
    else:
        drone.script = Script(HOME_STEPS)
    if drone.status is not None and not drone.status.motors_ok:
        slow_down(drone)


def slow_down(drone: Drone) -> bool:
    """A motor has failed: no faster from now on, on the way that it is flying as well. False: that is known already."""
    if drone.top_mps <= LAME_MPS:
        return False
    drone.top_mps = LAME_MPS
    if drone.goal is not None:
        drone.goal.speed_mps = min(drone.goal.speed_mps, LAME_MPS)
    return True


def let_go(drone: Drone, *, follow: bool) -> None:
    """Not ours any more; ``follow``: it comes down by itself, and that is waited for."""
    drone.control = Control.AUTOPILOT if follow else Control.RELEASED
    drone.script, drone.halted = Script(FOLLOW_STEPS if follow else ()), False
    drone.forget_orders()


def order_return(drone: Drone) -> None:
    """It could not be flown home by us: its autopilot is to do it."""
    drone.script = Script(RETURN_STEPS)
    drone.control, drone.active, drone.halted = Control.AUTOPILOT, False, False


def halt(drone: Drone, *, alone: bool) -> None:
    """The emergency stop; ``alone``: this drone only, the others go on."""
    flown_by_itself = drone.control is Control.AUTOPILOT and drone.is_airborne and not drone.landed
    drone.halted = drone.halted or drone.is_streamed or flown_by_itself
    if alone and not drone.stopped:
        drone.stopped, drone.rejoins, drone.active = True, drone.active, False


def after_stop(drone: Drone, state: CampaignState) -> None:
    """The stop is off: back into the slots, or down, for the landing that it interrupted is over."""
    if drone.rejoins and state in {CampaignState.FLYING, CampaignState.PAUSED}:
        drone.active = True
    drone.stopped = drone.rejoins = False
    if state is CampaignState.RECOVERING or not drone.active:
        bring_down(drone)
    elif drone.halted:
        drone.park()
        drone.script = Script(REGAIN_STEPS)


def bring_down(drone: Drone) -> None:
    """A drone that is ours, from where its launch or flight has got to."""
    drone.active = False
    if drone.control is Control.RELEASED or drone.landed or drone.script.follows:
        return
    drone.forget_orders()
    drone.park()
    if drone.halted or drone.control is Control.STREAM:
        _regain_and_go_home(drone)
    elif drone.control is Control.GUIDED:
        drone.script = Script(HOME_STEPS)
    elif drone.is_airborne:
        drone.script = Script(LAND_HERE_STEPS)
        drone.control = Control.AUTOPILOT
    elif drone.launch_ordered or (drone.status is not None and drone.status.armed):
        drone.script = Script(STAND_DOWN_STEPS)
    else:
        drone.script, drone.landed = Script(()), True


def _regain_and_go_home(drone: Drone) -> None:
    drone.forget_orders()
    drone.park()
    drone.script, drone.halted = Script((*REGAIN_STEPS, *HOME_STEPS)), False
    drone.control = Control.STREAM
