"""What the gate holds a fleet to."""

from dataclasses import dataclass, field

import numpy as np

from gcs.safety.bounds import Bounds
from policy.world.arrays import FloatArray, IntArray
from policy.world.geometry import Polygon
from policy.world.scenario import Scenario

FENCE_MARGIN_M = 3.0  # kept inside the area's edge: GNSS noise and gusts
OBSTACLE_MARGIN_SHARE = 0.5  # of the planner's margin: the plan keeps clear, the gate catches what does not
ALTITUDE_ABOVE_M = 5.0  # over the highest layer
LOWEST_GUIDED_M = 8.0  # below this only the autopilot's own landing flies
VERTICAL_SEPARATION_M = 4.0  # layers are 5 m apart, a drone holds its height to a metre
LAYER_SHARE = 0.8  # of layers that are nearer to each other than that
NO_LAYERS_M = 1.0  # as well as a height is held: nearer than that they are one height, and kept apart as such
LAG_S = 0.25  # a vehicle that is still gaining speed at the time-out turns its acceleration round only so fast (jerk)
BRAKE_SHARE = 0.85  # of the acceleration limit counted on for braking: lag, drag and wind take the rest


@dataclass(frozen=True)
class Envelope:
    """Limits of one campaign; polygons are the obstacles' walls, margins come on top."""

    size_m: tuple[float, float]
    obstacles: tuple[Polygon, ...] = ()
    fence_margin_m: float = FENCE_MARGIN_M
    obstacle_margin_m: float = 7.5
    min_alt_home_m: float = LOWEST_GUIDED_M
    max_alt_home_m: float = 125.0
    max_speed_mps: float = 18.0
    max_climb_mps: float = 3.0
    max_descent_mps: float = 3.0
    accel_mps2: float = 4.5  # how fast the vehicle takes up a new velocity
    brake_mps2: float = 4.5 * BRAKE_SHARE
    vertical_accel_mps2: float = 1.0
    reaction_s: float = 0.5  # from our decision to the vehicle's obeying: link, tick and attitude lag
    tick_s: float = 0.1
    setpoint_timeout_s: float = 1.0  # how long the autopilot goes on with its last setpoint when no more arrive
    separation_m: float = 10.0  # level distance between own UAVs of about one height
    vertical_separation_m: float = VERTICAL_SEPARATION_M
    obstacle_names: tuple[str, ...] = field(default=())

    def bounds(self) -> Bounds:
        """The numbers, as the compiled rules read them."""
        return Bounds(
            width_m=float(self.size_m[0]),
            height_m=float(self.size_m[1]),
            fence_margin_m=self.fence_margin_m,
            obstacle_margin_m=self.obstacle_margin_m,
            min_alt_m=self.min_alt_home_m,
            max_alt_m=self.max_alt_home_m,
            max_speed_mps=self.max_speed_mps,
            max_climb_mps=self.max_climb_mps,
            max_descent_mps=self.max_descent_mps,
            accel_mps2=self.accel_mps2,
            brake_mps2=self.brake_mps2,
            vertical_accel_mps2=self.vertical_accel_mps2,
            reaction_s=self.reaction_s,
            tick_s=self.tick_s,
            timeout_s=self.setpoint_timeout_s + LAG_S,
            separation_m=self.separation_m,
            vertical_separation_m=self.vertical_separation_m,
        )

    def walls(self) -> tuple[FloatArray, IntArray]:
        """The obstacles' edges [E, 4] from corner to corner, and where each obstacle's begin [P + 1]."""
        edges = [(*p[i], *p[(i + 1) % len(p)]) for p in self.obstacles for i in range(len(p))]
        starts = np.cumsum([0, *(len(polygon) for polygon in self.obstacles)])
        return np.array(edges, dtype=np.float64).reshape(-1, 4), starts.astype(np.int64)


def envelope_of(scenario: Scenario, max_accel_mps2: float, setpoint_timeout_s: float = 1.0) -> Envelope:
    """The gate's limits for a campaign flown by vehicles of this acceleration and setpoint time-out."""
    blocking = scenario.blocking_obstacles
    return Envelope(
        size_m=scenario.area.size_m,
        obstacles=tuple(o.polygon_m for o in blocking),
        obstacle_names=tuple(o.name for o in blocking),
        obstacle_margin_m=OBSTACLE_MARGIN_SHARE * scenario.obstacle_margin_m,
        max_alt_home_m=scenario.altitude_m + ALTITUDE_ABOVE_M,
        max_speed_mps=scenario.max_speed_mps,
        accel_mps2=max_accel_mps2,
        brake_mps2=BRAKE_SHARE * max_accel_mps2,
        setpoint_timeout_s=setpoint_timeout_s,
        vertical_separation_m=_vertical_separation_m(scenario.layer_m),
    )


def _vertical_separation_m(layer_m: float) -> float:
    return VERTICAL_SEPARATION_M if layer_m < NO_LAYERS_M else min(VERTICAL_SEPARATION_M, LAYER_SHARE * layer_m)
