"""The gate against the mock's physics, many cases at once: what `make gate-long` and its short sister run.

Two kinds of wishes: *wild* ones (any velocity up to 25 m/s, changed every few seconds: nothing may be breached) and
*goals* (guidance to a point: nothing may be breached, and everybody has to arrive, else the gate is a dead end).
"""

import argparse
import math
import sys
import time
from dataclasses import dataclass, field

import numpy as np
from gate_cases import FLAVOURS, UAVS, Cases, draw
from numba import njit

from gcs.safety.acting import acting_climbs, still_acting
from gcs.safety.bounds import Bounds
from gcs.safety.judge import TOLD_MOST, judge_fleet
from sitl_mock.physics.fleet import STEP_TICKS, Air, Fleet

TICK_S = 0.1
STALE_TICKS = 10
REACTION_TICKS = 5
EXTRAPOLATED_TICKS = 5
WILD_TICKS = 400
GOAL_TICKS = 3000
ARRIVED_M = 4.0
TOO_NEAR_M, LEVEL_M = 5.0, 3.0  # gcs.safety.monitor's rule


@dataclass
class Outcome:
    """What happened in a batch of cases: [C] flags."""

    geofence: np.ndarray
    obstacle: np.ndarray
    separation: np.ndarray
    arrived: np.ndarray
    ticks: int
    trace: list[tuple[np.ndarray, np.ndarray]] = field(default_factory=list)

    @property
    def breached(self) -> np.ndarray:
        """Any rule."""
        return self.geofence | self.obstacle | self.separation


@njit  # not cached: numba would not notice that the rules have changed
def _judge_all(count, seen, age, stale, told, history, wishes, sides, bounds, edges, starts, walls, done):
    """``history`` [C, UAVS, ticks, 3] of what was told, newest first, kept here as gcs.safety.gate keeps it."""
    for c in range(len(count)):
        n = count[c]
        if done[c]:
            told[c] = 0.0
            continue
        row = bounds[c]
        b = Bounds(row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7], row[8], row[9], row[10], row[11],
                   row[12], row[13], row[14], row[15], row[16])  # fmt: skip
        order = np.empty(n, np.int64)
        steered = 0
        for i in range(n):
            if not stale[c, i]:
                order[steered] = i
                steered += 1
        last = steered
        for i in range(n):
            if stale[c, i]:
                order[last] = i
                last += 1
        places = seen[c][order]
        side = sides[c][order]
        acting, actings, climbs = np.zeros((n, TOLD_MOST, 3)), np.zeros(n, np.int64), np.zeros((n, 2))
        for k in range(n):
            sent = history[c, order[k], : min(REACTION_TICKS + age[c, order[k]], history.shape[2])]
            actings[k] = still_acting(sent, acting[k])
            acting_climbs(sent, climbs[k])
        wish = wishes[c][order[:steered]]
        safe, _, _ = judge_fleet(places, acting, actings, climbs, wish, side, b, edges[c], starts[c, : walls[c] + 1])
        for k in range(steered):
            i = order[k]
            history[c, i, 1:] = history[c, i, :-1].copy()
            history[c, i, 0] = safe[k]
            told[c, i] = safe[k]
            sides[c, i] = side[k]


@njit
def _inside(x, y, edges, first, last):
    inside = False
    for e in range(first, last):
        x0, y0, x1, y1 = edges[e]
        if (y0 > y) != (y1 > y) and x < x0 + (y - y0) * (x1 - x0) / (y1 - y0):
            inside = not inside
    return inside


@njit
def _note_breaches(count, places, bounds, edges, starts, walls, flags):
    for c in range(len(count)):
        for i in range(count[c]):
            x, y, z = places[c, i, 0], places[c, i, 1], places[c, i, 2]
            if not (0.0 <= x <= bounds[c, 0] and 0.0 <= y <= bounds[c, 1]):
                flags[0, c] = True
            for p in range(walls[c]):
                if _inside(x, y, edges[c], starts[c, p], starts[c, p + 1]):
                    flags[1, c] = True
            for j in range(i):
                gap = math.hypot(x - places[c, j, 0], y - places[c, j, 1])
                if gap < TOO_NEAR_M and abs(z - places[c, j, 2]) <= LEVEL_M:
                    flags[2, c] = True


