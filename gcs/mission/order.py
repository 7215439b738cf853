"""What a campaign needs to be flown, and the constants of flying it."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from gcs.guidance.tracking import DEFAULT_GAINS, Gains
from gcs.ports import Planner, UserPlaces, VehicleLimits
from policy.world.scenario import Scenario

DEFAULT_TIMEOUT_S = 3.0  # ArduPilot's GUID_TIMEOUT, the longer of the two, where the vehicle does not say
DEFAULT_ACCEL_MPS2 = 4.5  # a multirotor at 25 degrees of lean, g tan(25 deg), where the vehicle does not say


@dataclass(frozen=True)
class FlightSettings:
    """Times and shares of a campaign's flight; the operator's guide explains each."""

    gains: Gains = DEFAULT_GAINS
    plan_accel_share: float = 0.92  # of the vehicle's limit: room for its lag and for wind (docs/operations.md)
    plan_grace_s: float = 1.0  # a decision later than this leaves the fleet holding
    plan_wait_s: float = 120.0  # on the wall, for a simulated clock that stands still meanwhile
    ready_timeout_s: float = 120.0
    prime_s: float = 1.5  # PX4 wants setpoints for more than 1 s before OFFBOARD
    launch_gap_m: float = 30.0  # the next drone takes off when the last one is this high
    transit_speed_mps: float = 10.0
    arrival_m: float = 10.0
    landing_handover_m: float = 10.0  # below this the autopilot's own landing flies
    battery_reserve: float = 0.03  # left when a drone sent home now has landed


@dataclass(frozen=True)
class CampaignOrder:
    """One campaign to fly: ``scenario`` as written, ``system_ids`` [U] in the order of its UAVs."""

    campaign_id: str
    name: str
    policy: str
    scenario: Scenario
    user_ids: tuple[str, ...]
    places: UserPlaces
    planner: Planner
    system_ids: tuple[int, ...]
    seed: int = 0
    settings: FlightSettings = field(default_factory=FlightSettings)
    provenance: Mapping[str, str] = field(default_factory=dict)  # where the policy comes from, for the log

    def __post_init__(self) -> None:
        if len(self.system_ids) != self.scenario.num_uavs or len(set(self.system_ids)) != len(self.system_ids):
            raise ValueError(f"{self.scenario.num_uavs} UAVs need as many different system ids, not {self.system_ids}")


@dataclass(frozen=True)
class FleetLimits:
    """The slowest vehicle's limits: what a joint plan may count on."""

    max_speed_mps: float
    max_accel_mps2: float
    setpoint_timeout_s: float = DEFAULT_TIMEOUT_S  # the longest: a vehicle goes on with its last setpoint so long


def fleet_limits(scenario: Scenario, limits: list[VehicleLimits]) -> FleetLimits:
    """Mission and vehicles, whichever is less; unknown accelerations count as :data:`DEFAULT_ACCEL_MPS2`."""
    speeds = [limit.max_speed_mps for limit in limits if limit.max_speed_mps is not None]
    accels = [limit.max_accel_mps2 or DEFAULT_ACCEL_MPS2 for limit in limits]
    return FleetLimits(
        max_speed_mps=min([scenario.max_speed_mps, *speeds]),
        max_accel_mps2=min([scenario.max_accel_mps2, *(accels or [DEFAULT_ACCEL_MPS2])]),
        setpoint_timeout_s=max(
            (limit.setpoint_timeout_s or DEFAULT_TIMEOUT_S for limit in limits), default=DEFAULT_TIMEOUT_S
        ),
    )


def planning_scenario(scenario: Scenario, limits: FleetLimits, settings: FlightSettings) -> Scenario:
    """The campaign as these vehicles can fly it: what the planner is told."""
    limited = replace(scenario, max_speed_mps=limits.max_speed_mps)
    return limited.with_accel(settings.plan_accel_share * limits.max_accel_mps2)
