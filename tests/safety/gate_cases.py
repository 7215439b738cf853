"""Random fleets, fences, obstacles, winds, lags and losses for the gate's long test; numpy arrays, seeded."""

import math
from dataclasses import dataclass

import numpy as np

from gcs.safety.envelope import Envelope
from policy.world.geometry import distance_to_polygon_m
from sitl_mock.physics.vehicle import ARDUQUAD, M600, VehicleType

UAVS = 4  # most of a case
WALLS = 4  # most obstacles of a case
CORNERS = 6
GAP_M = 50.0  # between obstacles, and between them and the fence: the gate keeps no map, so it knows no dead ends
PLACES_APART_M = 30.0  # starts and goals; the separation is 10 m
CLEAR_M = 8.0  # of starts and goals from fence and walls, beyond the margin


@dataclass(frozen=True)
class Flavour:
    """An airframe with the time that its autopilot goes on with a lost stream's last setpoint."""

    kind: VehicleType
    timeout_s: float


FLAVOURS = (Flavour(M600, 1.0), Flavour(ARDUQUAD, 3.0))  # PX4 COM_OF_LOSS_T, ArduPilot GUID_TIMEOUT


@dataclass
class Cases:
    """C cases of up to :data:`UAVS` vehicles; unused rows stand far away."""

    flavour: Flavour
    count: np.ndarray  # [C] UAVs
    bounds: np.ndarray  # [C, 17] rows of gcs.safety.bounds.Bounds
    edges: np.ndarray  # [C, WALLS * CORNERS, 4]
    starts: np.ndarray  # [C, WALLS + 1]
    walls: np.ndarray  # [C] obstacles
    place_m: np.ndarray  # [C, UAVS, 3] east, north, up at the start
    goal_m: np.ndarray  # [C, UAVS, 3]
    speed_mps: np.ndarray  # [C] of guidance
    wind_en_mps: np.ndarray  # [C, 2]
    command_ticks: np.ndarray  # [C] a setpoint's way up
    report_ticks: np.ndarray  # [C] a position's way down
    loss: np.ndarray  # [C] share of setpoints lost
    cut_s: np.ndarray  # [C, UAVS, 2] begin and end of a cut of both directions


def draw(rng: np.random.Generator, count: int, flavour: Flavour) -> Cases:
    """``count`` cases of one airframe."""
    places, goals, rows, edges, starts, walls, sizes = [], [], [], [], [], [], []
    while len(places) < count:
        size = rng.uniform(200.0, 700.0, 2)
        envelope = Envelope(
            size_m=(float(size[0]), float(size[1])),
            obstacles=_obstacles(rng, size),
            accel_mps2=flavour.kind.max_accel_mps2,
            brake_mps2=0.85 * flavour.kind.max_accel_mps2,
            setpoint_timeout_s=flavour.timeout_s,
        )
        uavs = int(rng.integers(1, UAVS + 1))
        spots = _spots(rng, envelope, uavs), _spots(rng, envelope, uavs)
        if spots[0] is None or spots[1] is None:
            continue
        layered = rng.random() < 0.4
        heights = np.array([100.0 + (5.0 * i if layered else 0.0) for i in range(UAVS)])
        places.append(np.column_stack([spots[0], heights]))
        goals.append(np.column_stack([spots[1], heights]))
        own_edges, own_starts = envelope.walls()
        padded = np.zeros((WALLS * CORNERS, 4))
        padded[: len(own_edges)] = own_edges
        edges.append(padded)
        starts.append(np.pad(own_starts, (0, WALLS + 1 - len(own_starts)), mode="edge"))
        walls.append(len(own_starts) - 1)
        rows.append(np.array(envelope.bounds()))
        sizes.append(uavs)
    angle, wind = rng.uniform(0.0, 2.0 * math.pi, count), rng.uniform(0.0, 10.0, count)
    begin_s = rng.uniform(0.0, 40.0, (count, UAVS))
    cut_s = np.where(rng.random((count, UAVS)) < 0.4, rng.uniform(0.3, 5.0, (count, UAVS)), 0.0)
    return Cases(
        flavour=flavour,
        count=np.array(sizes),
        bounds=np.array(rows),
        edges=np.array(edges),
        starts=np.array(starts),
        walls=np.array(walls),
        place_m=np.array(places),
        goal_m=np.array(goals),
        speed_mps=rng.uniform(8.0, 18.0, count),
        wind_en_mps=np.column_stack([wind * np.sin(angle), wind * np.cos(angle)]),
        command_ticks=rng.integers(0, 3, count),
        report_ticks=rng.integers(0, 4, count),
        loss=np.where(rng.random(count) < 0.5, 0.0, rng.uniform(0.0, 0.5, count)),
        cut_s=np.stack([begin_s, begin_s + cut_s], axis=-1),
    )


def _obstacles(rng: np.random.Generator, size: np.ndarray) -> tuple[tuple[tuple[float, float], ...], ...]:
    """Convex, with room to go round each."""
    placed: list[tuple[np.ndarray, float]] = []
    polygons = []
    for _ in range(int(rng.integers(0, WALLS + 1))):
        radius = rng.uniform(8.0, 40.0)
        room = size - 2.0 * (radius + GAP_M)
        if np.any(room <= 0.0):
            continue
        centre = radius + GAP_M + rng.uniform(0.0, 1.0, 2) * room
        if any(np.hypot(*(centre - other)) < radius + reach + GAP_M for other, reach in placed):
            continue
        placed.append((centre, radius))
        corners = int(rng.integers(3, CORNERS + 1))
        angles = 2.0 * math.pi * (np.arange(corners) + rng.uniform(-0.3, 0.3, corners)) / corners
        turned = angles + rng.uniform(0.0, 2.0 * math.pi)
        polygons.append(tuple((centre[0] + radius * math.cos(a), centre[1] + radius * math.sin(a)) for a in turned))
    return tuple(polygons)


def _spots(rng: np.random.Generator, envelope: Envelope, uavs: int) -> np.ndarray | None:
    """[UAVS, 2] clear places; rows beyond ``uavs`` are in the middle of nowhere."""
    spots = np.full((UAVS, 2), -1e4) - 1e3 * np.arange(UAVS)[:, None]
    low = envelope.fence_margin_m + CLEAR_M
    for i in range(uavs):
        for _ in range(60):
            spot = low + rng.uniform(0.0, 1.0, 2) * (np.array(envelope.size_m) - 2.0 * low)
            clear = envelope.obstacle_margin_m + CLEAR_M
            if any(float(distance_to_polygon_m(spot, p)) < clear for p in envelope.obstacles):
                continue
            if all(np.hypot(*(spot - spots[j])) > PLACES_APART_M for j in range(i)):
                spots[i] = spot
                break
        else:
            return None
    return spots
