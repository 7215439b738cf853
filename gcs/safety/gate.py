"""The last word: every setpoint of a fleet passes here, and links take nothing else.

The gate lets a setpoint through, slows or bends it, or holds. It remembers what each UAV was last told, because
until a new velocity is obeyed the last one still acts.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from gcs.ports import UavTrack, VelocitySetpoint
from gcs.safety.envelope import Envelope
from gcs.safety.rules import (
    Enu,
    Forecast,
    fence_hazard_m,
    forecast,
    is_far_from_bounds,
    is_finite,
    limit_altitude,
    limit_speed,
    obstacle_hazard_m,
    separation_hazard_m,
)
from policy.world.arrays import FloatArray

_BENDS = tuple(
    (math.radians(turn), share)
    for turn, share in (
        (0, 1.0), (20, 1.0), (-20, 1.0), (0, 0.7), (40, 1.0), (-40, 1.0), (20, 0.6), (-20, 0.6), (0, 0.4), (65, 0.8),
        (-65, 0.8), (40, 0.4), (-40, 0.4), (90, 0.6), (-90, 0.6), (0, 0.2), (90, 0.2), (-90, 0.2), (120, 0.3),
        (-120, 0.3), (180, 0.2),
    )
)  # fmt: skip
"""Turn (degrees) and share of the speed asked for, nearest to the wish first; full braking comes after them."""

_ESCAPES_MPS = tuple((2.0 * math.sin(a), 2.0 * math.cos(a)) for a in np.linspace(0.0, 2.0 * math.pi, 8, endpoint=False))
"""Slow ways out, for a UAV that a gust or a pilot has put where it may not be."""


class GateAction(StrEnum):
    """What the gate did."""

    PASSED = "passed"
    SLOWED = "slowed"  # speed or climb limited, direction kept
    BENT = "bent"  # direction changed
    HELD = "held"


_SEAL = object()


class SealedSetpoint:
    """A setpoint that passed. Nobody but :class:`SafetyGate` holds the seal that makes one (ports.SafeSetpoint)."""

    __slots__ = ("action", "reason", "setpoint")

    def __init__(self, seal: object, setpoint: VelocitySetpoint, action: GateAction, reason: str) -> None:
        if seal is not _SEAL:
            raise TypeError("only gcs.safety.gate.SafetyGate makes safe setpoints; pass yours through it")
        self.setpoint, self.action, self.reason = setpoint, action, reason

    @property
    def passed_gate(self) -> bool:
        """Always: there is no other way to come into being."""
        return True


@dataclass(frozen=True)
class Wish:
    """One UAV's setpoint before the gate, with what is known of the UAV; ``track`` None: nothing."""

    setpoint: VelocitySetpoint
    track: UavTrack | None


@dataclass(frozen=True)
class _Case:
    """A setpoint near a bound: as asked, and within the plain limits."""

    setpoint: VelocitySetpoint
    track: UavTrack
    asked: Enu
    vel: Enu


