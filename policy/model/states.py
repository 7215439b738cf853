"""States in a batch, as networks see them: WorldState plus the users' last step, and the units of a campaign."""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from policy.world.arrays import BoolArray, FloatArray, IntArray
from policy.world.scenario import Scenario
from policy.world.state import WorldState

STEPS = 4
"""K: one minute of slots of 15 s."""
WALK_MPS = 1.3
"""Usual walking speed (Bohannon and Andrews, Physiotherapy 97(3), 2011: 1.2 to 1.4 m/s for adults)."""


@dataclass(frozen=True)
class Units:
    """What lengths, speeds and amounts are measured against, so that weights fit places never seen."""

    reach_m: float  # v tau: the farthest a UAV flies in a slot
    walk_m: float  # way of a walking user in a slot
    serving_radius_m: float
    max_speed_mps: float
    slot_s: float
    battery_j: float
    turn_slots: float  # share of a slot that a full reversal takes; 0 for the paper's motion
    slot_data_mb: FloatArray  # [M] collected in one slot

    @classmethod
    def of(cls, scenario: Scenario) -> "Units":
        """The units of a campaign."""
        return cls(
            reach_m=scenario.max_speed_mps * scenario.slot_s,
            walk_m=WALK_MPS * scenario.slot_s,
            serving_radius_m=scenario.serving_radius_m,
            max_speed_mps=scenario.max_speed_mps,
            slot_s=scenario.slot_s,
            battery_j=scenario.battery_j,
            turn_slots=2.0 * scenario.max_speed_mps / scenario.max_accel_mps2 / scenario.slot_s,
            slot_data_mb=np.asarray(scenario.collect_mbps, dtype=np.float64) * scenario.slot_s,
        )


@dataclass(frozen=True)
class StateBatch:
    """B states of one campaign. ``user_steps_m`` are the ways of the last K slots, the newest first.

    Phones that report every other slot seem to stand and jump in turn; several steps show who walks.
    """

    uav_pos_enu_m: FloatArray  # [B, U, 2]
    uav_vel_enu_mps: FloatArray  # [B, U, 2]
    uav_energy_j: FloatArray  # [B, U]
    uav_active: BoolArray  # [B, U]
    user_pos_enu_m: FloatArray  # [B, M, 2]
    user_steps_m: FloatArray  # [B, M, K, 2], zero where not known
    user_data_mb: FloatArray  # [B, M]
    user_aoi_slots: FloatArray  # [B, M]
    user_active: BoolArray  # [B, M]

    @property
    def size(self) -> int:
        """B."""
        return int(self.uav_pos_enu_m.shape[0])


def take(states: StateBatch, rows: IntArray | slice) -> StateBatch:
    """Rows of a batch, repeated as often as named; a slice copies nothing."""
    return StateBatch(**{f.name: getattr(states, f.name)[rows] for f in fields(StateBatch)})


def stack_states(states: Sequence[WorldState], user_steps_m: FloatArray) -> StateBatch:
    """Unbatched states with their users' last steps [B, M, K, 2] -> a batch."""
    return StateBatch(
        uav_pos_enu_m=np.stack([s.uav_pos_enu_m for s in states]),
        uav_vel_enu_mps=np.stack([s.uav_vel_enu_mps for s in states]),
        uav_energy_j=np.stack([s.uav_energy_j for s in states]),
        uav_active=np.stack([s.uav_active for s in states]),
        user_pos_enu_m=np.stack([s.user_pos_enu_m for s in states]),
        user_steps_m=np.asarray(user_steps_m, dtype=np.float64),
        user_data_mb=np.stack([s.user_data_mb for s in states]),
        user_aoi_slots=np.stack([s.user_aoi_slots for s in states]),
        user_active=np.stack([s.user_active for s in states]),
    )


def last_steps_m(pos_enu_m: FloatArray) -> FloatArray:
    """Places [T+1, M, 2] -> the last K steps before each sample [T+1, M, K, 2], newest first, zero before the first."""
    step_m = np.diff(pos_enu_m, axis=0, prepend=pos_enu_m[:1])
    return np.stack([_later(step_m, slots) for slots in range(STEPS)], axis=2)


def push_step(user_steps_m: FloatArray, step_m: FloatArray) -> FloatArray:
    """[..., M, K, 2] with ``step_m`` [..., M, 2] as the newest; the oldest is forgotten."""
    return np.concatenate((step_m[..., None, :], user_steps_m[..., :-1, :]), axis=-2)


def _later(step_m: FloatArray, slots: int) -> FloatArray:
    return np.concatenate((np.zeros_like(step_m[:slots]), step_m[: max(0, step_m.shape[0] - slots)]), axis=0)
