"""The last word: every setpoint of a fleet passes here, and links take nothing else.

The gate lets a setpoint through, slows or bends it, or holds. It remembers what each UAV was told of late, because
until a new velocity is obeyed any of those on their way may still act, and round which side of an obstacle each is
going.
"""

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cache
from itertools import islice

import numpy as np

from gcs.ports import STALE_AFTER_S, UavTrack, VelocitySetpoint
from gcs.safety import judge as rules
from gcs.safety.acting import acting_climbs, still_acting
from gcs.safety.envelope import Envelope
from policy.world.arrays import FloatArray, IntArray

Enu = tuple[float, float, float]
"""Velocity east, north, up."""

_CAUSES = ("", "speed or climb limit", "geofence", "obstacle", "separation")


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

    def at_rest(self, reason: str) -> "SealedSetpoint":
        """The same vehicle told to stop: what braking the gate let it have is always left."""
        stop = VelocitySetpoint(self.setpoint.system_id, (0.0, 0.0, 0.0), self.setpoint.yaw_rad)
        return SealedSetpoint(_SEAL, stop, GateAction.HELD, reason)


@dataclass(frozen=True)
class Wish:
    """One UAV's setpoint before the gate, with what is known of the UAV; ``track`` None: nothing."""

    setpoint: VelocitySetpoint
    track: UavTrack | None


class SafetyGate:
    """Judges a fleet's setpoints tick by tick. The order of the wishes is the right of way."""

    def __init__(self, envelope: Envelope) -> None:
        self.envelope = envelope
        self._bounds = envelope.bounds()
        self._edges, self._starts = envelope.walls()
        self._sent: dict[int, deque[Enu]] = {}  # newest first
        self._most_ticks = math.ceil((envelope.reaction_s + STALE_AFTER_S) / envelope.tick_s)
        self._sides: dict[int, tuple[float, float]] = {}
        compile_rules()

    def judge(self, wishes: Sequence[Wish], others: Sequence[UavTrack] = ()) -> list[SealedSetpoint]:
        """Safe setpoints for ``wishes``; ``others`` are own UAVs in the air that we do not steer now."""
        held = [_why_held(wish) for wish in wishes]
        sealed = {
            i: self._hold(wish, reason) for i, (wish, reason) in enumerate(zip(wishes, held, strict=True)) if reason
        }
        steered = [(i, w, w.track) for i, w in enumerate(wishes) if not held[i] and w.track is not None]
        blind = [w.track for w, reason in zip(wishes, held, strict=True) if reason and w.track is not None]
        for track in others:  # what it does by itself takes the place of what we told it, tick by tick
            if track.system_id in self._sent:
                self._sent[track.system_id].appendleft(_velocity(track))
        tracks = [track for _, _, track in steered] + blind + list(others)
        if steered:
            self._judge([(i, w) for i, w, _ in steered], tracks, sealed)
        return [sealed[i] for i in range(len(wishes))]

    def forget(self, system_id: int) -> None:
        """The UAV is no longer steered."""
        self._sent.pop(system_id, None)
        self._sides.pop(system_id, None)

    def _judge(
        self, steered: list[tuple[int, Wish]], tracks: list[UavTrack], sealed: dict[int, SealedSetpoint]
    ) -> None:
        asked = np.array([_enu(wish.setpoint) for _, wish in steered])
        places = np.array([_place(track) for track in tracks])
        told, tolds, climbs = self._still_acting(tracks)
        sides = np.array([self._sides.get(track.system_id, (0.0, 0.0)) for track in tracks])
        safe, choices, causes = rules.judge_fleet(
            places, told, tolds, climbs, asked, sides, self._bounds, self._edges, self._starts
        )
        for row, (i, wish) in enumerate(steered):
            system_id = wish.setpoint.system_id
            east, north, up = safe[row].tolist()
            if system_id not in self._sent:
                self._sent[system_id] = deque(maxlen=self._most_ticks)
            self._sent[system_id].appendleft((east, north, up))
            self._sides[system_id] = (float(sides[row, 0]), float(sides[row, 1]))
            action, cause = _action(int(choices[row]), int(causes[row])), _CAUSES[causes[row]]
            setpoint = wish.setpoint
            if action is not GateAction.PASSED:
                setpoint = VelocitySetpoint(system_id, (north, east, -up), wish.setpoint.yaw_rad)
            sealed[i] = SealedSetpoint(_SEAL, setpoint, action, cause)

    def _still_acting(self, tracks: Sequence[UavTrack]) -> tuple[FloatArray, IntArray, FloatArray]:
        """What each vehicle may be obeying: all that it was sent since a reaction time before it was seen last."""
        told, tolds = _zeros(len(tracks), rules.TOLD_MOST, 3), np.ones(len(tracks), np.int64)
        climbs = _zeros(len(tracks), 2)
        for row, track in enumerate(tracks):
            sent = self._sent.get(track.system_id)
            if sent is None:
                told[row, 0], climbs[row] = _velocity(track), track.vel_up_mps
            else:
                unseen_s = min(track.age_s, STALE_AFTER_S)  # infinite where a place is not to be trusted
                ticks = math.ceil((self.envelope.reaction_s + unseen_s) / self.envelope.tick_s)
                acting = np.array(list(islice(sent, ticks)))
                tolds[row] = still_acting(acting, told[row])
                acting_climbs(acting, climbs[row])
        return told, tolds, climbs

    def _hold(self, wish: Wish, reason: str) -> SealedSetpoint:
        system_id, track = wish.setpoint.system_id, wish.track
        yaw_rad = wish.setpoint.yaw_rad if math.isfinite(wish.setpoint.yaw_rad) else 0.0
        yaw_rad = track.yaw_rad if track is not None else yaw_rad
        # What it was told before stays remembered: a blind vehicle may not hear this hold either, and braking is one
        # of the ways that the others keep clear of anyway.
        if system_id not in self._sent:
            self._sent[system_id] = deque([(0.0, 0.0, 0.0)], maxlen=self._most_ticks)
        return SealedSetpoint(_SEAL, VelocitySetpoint(system_id, (0.0, 0.0, 0.0), yaw_rad), GateAction.HELD, reason)