class SafetyGate:
    """Judges a fleet's setpoints tick by tick. The order of the wishes is the right of way."""

    def __init__(self, envelope: Envelope) -> None:
        self.envelope = envelope
        self._last: dict[int, Enu] = {}

    def judge(self, wishes: Sequence[Wish], others: Sequence[UavTrack] = ()) -> list[SealedSetpoint]:
        """Safe setpoints for ``wishes``; ``others`` are own UAVs in the air that we do not steer now."""
        tracks = [w.track for w in wishes if w.track is not None] + list(others)
        forecasts: dict[int, Forecast] = {}
        return [self._judge(wish, tracks, forecasts) for wish in wishes]

    def forget(self, system_id: int) -> None:
        """The UAV is no longer steered."""
        self._last.pop(system_id, None)

    def _judge(self, wish: Wish, tracks: Sequence[UavTrack], forecasts: dict[int, Forecast]) -> SealedSetpoint:
        setpoint, track = wish.setpoint, wish.track
        if not is_finite(setpoint):
            return self._hold(setpoint, track, "setpoint is not a number")
        if track is None or track.is_stale:
            return self._hold(setpoint, track, "position is too old to steer by")
        north, east, down = setpoint.vel_ned_mps
        asked: Enu = (east, north, -down)
        vel = limit_altitude(limit_speed(asked, self.envelope), track.alt_home_m, self.envelope)
        rivals = [t for t in tracks if t.system_id != track.system_id and self._may_meet(track, t)]
        if not rivals and is_far_from_bounds(track, self.envelope):
            action = GateAction.PASSED if vel == asked else GateAction.SLOWED
            return self._seal(setpoint, track, vel, action, "" if vel == asked else "speed or climb limit")
        return self._avoid(_Case(setpoint, track, asked, vel), rivals, forecasts)

    def _avoid(self, case: _Case, rivals: Sequence[UavTrack], forecasts: dict[int, Forecast]) -> SealedSetpoint:
        track, candidates, choice = case.track, _candidates(case.vel), 0
        hazards, late = self._hazards(track, candidates[:1], rivals, forecasts)
        cause = max(hazards, key=lambda name: float(np.max(hazards[name])))
        if np.max(hazards[cause]) > 0.0:  # only now the other ways are worth looking at
            hazards, late = self._hazards(track, candidates, rivals, forecasts)
            choice = _choose(np.max(np.stack(list(hazards.values())), axis=0))
        forecasts[track.system_id] = late.only(choice)
        if choice == 0:
            limited = case.vel != case.asked
            action = GateAction.SLOWED if limited else GateAction.PASSED
            return self._seal(case.setpoint, track, case.vel, action, "speed or climb limit" if limited else "")
        east, north, up = (float(v) for v in candidates[choice])
        return self._seal(case.setpoint, track, (east, north, up), _action(choice), cause)

    def _hazards(
        self, track: UavTrack, candidates: FloatArray, rivals: Sequence[UavTrack], forecasts: dict[int, Forecast]
    ) -> tuple[dict[str, FloatArray], Forecast]:
        """Depth beyond each bound [C, K]. A vehicle obeys at once or after the dead time: both must end well."""
        envelope = self.envelope
        last = self._last.get(track.system_id, _velocity(track))
        ways = [forecast(track, last, candidates, envelope, dead_s) for dead_s in (envelope.reaction_s, 0.0)]
        hazards = {
            "geofence": np.maximum(*(fence_hazard_m(way.path_m, envelope) for way in ways)),
            "obstacle": np.maximum(*(obstacle_hazard_m(way.path_m, envelope) for way in ways)),
        }
        for rival in rivals:
            other = self._rival_forecast(rival, forecasts)
            for way in ways:
                gap = separation_hazard_m(way, track.alt_home_m, other, rival.alt_home_m, envelope)
                hazards["separation"] = np.maximum(hazards.get("separation", gap), gap)
        return hazards, ways[0]

    def _rival_forecast(self, rival: UavTrack, forecasts: dict[int, Forecast]) -> Forecast:
        """What another UAV does: judged already, or braking after what it was last told."""
        if rival.system_id not in forecasts:
            last = self._last.get(rival.system_id, _velocity(rival))
            forecasts[rival.system_id] = forecast(
                rival, last, np.array([last]), self.envelope, self.envelope.reaction_s
            )
        return forecasts[rival.system_id]

    def _may_meet(self, track: UavTrack, other: UavTrack) -> bool:
        """Near enough in height and distance for a closer look."""
        closing_m = abs(track.vel_up_mps) + abs(other.vel_up_mps) + self.envelope.max_climb_mps
        if abs(track.alt_home_m - other.alt_home_m) > self.envelope.vertical_separation_m + closing_m:
            return False
        top_mps = self.envelope.max_speed_mps
        reach_m = 2.0 * (
            top_mps * (self.envelope.reaction_s + 0.1) + top_mps * top_mps / (2 * self.envelope.brake_mps2)
        )
        gap_m = math.hypot(track.east_m - other.east_m, track.north_m - other.north_m)
        return gap_m < reach_m + self.envelope.separation_m

    def _hold(self, setpoint: VelocitySetpoint, track: UavTrack | None, reason: str) -> SealedSetpoint:
        yaw_rad = setpoint.yaw_rad if math.isfinite(setpoint.yaw_rad) else 0.0
        yaw_rad = track.yaw_rad if track is not None else yaw_rad
        still = VelocitySetpoint(setpoint.system_id, (0.0, 0.0, 0.0), yaw_rad)
        self._last[setpoint.system_id] = (0.0, 0.0, 0.0)
        return SealedSetpoint(_SEAL, still, GateAction.HELD, reason)

    def _seal(
        self, setpoint: VelocitySetpoint, track: UavTrack, vel: Enu, action: GateAction, reason: str
    ) -> SealedSetpoint:
        self._last[track.system_id] = vel
        if action is GateAction.PASSED:
            return SealedSetpoint(_SEAL, setpoint, action, reason)
        safe = VelocitySetpoint(setpoint.system_id, (vel[1], vel[0], -vel[2]), setpoint.yaw_rad)
        return SealedSetpoint(_SEAL, safe, action, reason)


def _velocity(track: UavTrack) -> Enu:
    return (track.vel_east_mps, track.vel_north_mps, track.vel_up_mps)


def _candidates(vel: Enu) -> FloatArray:
    """The wish, its bends, full braking and the escapes: [C, 3]."""
    east, north, up = vel
    rows = [
        (
            share * (east * math.cos(turn) + north * math.sin(turn)),
            share * (north * math.cos(turn) - east * math.sin(turn)),
            up,
        )
        for turn, share in _BENDS
    ]
    rows.append((0.0, 0.0, 0.0))
    rows.extend((e, n, 0.0) for e, n in _ESCAPES_MPS)
    return np.array(rows)


def _choose(worst: FloatArray) -> int:
    """The first candidate without hazard; where none is, the one whose path lies least deep over its whole length."""
    clear = np.flatnonzero(np.max(worst, axis=1) <= 0.0)
    if clear.size:
        return int(clear[0])
    return int(np.argmin(np.sum(np.clip(worst, 0.0, None), axis=1)))


def _action(choice: int) -> GateAction:
    if choice >= len(_BENDS):
        return GateAction.HELD if choice == len(_BENDS) else GateAction.BENT
    return GateAction.SLOWED if _BENDS[choice][0] == 0.0 else GateAction.BENT