def fly(cases: Cases, rng: np.random.Generator, *, wild: bool, gust_mps: float, keep: bool = False) -> Outcome:
    """One batch to its end."""
    c, n = len(cases.count), len(cases.count) * UAVS
    fleet = Fleet([cases.flavour.kind] * n, Air((0.0, 0.0), gust_mps, int(rng.integers(1 << 30))))
    fleet._wind[:] = np.repeat(cases.wind_en_mps[:, ::-1], UAVS, axis=0).T
    fleet.place(_ned(cases.place_m.reshape(n, 3)), np.zeros((n, 3)))
    fleet.command[:, 4] = 1.0
    told, sides = np.zeros((c, UAVS, 3)), np.zeros((c, UAVS, 2))
    history = np.zeros((c, UAVS, REACTION_TICKS + STALE_TICKS, 3))
    obeyed, heard_tick = np.zeros((c, UAVS, 3)), np.zeros((c, UAVS), dtype=int)
    flags, done = np.zeros((3, c), dtype=np.bool_), np.zeros(c, dtype=np.bool_)
    seen_tick = np.zeros((c, UAVS), dtype=int)
    seen = np.concatenate([cases.place_m, np.zeros((c, UAVS, 3))], axis=-1)
    reports, sent, trace = [], [], []
    wish, until = np.zeros((c, UAVS, 3)), np.zeros((c, UAVS))
    timeout = round(cases.flavour.timeout_s / TICK_S)
    exists = np.arange(UAVS)[None, :] < cases.count[:, None]
    total = WILD_TICKS if wild else GOAL_TICKS
    for tick in range(total):
        cut = (tick * TICK_S >= cases.cut_s[..., 0]) & (tick * TICK_S < cases.cut_s[..., 1])
        now = np.concatenate([_enu(fleet.pos_ned_m), _enu(fleet.vel_ned_mps)], axis=1).reshape(c, UAVS, 6)
        _note_breaches(cases.count, now, cases.bounds, cases.edges, cases.starts, cases.walls, flags)
        if keep:
            trace.append((now.copy(), told.copy()))
        reports = [*reports[-3:], now]
        _take_reports(cases, reports, tick, cut, seen, seen_tick)
        age = tick - seen_tick
        view = seen.copy()
        view[..., :3] += view[..., 3:] * (np.minimum(age, EXTRAPOLATED_TICKS) * TICK_S)[..., None]
        if wild:
            _wild_wishes(rng, tick, wish, until)
        else:
            _goal_wishes(cases, view, wish)
            at_goal = np.hypot(now[..., 0] - cases.goal_m[..., 0], now[..., 1] - cases.goal_m[..., 1]) < ARRIVED_M
            done |= np.all(at_goal | ~exists, axis=1)
            if done.all():
                break
        stale = age > STALE_TICKS
        args = (cases.bounds, cases.edges, cases.starts, cases.walls, done)
        _judge_all(cases.count, view, age, stale, told, history, wish, sides, *args)
        sent = [*sent[-3:], np.where(stale[..., None], 0.0, told)]
        arrives = ~cut & (rng.random((c, UAVS)) >= cases.loss[:, None])
        for delay in range(4):
            rows = (cases.command_ticks == delay)[:, None] & arrives
            if delay < len(sent):
                obeyed[rows] = sent[-1 - delay][rows]
        heard_tick[arrives] = tick
        flown = np.where((tick - heard_tick >= timeout)[..., None], 0.0, obeyed)
        fleet.command[:, :3] = _ned(flown.reshape(n, 3))
        fleet.advance(STEP_TICKS)
    return Outcome(*flags, done | wild, tick + 1, trace)


