"""JSON forms of scenario, state and decision: strict models, and the way there and back.

Arrays are lists in the order of the dataclasses' own fields and units; an infinite acceleration limit is null.
"""

import math
from collections.abc import Mapping
from dataclasses import asdict
from typing import Annotated, Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from policy.agents.base import Decision
from policy.mission_file.schema import Number, ObstacleSection, Pair, RadioSection, Weight
from policy.world.channel import Radio
from policy.world.scenario import Area, Objective, Obstacle, Scenario
from policy.world.state import JointAction, WorldState

MAX_UAVS = 250
MAX_USERS = 10_000

UavPairs = Annotated[list[Pair], Field(min_length=1, max_length=MAX_UAVS)]
UavNumbers = Annotated[list[Number], Field(min_length=1, max_length=MAX_UAVS)]
UserPairs = Annotated[list[Pair], Field(min_length=1, max_length=MAX_USERS)]
UserNumbers = Annotated[list[Number], Field(min_length=1, max_length=MAX_USERS)]


class _Wire(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid", frozen=True)


class ObjectiveWire(_Wire):
    """Weights; what is left out is the paper's."""

    gamma: Annotated[float, Field(ge=0.0, le=1.0)] | None = None
    c_collect: Weight | None = None
    c_aoi: Weight | None = None
    c_cover: Weight | None = None
    c_energy: Weight | None = None
    penalty: Weight | None = None


class ScenarioWire(_Wire):
    """The fixed part of a campaign, as in the mission file but with what follows from it worked out."""

    south_west_deg: Pair
    size_m: Annotated[list[Annotated[float, Field(ge=10.0, le=20_000.0)]], Field(min_length=2, max_length=2)]
    obstacles: Annotated[list[ObstacleSection], Field(max_length=200)] = []
    launch_enu_m: UavPairs
    collect_mbps: Annotated[list[Weight], Field(min_length=1, max_length=MAX_USERS)]
    slots: Annotated[int, Field(ge=1, le=10_000)]
    slot_s: Annotated[float, Field(ge=1.0, le=600.0)]
    altitude_m: Annotated[float, Field(ge=10.0, le=1000.0)]
    max_speed_mps: Annotated[float, Field(gt=0.0, le=60.0)]
    max_accel_mps2: Annotated[float, Field(ge=0.1, le=1000.0)] | None = None
    battery_j: Annotated[float, Field(gt=0.0, le=1e12)]
    radio: RadioSection = RadioSection()
    objective: ObjectiveWire = ObjectiveWire()
    obstacle_margin_m: Annotated[float, Field(ge=0.0, le=1000.0)] = 15.0
    layer_m: Annotated[float, Field(ge=0.0, le=100.0)] = 5.0


class StateWire(_Wire):
    """The beginning of a slot: places of UAVs and users now, never later ones."""

    slot: Annotated[int, Field(ge=0)]
    uav_pos_enu_m: UavPairs
    uav_vel_enu_mps: UavPairs
    uav_energy_j: UavNumbers
    uav_active: Annotated[list[bool], Field(min_length=1, max_length=MAX_UAVS)]
    user_pos_enu_m: UserPairs
    user_data_mb: UserNumbers
    user_aoi_slots: UserNumbers
    user_active: Annotated[list[bool], Field(min_length=1, max_length=MAX_USERS)]


class DecisionWire(BaseModel):
    """The answer for one slot, one entry a UAV; headings clockwise from north.

    ``end_*``: the velocity at which the slot is to be left, where that is not the same.
    """

    campaign_id: str
    slot: int
    policy: str
    heading_rad: list[float]
    heading_deg: list[float]
    speed_mps: list[float]
    end_heading_rad: list[float] | None = None
    end_speed_mps: list[float] | None = None
    value: float | None
    decision_ms: float
    explanation: dict[str, Any]


def scenario_document(scenario: Scenario) -> dict[str, Any]:
    """JSON-able form of a scenario."""
    accel = scenario.max_accel_mps2
    return {
        "south_west_deg": list(scenario.area.south_west_deg),
        "size_m": list(scenario.area.size_m),
        "obstacles": [
            {"name": o.name, "height_m": o.height_m, "polygon_m": [list(corner) for corner in o.polygon_m]}
            for o in scenario.area.obstacles
        ],
        "launch_enu_m": scenario.launch_enu_m.tolist(),
        "collect_mbps": scenario.collect_mbps.tolist(),
        "slots": scenario.slots,
        "slot_s": scenario.slot_s,
        "altitude_m": scenario.altitude_m,
        "max_speed_mps": scenario.max_speed_mps,
        "max_accel_mps2": None if math.isinf(accel) else accel,
        "battery_j": scenario.battery_j,
        "radio": asdict(scenario.radio),
        "objective": asdict(scenario.objective),
        "obstacle_margin_m": scenario.obstacle_margin_m,
        "layer_m": scenario.layer_m,
    }


def scenario_from(wire: ScenarioWire) -> Scenario:
    """The scenario itself; whether it can be flown is for ``mission_file.checks``."""
    (lat, lon), (width_m, depth_m) = wire.south_west_deg, wire.size_m
    obstacles = tuple(Obstacle(o.name, o.height_m, tuple((e, n) for e, n in o.polygon_m)) for o in wire.obstacles)
    return Scenario(
        area=Area((lat, lon), (width_m, depth_m), obstacles),
        launch_enu_m=np.asarray(wire.launch_enu_m, dtype=np.float64),
        collect_mbps=np.asarray(wire.collect_mbps, dtype=np.float64),
        slots=wire.slots,
        slot_s=wire.slot_s,
        altitude_m=wire.altitude_m,
        max_speed_mps=wire.max_speed_mps,
        max_accel_mps2=math.inf if wire.max_accel_mps2 is None else wire.max_accel_mps2,
        battery_j=wire.battery_j,
        radio=Radio(**wire.radio.model_dump(exclude_none=True)),
        objective=Objective(**wire.objective.model_dump(exclude_none=True)),
        obstacle_margin_m=wire.obstacle_margin_m,
        layer_m=wire.layer_m,
    )


def state_document(state: WorldState) -> dict[str, Any]:
    """JSON-able form of a state without batch dimensions."""
    arrays = {name: np.asarray(getattr(state, name)).tolist() for name in StateWire.model_fields if name != "slot"}
    return {"slot": int(state.slot), **arrays}


def state_from(wire: StateWire) -> WorldState:
    """The state itself; whether it fits its campaign is for ``validity.check_state``."""
    return WorldState(
        slot=wire.slot,
        uav_pos_enu_m=np.asarray(wire.uav_pos_enu_m, dtype=np.float64),
        uav_vel_enu_mps=np.asarray(wire.uav_vel_enu_mps, dtype=np.float64),
        uav_energy_j=np.asarray(wire.uav_energy_j, dtype=np.float64),
        uav_active=np.asarray(wire.uav_active, dtype=np.bool_),
        user_pos_enu_m=np.asarray(wire.user_pos_enu_m, dtype=np.float64),
        user_data_mb=np.asarray(wire.user_data_mb, dtype=np.float64),
        user_aoi_slots=np.asarray(wire.user_aoi_slots, dtype=np.float64),
        user_active=np.asarray(wire.user_active, dtype=np.bool_),
    )


def decision_document(
    campaign_id: str, slot: int, policy: str, decision: Decision, decision_ms: float
) -> dict[str, Any]:
    """JSON-able answer."""
    heading_rad = np.asarray(decision.action.heading_rad, dtype=np.float64)
    return {
        "campaign_id": campaign_id,
        "slot": slot,
        "policy": policy,
        "heading_rad": heading_rad.tolist(),
        "heading_deg": np.degrees(heading_rad).tolist(),
        "speed_mps": np.asarray(decision.action.speed_mps, dtype=np.float64).tolist(),
        "end_heading_rad": _numbers(decision.action.end_heading_rad),
        "end_speed_mps": _numbers(decision.action.end_speed_mps),
        "value": plain(decision.value),
        "decision_ms": decision_ms,
        "explanation": plain(decision.explanation),
    }


def decision_from(wire: DecisionWire) -> Decision:
    """The decision itself."""
    end = (None if row is None else np.asarray(row) for row in (wire.end_heading_rad, wire.end_speed_mps))
    action = JointAction(np.asarray(wire.heading_rad), np.asarray(wire.speed_mps), *end)
    return Decision(action, wire.value, wire.explanation)


def _numbers(values: Any) -> list[float] | None:
    return None if values is None else [float(value) for value in np.asarray(values)]


def plain(value: Any) -> Any:
    """Built-in types for JSON; a number that JSON cannot hold becomes null."""
    if isinstance(value, Mapping):
        return {str(key): plain(inner) for key, inner in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, list | tuple):
        return [plain(inner) for inner in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return value if value is None or isinstance(value, str | int) else str(value)
