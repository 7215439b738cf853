"""Reads campaign documents: TOML files, TOML text, JSON objects; all end in the same checks."""

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from policy.agents.registry import UnknownPolicyError, check_name
from policy.mission_file.checks import check_scenario, warnings_of
from policy.mission_file.complaints import complain, suggestion
from policy.mission_file.mission import Mission, MissionError, Source, UserSource
from policy.mission_file.presets import objective_of
from policy.mission_file.schema import AreaSection, FleetSection, MissionDocument, UsersSection
from policy.mission_file.shelf import find_mission
from policy.mobility.presets import WALKER_PRESETS
from policy.world.arrays import FloatArray
from policy.world.channel import Radio
from policy.world.energy import battery_energy_j
from policy.world.scenario import Area, Obstacle, Scenario

MAX_FILE_BYTES = 4_000_000
DEFAULT_WALKERS = 50
DEFAULT_LIVE_USERS = 100
SHIPPED_MODELS = Path(__file__).resolve().parents[1] / "checkpoints"


def load_mission(path_or_name: str | Path) -> Mission:
    """A file, or the name of a shipped mission such as ``purdue``. Raises :class:`MissionError`."""
    path = find_mission(path_or_name)
    try:
        with path.open("rb") as file:
            content = file.read(MAX_FILE_BYTES + 1)
        text = content.decode("utf-8")
    except UnicodeDecodeError as error:
        raise MissionError(f"{path}: is no UTF-8 text (byte {error.start}); save it as UTF-8") from error
    except OSError as error:
        raise MissionError(f"{path}: cannot be read: {error.strerror or error}") from error
    if len(content) > MAX_FILE_BYTES:
        raise MissionError(f"{path}: is larger than {MAX_FILE_BYTES} bytes; this is no mission file")
    return parse_mission_text(text, origin=str(path), directory=path.resolve().parent)


def parse_mission_text(text: str, *, origin: str = "mission", directory: Path | None = None) -> Mission:
    """TOML text. Raises :class:`MissionError`."""
    try:
        document = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise MissionError(f"{origin}: is no valid TOML: {error}") from error
    except (ValueError, RecursionError, OverflowError) as error:  # numbers and nesting beyond the parser's means
        raise MissionError(f"{origin}: is no valid TOML: a value is too large or too deep") from error
    return parse_mission(document, origin=origin, text=text, directory=directory)


def parse_mission(
    document: Mapping[str, Any],
    *,
    origin: str = "mission",
    text: str | None = None,
    directory: Path | None = None,
) -> Mission:
    """A document as nested mappings (parsed TOML or JSON); ``text`` lets errors name lines."""
    source = Source(origin, text)
    if not isinstance(document, Mapping):
        source.fail((), "a mission must be an object with sections such as campaign, area, fleet, users")
    try:
        checked = MissionDocument.model_validate(dict(document))
    except ValidationError as error:
        complain(error, source)
    users = _users(checked.users, source)
    scenario = _scenario(checked, users, source)
    check_scenario(scenario, source)
    _check_policy(checked.policy.name, source)
    return Mission(
        name=checked.campaign.name,
        scenario=scenario,
        users=users,
        policy=checked.policy.name,
        checkpoint=_checkpoint(checked.policy.checkpoint, directory, source),
        preset=checked.objective.preset,
        document=document,
        directory=directory,
        source=source,
        warnings=warnings_of(scenario),
    )


def _scenario(document: MissionDocument, users: UserSource, source: Source) -> Scenario:
    fleet = document.fleet
    return Scenario(
        area=_area(document.area),
        launch_enu_m=_launch_m(fleet, source),
        collect_mbps=_collect_mbps(document.users.collect_mbps, users, source),
        slots=document.campaign.slots,
        slot_s=document.campaign.slot_s,
        altitude_m=fleet.altitude_m,
        max_speed_mps=fleet.max_speed_mps,
        max_accel_mps2=float("inf") if fleet.max_accel_mps2 is None else fleet.max_accel_mps2,
        battery_j=battery_energy_j(fleet.battery_mah, fleet.battery_v),
        radio=Radio(**document.radio.model_dump(exclude_none=True)),
        objective=objective_of(document.objective),
        layer_m=fleet.layer_m,
    )


def _area(section: AreaSection) -> Area:
    obstacles = tuple(
        Obstacle(entry.name or f"obstacle {number}", entry.height_m, tuple((e, n) for e, n in entry.polygon_m))
        for number, entry in enumerate(section.obstacles, start=1)
    )
    (south, west), (width_m, depth_m) = section.south_west, section.size_m
    return Area(south_west_deg=(south, west), size_m=(width_m, depth_m), obstacles=obstacles)


def _launch_m(fleet: FleetSection, source: Source) -> FloatArray:
    """[U, 2]: one point for all, or one a UAV."""
    points = np.asarray(fleet.launch_m, dtype=np.float64)
    if len(points) not in (1, fleet.uavs):
        source.fail(
            ("fleet", "launch_m"),
            f"has {len(points)} points for {fleet.uavs} UAVs; give one for all, or one a UAV",
        )
    return np.array(np.broadcast_to(points, (fleet.uavs, 2)))


def _users(section: UsersSection, source: Source) -> UserSource:
    belongs = {"trace": {"trace"}, "walkers": {"count", "seed", "preset"}, "live": {"count"}}[section.source]
    for key in ("trace", "count", "seed", "preset"):
        if getattr(section, key) is not None and key not in belongs:
            source.fail(("users", key), f'has no meaning with source = "{section.source}"; remove it')
    if section.source == "trace":
        if section.trace is None:
            source.fail(("users", "trace"), 'key is missing; name the file, such as trace = "purdue_59.csv"')
        return UserSource(kind="trace", trace=section.trace)
    if section.source == "live":
        return UserSource(kind="live", live=section.count or DEFAULT_LIVE_USERS)
    _check_walkers_preset(section.preset, source)
    return UserSource(
        kind="walkers", walkers=section.count or DEFAULT_WALKERS, seed=section.seed or 0, preset=section.preset
    )


def _collect_mbps(rates: list[float], users: UserSource, source: Source) -> FloatArray:
    """[M] where the number of users is known, else as written (one value stands for all)."""
    count = users.walkers or users.live
    if count and len(rates) not in (1, count):
        source.fail(("users", "collect_mbps"), f"has {len(rates)} values for {count} users; give one, or one a user")
    return np.full(count, rates[0]) if count and len(rates) == 1 else np.asarray(rates, dtype=np.float64)


def _check_walkers_preset(preset: str | None, source: Source) -> None:
    if preset is not None and preset not in WALKER_PRESETS:
        source.fail(("users", "preset"), f'unknown preset "{preset}"' + suggestion(preset, sorted(WALKER_PRESETS)))


def _check_policy(name: str, source: Source) -> None:
    try:
        check_name(name)
    except UnknownPolicyError as error:
        source.fail(("policy", "name"), str(error))


def _checkpoint(name: str | None, directory: Path | None, source: Source) -> str | None:
    """Beside the mission file, as given, or a model that ships; a missing file is found out now, not in flight."""
    if name is None:
        return None
    beside = directory / name if directory is not None else Path(name)
    try:
        found = next((path for path in (beside, Path(name), SHIPPED_MODELS / name) if path.exists()), None)
    except (OSError, ValueError):
        found = None
    if found is None:
        source.fail(("policy", "checkpoint"), f'no file "{name}"; looked at {beside}')
    return str(found)