def _take_reports(cases: Cases, reports: list, tick: int, cut: np.ndarray, seen: np.ndarray, at: np.ndarray) -> None:
    for delay in range(4):
        if delay < len(reports):
            rows = (cases.report_ticks == delay)[:, None] & ~cut
            seen[rows] = reports[-1 - delay][rows]
            at[rows] = tick - delay


def _wild_wishes(rng: np.random.Generator, tick: int, wish: np.ndarray, until: np.ndarray) -> None:
    due = until <= tick
    speed, course = rng.uniform(0.0, 25.0, due.shape), rng.uniform(0.0, 2.0 * math.pi, due.shape)
    climb = np.where(rng.random(due.shape) < 0.2, rng.uniform(-3.0, 3.0, due.shape), 0.0)
    fresh = np.stack([speed * np.sin(course), speed * np.cos(course), climb], axis=-1)
    wish[due] = fresh[due]
    until[due] = (tick + rng.integers(3, 80, due.shape))[due]


def _goal_wishes(cases: Cases, view: np.ndarray, wish: np.ndarray) -> None:
    """gcs.guidance.tracking.approach, for all at once."""
    way = cases.goal_m[..., :2] - view[..., :2]
    distance = np.maximum(np.hypot(way[..., 0], way[..., 1]), 1e-9)
    speed = np.minimum(np.minimum(cases.speed_mps[:, None], np.sqrt(3.0 * distance)), 0.5 * distance)
    wish[..., :2] = way * (speed / distance)[..., None]
    wish[..., 2] = np.clip(0.8 * (cases.goal_m[..., 2] - view[..., 2]), -2.0, 2.0)


def _ned(enu: np.ndarray) -> np.ndarray:
    return np.column_stack([enu[:, 1], enu[:, 0], -enu[:, 2]])


def _enu(ned: np.ndarray) -> np.ndarray:
    return np.column_stack([ned[:, 1], ned[:, 0], -ned[:, 2]])


GUSTS_MPS = (0.0, 5.0, 10.0)  # Dryden's wind at 20 ft


def batches(total: int, seed: int, size: int = 400):
    """(seed, wild, flavour, gust, count) of each batch; airframes, wishes and gusts take turns."""
    for number in range(-(-total // size)):
        count = min(size, total - number * size)
        yield seed + number, number % 2 == 0, FLAVOURS[number // 2 % 2], GUSTS_MPS[number // 4 % 3], count


def run(total: int, seed: int, size: int = 400, tell=None) -> dict[str, int]:
    """Counts over ``total`` cases."""
    sums = dict.fromkeys(("cases", "geofence", "obstacle", "separation", "deadlock"), 0)
    for number, wild, flavour, gust_mps, count in batches(total, seed, size):
        rng = np.random.default_rng(number)
        outcome = fly(draw(rng, count, flavour), rng, wild=wild, gust_mps=gust_mps)
        sums["cases"] += count
        for name in ("geofence", "obstacle", "separation"):
            sums[name] += int(getattr(outcome, name).sum())
        sums["deadlock"] += int((~outcome.arrived).sum())
        if tell is not None:
            tell(number, wild, flavour, gust_mps, outcome, sums)
    return sums


def main() -> int:
    """Exit code 1 when anything was breached or stuck."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--quiet", action="store_true")
    args = parser.parse_args()
    begun_s = time.monotonic()

    def tell(number, wild, flavour, gust_mps, outcome, sums) -> None:
        bad = np.flatnonzero(outcome.breached | ~outcome.arrived)
        kind = "wild" if wild else "goals"
        if bad.size or (not args.quiet and number % 8 == 0):
            what = f"batch {number} {kind} {flavour.timeout_s:g} s gust {gust_mps:g}: bad {bad.tolist()}"
            print(f"{time.monotonic() - begun_s:6.0f} s  {what}  so far {sums}", flush=True)

    sums = run(args.cases, args.seed, tell=tell)
    print(f"{sums} in {time.monotonic() - begun_s:.0f} s")
    return int(any(count for name, count in sums.items() if name != "cases"))


if __name__ == "__main__":
    sys.exit(main())
