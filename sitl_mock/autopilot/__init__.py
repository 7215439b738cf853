"""The autopilot without any socket or clock: frames and the time come in, frames go out."""

from sitl_mock.autopilot.ardupilot import ARDUPILOT
from sitl_mock.autopilot.core import Autopilot, Outgoing
from sitl_mock.autopilot.px4 import PX4

FLAVOURS = {flavour.name: flavour for flavour in (PX4, ARDUPILOT)}

__all__ = ["ARDUPILOT", "FLAVOURS", "PX4", "Autopilot", "Outgoing"]
