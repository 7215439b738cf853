"""What one autopilot feels and moves: its row of the fleet's physics, its pad, its sensors and its battery."""

from __future__ import annotations

from math import isnan, nan, pi, radians
from typing import TYPE_CHECKING

from sitl_mock.battery import Battery, Pack
from sitl_mock.geodesy import Geodetic, to_geodetic
from sitl_mock.physics import layout
from sitl_mock.physics.fleet import STEP_S
from sitl_mock.sensors import Position, Receiver

if TYPE_CHECKING:
    import numpy as np

    from sitl_mock.faults import Effects
    from sitl_mock.physics.fleet import Fleet
    from sitl_mock.physics.vehicle import VehicleType

Vec3 = tuple[float, float, float]
# With one motor of six out its opposite idles too: what is left carries the weight and half of the lean (assumed).
_THRUST_LEFT = (1.0, 0.5)  # by motors out; more and it falls


class Body:
    """Vehicle `index` of a fleet. Positions are metres NED from its pad, as the autopilot believes them."""

    def __init__(
        self,
        fleet: Fleet,
        index: int,
        pad: Geodetic,
        rng: np.random.Generator,
        *,
        receiver: Receiver | None = None,
        ambient_c: float = 20.0,
    ) -> None:
        """`pad`: where the vehicle stands at boot; `rng`: the noise of its sensors."""
        self._fleet, self.index, self.pad = fleet, index, pad
        self._column = fleet.column(index)
        self._command = fleet.command[index]
        self._pack = Pack(fleet.types[index], ambient_c)
        self.position = Position(receiver or Receiver(), rng)
        self._compass_error_rad = 0.0
        self._motors_out = 0

    def suffer(self, effects: Effects) -> None:
        """Sets what is broken in it."""
        self.position.offset_m = effects.gps_offset_m
        self.position.extra_noise_m = effects.gps_noise_m
        self._compass_error_rad = radians(effects.compass_error_deg)
        self._motors_out = effects.motors_out
        self._pack.failed_cells = effects.cells_failed

    def advance(self, now_s: float) -> None:
        """A step of STEP_S begins: sensors and battery go on."""
        self.position.advance(now_s, STEP_S, self.true_ned_m, self.vel_ned_mps)
        self._pack.advance(float(self._column[layout.POWER_W]), STEP_S)

    @property
    def kind(self) -> VehicleType:
        """Present limits."""
        return self._fleet.types[self.index]

    def set_limits(self, kind: VehicleType) -> None:
        """Changes the limits, e.g. after a parameter was set."""
        self._fleet.set_limits(self.index, kind)

    @property
    def true_ned_m(self) -> Vec3:
        """Where it is."""
        north, east, down = self._column[layout.POS : layout.POS + 3].tolist()
        return north, east, down

    @property
    def pos_ned_m(self) -> Vec3:
        """Where it believes to be."""
        (north, east, down), error = self.true_ned_m, self.position.error_ned_m
        return north + error[0], east + error[1], down + error[2]

    @property
    def vel_ned_mps(self) -> Vec3:
        """Velocity over ground."""
        north, east, down = self._column[layout.VEL : layout.VEL + 3].tolist()
        return north, east, down

    @property
    def down_m(self) -> float:
        """Height below the pad (negative in the air), as it believes."""
        return float(self._column[layout.POS + 2]) + self.position.error_ned_m[2]

    @property
    def attitude_rad(self) -> Vec3:
        """Roll, pitch, yaw, as it believes."""
        roll, pitch, _ = self._fleet.attitude_rad(self.index)
        return roll, pitch, self.yaw_rad

    @property
    def compass_error_rad(self) -> float:
        """How far the compass is off."""
        return self._compass_error_rad

    @property
    def yaw_rad(self) -> float:
        """Where the compass says that the nose points, clockwise from north."""
        return (float(self._column[layout.YAW]) + self._compass_error_rad) % (2 * pi)

    @property
    def on_ground(self) -> bool:
        """Whether the ground carries it."""
        return float(self._column[layout.POS + 2]) >= -0.01 and float(self._column[layout.VEL_WISH + 2]) >= 0.0

    @property
    def place(self) -> Geodetic:
        """Where it believes to be on the globe."""
        north, east, down = self.pos_ned_m
        return to_geodetic(self.pad, north, east, -down)

    @property
    def battery(self) -> Battery:
        """What the power module measures."""
        return self._pack.measure(float(self._column[layout.USED_J]), float(self._column[layout.POWER_W]))

    @property
    def motors_out(self) -> int:
        """How many motors stand still that should not."""
        return self._motors_out

    def drain(self, fraction: float) -> None:
        """Takes this part of the full battery away at once."""
        self._pack.drain(fraction)

    def drive(self, vel_ned_mps: Vec3, yaw_rad: float | None, *, motors: bool) -> None:
        """Sets what the physics follows until the next call; `yaw_rad` None keeps the nose where it is."""
        command = self._command
        command[0], command[1], command[2] = vel_ned_mps
        held = yaw_rad is None or isnan(yaw_rad)
        command[layout.CMD_YAW] = nan if held or yaw_rad is None else yaw_rad - self._compass_error_rad
        thrust = _THRUST_LEFT[self._motors_out] if self._motors_out < len(_THRUST_LEFT) else 0.0
        command[layout.CMD_MOTORS] = thrust if motors else 0.0
