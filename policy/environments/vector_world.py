"""Many campaigns at once, in step, on torch tensors: policy.world's own transition and reward, batched."""

from dataclasses import dataclass

import torch
from torch import Tensor

from policy.world.actions import ActionSet, paper_actions
from policy.world.airspace import inside_area, legal_moves
from policy.world.freshness import INITIAL_AOI_SLOTS
from policy.world.reward import reward
from policy.world.scenario import Scenario
from policy.world.state import JointAction, WorldState
from policy.world.transition import Outcome, step


@dataclass(frozen=True)
class Campaigns:
    """B campaigns of one scenario that differ in launch points, crowd and who takes part."""

    scenario: Scenario
    launch_enu_m: Tensor  # [B, U, 2]
    crowds_enu_m: Tensor  # [C, T+1, M, 2]
    crowd: Tensor  # int [B]: which crowd each campaign has
    user_active: Tensor  # bool [B, M]

    @property
    def size(self) -> int:
        """B."""
        return int(self.launch_enu_m.shape[0])


class VectorWorld:
    """B campaigns in flight. ``state`` has a leading batch axis everywhere but in ``slot``."""

    def __init__(self, campaigns: Campaigns) -> None:
        self._campaigns = campaigns
        self.scenario = campaigns.scenario
        self._actions = action_tensors(self.scenario, campaigns.launch_enu_m)
        self.state = _initial_state(campaigns)
        self.outcome: Outcome | None = None

    @property
    def done(self) -> bool:
        """Whether all slots are flown."""
        return self.state.slot >= self.scenario.slots

    def legal(self) -> Tensor:
        """Which of the nine actions each UAV may take: bool [B, U, 9]; hovering where none is."""
        return legal_actions(self.scenario, self.state)

    def step(self, actions: Tensor) -> Tensor:
        """Fly ``actions`` [B, U] (indices into the nine): rewards of Eq. 8 [B]."""
        heading_rad, speed_mps = self._actions
        joint = JointAction(heading_rad[actions], speed_mps[actions])
        before = self.state
        self.state, self.outcome = step(self.scenario, before, joint, self._places(before.slot + 1))
        earned: Tensor = reward(self.scenario, before, self.state, self.outcome)
        return earned

    def mean_aoi(self) -> Tensor:
        """Mean AoI of those who take part [B]."""
        active = self.state.user_active.to(self.state.user_aoi_slots.dtype)
        fresh: Tensor = (self.state.user_aoi_slots * active).sum(-1) / active.sum(-1).clamp(min=1.0)
        return fresh

    def _places(self, sample: int) -> Tensor:
        return self._campaigns.crowds_enu_m[self._campaigns.crowd, sample]


def action_tensors(scenario: Scenario, like: Tensor) -> tuple[Tensor, Tensor]:
    """Headings [9] and speeds [9] of the paper's actions in the type and on the device of ``like``."""
    actions: ActionSet = paper_actions(scenario.max_speed_mps)
    heading, speed = (
        torch.as_tensor(values, dtype=like.dtype, device=like.device)
        for values in (actions.heading_rad, actions.speed_mps)
    )
    return heading, speed


def legal_actions(scenario: Scenario, state: WorldState) -> Tensor:
    """Legal moves among the nine: bool [..., U, 9]; where none is legal, hovering (index 0) is let through."""
    place: Tensor = state.uav_pos_enu_m
    heading_rad, speed_mps = action_tensors(scenario, place)
    velocity = JointAction(heading_rad, speed_mps).vel_enu_mps
    if scenario.max_accel_mps2 == float("inf") and not scenario.blocking_obstacles:
        # The paper's motion in an empty rectangle: a straight way stays inside when its end does.
        legal: Tensor = inside_area(place[..., None, :] + velocity * scenario.slot_s, scenario)
    else:
        legal = legal_moves(place[..., None, :], state.uav_vel_enu_mps[..., None, :], velocity, scenario)
    nowhere = ~legal.any(-1)
    legal = legal.clone()
    legal[..., 0] |= nowhere
    return legal


def _initial_state(campaigns: Campaigns) -> WorldState:
    launch = campaigns.launch_enu_m
    batch, uavs = launch.shape[:2]
    users = int(campaigns.crowds_enu_m.shape[2])
    zeros = torch.zeros((batch, users), dtype=launch.dtype, device=launch.device)
    return WorldState(
        slot=0,
        uav_pos_enu_m=launch,
        uav_vel_enu_mps=torch.zeros_like(launch),
        uav_energy_j=torch.full_like(launch[..., 0], campaigns.scenario.battery_j),
        uav_active=torch.ones((batch, uavs), dtype=torch.bool, device=launch.device),
        user_pos_enu_m=campaigns.crowds_enu_m[campaigns.crowd, 0],
        user_data_mb=zeros,
        user_aoi_slots=zeros + INITIAL_AOI_SLOTS,
        user_active=campaigns.user_active,
    )
