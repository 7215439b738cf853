"""The shape of a campaign document: keys, types and bounds. What needs geometry is checked in ``checks``."""

from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

Number = Annotated[float, Field(ge=-1e9, le=1e9, allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0.0, le=1e9, allow_inf_nan=False)]
Weight = Annotated[float, Field(ge=0.0, le=1e9, allow_inf_nan=False)]
Pair = Annotated[list[Number], Field(min_length=2, max_length=2)]


def _one_or_many_pairs(value: Any) -> Any:
    """[e, n] as [[e, n]], so that one launch point and one a UAV read alike."""
    is_single = isinstance(value, list) and not any(isinstance(part, list) for part in value)
    return [value] if is_single else value


def _one_or_many(value: Any) -> Any:
    return value if isinstance(value, list) else [value]


Rates = Annotated[list[Weight], BeforeValidator(_one_or_many), Field(min_length=1, max_length=10_000)]


class _Section(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid", frozen=True)


class CampaignSection(_Section):
    """[campaign]"""

    name: Annotated[str, Field(min_length=1, max_length=100)]
    slots: Annotated[int, Field(ge=1, le=10_000)]
    slot_s: Annotated[float, Field(ge=1.0, le=600.0)]


class ObstacleSection(_Section):
    """One entry of ``obstacles`` in [area]."""

    name: Annotated[str, Field(max_length=100)] = ""
    height_m: Annotated[float, Field(gt=0.0, le=1000.0)]
    polygon_m: Annotated[list[Pair], Field(min_length=3, max_length=100)]


class AreaSection(_Section):
    """[area]"""

    south_west: Pair
    size_m: Annotated[list[Annotated[float, Field(ge=10.0, le=20_000.0)]], Field(min_length=2, max_length=2)]
    obstacles: Annotated[list[ObstacleSection], Field(max_length=200)] = []


class FleetSection(_Section):
    """[fleet]; system ids 1 to 250 are free for vehicles in a MAVLink network."""

    uavs: Annotated[int, Field(ge=1, le=250)]
    altitude_m: Annotated[float, Field(ge=10.0, le=1000.0)] = 120.0
    max_speed_mps: Annotated[float, Field(gt=0.0, le=60.0)] = 18.0
    max_accel_mps2: Annotated[float, Field(ge=0.1, le=50.0)] | None = None
    launch_m: Annotated[list[Pair], BeforeValidator(_one_or_many_pairs), Field(min_length=1, max_length=250)]
    battery_mah: Annotated[float, Field(gt=0.0, le=1e6)] = 4500.0
    battery_v: Annotated[float, Field(gt=0.0, le=1000.0)] = 22.2
    layer_m: Annotated[float, Field(ge=0.0, le=100.0)] = 5.0


class UsersSection(_Section):
    """[users]"""

    source: Literal["trace", "walkers", "live"]
    trace: Annotated[str, Field(min_length=1, max_length=4096)] | None = None
    count: Annotated[int, Field(ge=1, le=10_000)] | None = None
    seed: Annotated[int, Field(ge=0, le=2**32 - 1)] | None = None
    preset: str | None = None
    collect_mbps: Rates = [0.02]


class RadioSection(_Section):
    """[radio]; what is left out is the paper's."""

    mcl_db: Annotated[float, Field(gt=0.0, le=300.0)] | None = None
    alpha_los_db: Number | None = None
    beta_los: Positive | None = None
    alpha_nlos_db: Number | None = None
    beta_nlos: Positive | None = None
    g_tx_db: Number | None = None
    g_rx_db: Number | None = None
    user_height_m: Positive | None = None
    device_height_m: Weight | None = None
    user_width_m: Weight | None = None
    blockers_per_m2: Weight | None = None


class ObjectiveSection(_Section):
    """[objective]; explicit weights override the preset's."""

    preset: Literal["fresh", "balanced"] = "fresh"
    gamma: Annotated[float, Field(ge=0.0, lt=1.0)] | None = None
    c_collect: Weight | None = None
    c_aoi: Weight | None = None
    c_cover: Weight | None = None
    c_energy: Weight | None = None
    penalty: Weight | None = None


class PolicySection(_Section):
    """[policy]"""

    name: str = "receding-horizon"
    checkpoint: Annotated[str, Field(min_length=1, max_length=4096)] | None = None


class MissionDocument(_Section):
    """A whole campaign file."""

    campaign: CampaignSection
    area: AreaSection
    fleet: FleetSection
    users: UsersSection
    radio: RadioSection = RadioSection()
    objective: ObjectiveSection = ObjectiveSection()
    policy: PolicySection = PolicySection()