@cache
def compile_rules() -> None:
    """Compile (or load) the rules once, before anything flies: the first call of compiled code takes seconds."""
    envelope = Envelope(size_m=(100.0, 100.0))
    edges, starts = envelope.walls()
    at = np.array([[50.0, 50.0, 50.0, 0.0, 0.0, 0.0]])
    told, tolds = np.zeros((1, rules.TOLD_MOST, 3)), np.ones(1, np.int64)
    tolds[0] = still_acting(at[:, 3:].copy(), told[0])
    climbs = np.zeros((1, 2))
    acting_climbs(at[:, 3:].copy(), climbs[0])
    wish, sides = at[:, 3:].copy(), np.zeros((1, 2))
    rules.judge_fleet(at, told, tolds, climbs, wish, sides, envelope.bounds(), edges, starts)


def _zeros(*shape: int) -> FloatArray:
    """As ``np.zeros``, which lets go of the interpreter for more than a kilobyte, and others would take it."""
    return np.frombuffer(bytearray(8 * math.prod(shape))).reshape(shape)


def _why_held(wish: Wish) -> str:
    """Why a wish cannot be judged, empty where it can."""
    if not all(math.isfinite(value) for value in (*wish.setpoint.vel_ned_mps, wish.setpoint.yaw_rad)):
        return "setpoint is not a number"
    if wish.track is None or wish.track.is_stale:
        return "position is too old to steer by"
    return ""


def _enu(setpoint: VelocitySetpoint) -> Enu:
    north, east, down = setpoint.vel_ned_mps
    return east, north, -down


def _velocity(track: UavTrack) -> Enu:
    return (track.vel_east_mps, track.vel_north_mps, track.vel_up_mps)


def _place(track: UavTrack) -> tuple[float, float, float, float, float, float]:
    return (track.east_m, track.north_m, track.alt_home_m, *_velocity(track))


def _action(choice: int, cause: int) -> GateAction:
    if choice == 0:
        if cause == rules.NONE:
            return GateAction.PASSED
        return GateAction.SLOWED if cause == rules.LIMIT else GateAction.BENT
    if choice == rules.BRAKE:
        return GateAction.HELD
    return GateAction.SLOWED if rules.is_straight(choice) else GateAction.BENT
