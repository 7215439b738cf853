"""The gate's compiled rules, one tick of a fleet: limits, then the nearest velocity whose every future is clear.

A vehicle may obey a command at once or after the reaction time, may get another one at the next tick, or none ever
again: then it goes on for the autopilot's time-out and brakes by itself (PX4 COM_OF_LOSS_T, ArduPilot GUID_TIMEOUT).
Which of the commands on their way it has heard nobody knows: until the new one is obeyed any of them may act.
A velocity is let through when none of these ways, each with full braking at its end, leads out of the fence, into an
obstacle's margin or nearer than the separation to any way of another UAV. Braking is always such a way of a velocity
let through before, so a fleet that only took such velocities always has it left. Who is in a margin already (gusts,
a pilot) may do what leads no deeper, and is pushed out. Heights count as the envelope of all climbs that may act.

Compiled code that calls each other stands in this one file on purpose: numba's cache looks at the file of the function
that is called, and a stale copy of a rule that stands elsewhere would fly on unnoticed.
"""

import math

import numpy as np
from numba import njit

from gcs.safety.bounds import Bounds
from policy.world.arrays import FloatArray, IntArray

TOLD_MOST = 8
"""Different commands that may be on their way to a vehicle at once."""
_SAMPLE_S = 0.5
_SAMPLES_MOST = 10
_WAY = 1 + 2 * (_SAMPLES_MOST + 1)
"""Most segments of one way: a reaction time, then a chord and a braking way each :data:`_SAMPLE_S`."""
SEGMENTS = (1 + TOLD_MOST) * _WAY
"""Most segments of what may come of a new command."""


NONE, LIMIT, FENCE, OBSTACLE, SEPARATION = 0, 1, 2, 3, 4
"""Causes of a change."""

SIDE_KEPT_TICKS = 100.0
"""A UAV that was bent to one side goes on round that side for 10 s: else it would dither before a wall."""

HOLDING_MPS = 0.5
"""Vertical speeds up to this are the small moves of holding a height; a rival over or under is kept off no faster."""
HEIGHT_SPARE = 0.125
"""Share of the vertical separation that two UAVs over one another keep beyond it: half of what layers leave."""

_PUSH_PER_S = 0.5
_PUSH_MPS = 2.0
_DEEPER_M = 0.1
_PUSH_BEYOND_M = 0.3  # past the margin, so that who is pushed arrives outside it
_TURNS = np.radians(np.array([0, 0, 20, 0, 40, 20, 0, 65, 40, 90, 65, 90, 120, 150, 180.0]))
_ONWARD = 13  # so many of the turns still make way; the rest go back
_SHARES = np.array([1.0, 1.0, 1.0, 0.7, 1.0, 0.6, 0.4, 0.8, 0.4, 0.6, 0.3, 0.2, 0.4, 0.3, 0.2])
BRAKE = len(_TURNS) * 2
"""Choice of full braking; choice 2 i + 1 is turn i to the other side. Choice 2 keeps the way and stops the climb."""


def is_straight(choice: int) -> bool:
    """The choice keeps the direction of the wish."""
    return choice < BRAKE and float(_TURNS[choice // 2]) == 0.0


# --- the plane


@njit(cache=True)
def point_segment_m(px: float, py: float, ax: float, ay: float, bx: float, by: float) -> float:
    """Distance from a point to the segment a-b."""
    dx, dy = bx - ax, by - ay
    length_2 = dx * dx + dy * dy
    share = 0.0
    if length_2 > 0.0:
        share = min(1.0, max(0.0, ((px - ax) * dx + (py - ay) * dy) / length_2))
    ex, ey = px - ax - share * dx, py - ay - share * dy
    return math.sqrt(ex * ex + ey * ey)


@njit(cache=True)
def _side(ax: float, ay: float, bx: float, by: float, px: float, py: float) -> float:
    return (bx - ax) * (py - ay) - (by - ay) * (px - ax)


@njit(cache=True)
def segments_m(ax: float, ay: float, bx: float, by: float, cx: float, cy: float, dx: float, dy: float) -> float:
    """Least distance between the segments a-b and c-d; 0 where they cross."""
    apart_1 = _side(ax, ay, bx, by, cx, cy) * _side(ax, ay, bx, by, dx, dy)
    apart_2 = _side(cx, cy, dx, dy, ax, ay) * _side(cx, cy, dx, dy, bx, by)
    if apart_1 < 0.0 and apart_2 < 0.0:
        return 0.0
    return min(
        point_segment_m(ax, ay, cx, cy, dx, dy),
        point_segment_m(bx, by, cx, cy, dx, dy),
        point_segment_m(cx, cy, ax, ay, bx, by),
        point_segment_m(dx, dy, ax, ay, bx, by),
    )


@njit(cache=True)
def is_inside(px: float, py: float, edges: FloatArray, first: int, last: int) -> bool:
    """Even-odd rule over the edges [first, last) of one polygon; an edge is x0, y0, x1, y1."""
    inside = False
    for e in range(first, last):
        x0, y0, x1, y1 = edges[e, 0], edges[e, 1], edges[e, 2], edges[e, 3]
        if (y0 > py) != (y1 > py) and px < x0 + (py - y0) * (x1 - x0) / (y1 - y0):
            inside = not inside
    return inside


@njit(cache=True)
def segment_polygon_depth_m(
    ax: float, ay: float, bx: float, by: float, edges: FloatArray, first: int, last: int, margin_m: float
) -> float:
    """How deep the segment a-b reaches into a polygon and the margin around it; negative when clear."""
    nearest, low_x, low_y, high_x, high_y = math.inf, math.inf, math.inf, -math.inf, -math.inf
    for e in range(first, last):
        low_x, high_x = min(low_x, edges[e, 0]), max(high_x, edges[e, 0])
        low_y, high_y = min(low_y, edges[e, 1]), max(high_y, edges[e, 1])
    far = min(ax, bx) > high_x + margin_m or max(ax, bx) < low_x - margin_m
    if far or min(ay, by) > high_y + margin_m or max(ay, by) < low_y - margin_m:
        return -math.inf
    for e in range(first, last):
        gap = segments_m(ax, ay, bx, by, edges[e, 0], edges[e, 1], edges[e, 2], edges[e, 3])
        nearest = min(nearest, gap)
    if is_inside(bx, by, edges, first, last):  # the deeper the end lies inside, the worse
        deepest = math.inf
        for e in range(first, last):
            deepest = min(deepest, point_segment_m(bx, by, edges[e, 0], edges[e, 1], edges[e, 2], edges[e, 3]))
        return margin_m + deepest
    return margin_m - nearest


# --- what a vehicle may do


@njit(cache=True)
def moved(
    x: float, y: float, vx: float, vy: float, ux: float, uy: float, accel: float, time_s: float
) -> tuple[float, float, float, float]:
    """Place and velocity after ``time_s`` under the command u: the world's motion (policy.world.motion)."""
    dx, dy = ux - vx, uy - vy
    change_s = math.sqrt(dx * dx + dy * dy) / accel
    if change_s <= 0.0:
        return x + ux * time_s, y + uy * time_s, ux, uy
    spent_s = min(time_s, change_s)
    lag_s, rest = spent_s - spent_s * spent_s / (2.0 * change_s), 1.0 - spent_s / change_s
    return x + ux * time_s - lag_s * dx, y + uy * time_s - lag_s * dy, ux - rest * dx, uy - rest * dy


@njit(cache=True)
def _brake(ways: FloatArray, count: int, x: float, y: float, vx: float, vy: float, brake: float) -> int:
    way_s = math.sqrt(vx * vx + vy * vy) / (2.0 * brake)
    ways[count, 0], ways[count, 1], ways[count, 2], ways[count, 3] = x, y, x + vx * way_s, y + vy * way_s
    return count + 1


@njit(cache=True)
def _hold(
    ways: FloatArray,
    count: int,
    at: tuple[float, float, float, float],
    command: FloatArray,
    b: Bounds,
    hold_s: float,
) -> int:
    """One way from place and velocity ``at`` under a command, with braking after each part of ``hold_s``."""
    x, y, vx, vy = at
    samples = min(_SAMPLES_MOST, max(1, math.ceil(hold_s / _SAMPLE_S)))
    for sample in range(samples + 1):
        step_s = b.tick_s if sample == 0 else max(0.0, hold_s - b.tick_s) / samples
        x0, y0 = x, y
        x, y, vx, vy = moved(x, y, vx, vy, command[0], command[1], b.accel_mps2, step_s)
        ways[count, 0], ways[count, 1], ways[count, 2], ways[count, 3] = x0, y0, x, y
        count = _brake(ways, count + 1, x, y, vx, vy, b.brake_mps2)
    return count


@njit(cache=True)
def fill_ways(ways: FloatArray, place: FloatArray, told: FloatArray, command: FloatArray, b: Bounds) -> int:
    """What may come of a new command: write the ways of one vehicle into [SEGMENTS, 4]; returns how many.

    ``place``: east, north, up, and the velocity. One of ``told`` [R, 3] acts until ``command`` is obeyed, which then
    acts for the time-out at most.
    """
    x, y, vx, vy = place[0], place[1], place[3], place[4]
    count = _hold(ways, 0, (x, y, vx, vy), command, b, b.timeout_s)
    for r in range(len(told)):
        turned = moved(x, y, vx, vy, told[r, 0], told[r, 1], b.accel_mps2, b.reaction_s)
        ways[count, 0], ways[count, 1], ways[count, 2], ways[count, 3] = x, y, turned[0], turned[1]
        count = _hold(ways, count + 1, turned, command, b, b.timeout_s)
    return count


@njit(cache=True)
def fill_kept_ways(ways: FloatArray, place: FloatArray, told: FloatArray, b: Bounds) -> int:
    """What may come of the commands of before, should the vehicle hear no other, and of its present velocity."""
    at = (place[0], place[1], place[3], place[4])
    lasting_s = b.reaction_s + max(0.0, b.timeout_s - b.tick_s)
    count = _hold(ways, 0, at, place[3:6], b, lasting_s)
    for r in range(len(told)):
        count = _hold(ways, count, at, told[r], b, lasting_s)
    return count


@njit(cache=True)
def levelled_off_m(climb_mps: float, b: Bounds) -> float:
    """Height gained until a climb or descent has been stopped; the small moves of holding a height count as none."""
    if abs(climb_mps) <= HOLDING_MPS:
        return 0.0
    lasting_s = b.reaction_s + b.tick_s + b.timeout_s
    return climb_mps * lasting_s + climb_mps * abs(climb_mps) / (2.0 * b.vertical_accel_mps2)


# --- the judgement


@njit(cache=True)
def _approach_mps(room_m: float, b: Bounds) -> float:
    """Vertical speed toward a bound ``room_m`` away that can still stop; negative: away from it."""
    if room_m <= 0.0:
        return max(-1.0, room_m)
    reaction = b.vertical_accel_mps2 * b.reaction_s
    return math.sqrt(reaction * reaction + 2.0 * b.vertical_accel_mps2 * room_m) - reaction


@njit(cache=True)
def limited(wish: FloatArray, alt_m: float, b: Bounds) -> tuple[float, float, float]:
    """Level speed, climb and altitude band; the direction stays."""
    speed = math.sqrt(wish[0] * wish[0] + wish[1] * wish[1])
    share = b.max_speed_mps / speed if speed > b.max_speed_mps else 1.0
    return wish[0] * share, wish[1] * share, _in_band(wish[2], alt_m, b)


@njit(cache=True)
def _in_band(climb_mps: float, alt_m: float, b: Bounds) -> float:
    up = min(b.max_climb_mps, max(-b.max_descent_mps, climb_mps))
    return min(max(up, -_approach_mps(alt_m - b.min_alt_m, b)), _approach_mps(b.max_alt_m - alt_m, b))


@njit(cache=True)
def _fence_depth_m(x: float, y: float, b: Bounds) -> float:
    m = b.fence_margin_m
    return max(m - x, x - (b.width_m - m), m - y, y - (b.height_m - m))


@njit(cache=True)
def _fixed_depths(ways: FloatArray, count: int, b: Bounds, edges: FloatArray, starts: IntArray) -> tuple[float, float]:
    """Worst depth beyond the fence's margin and in the obstacles'; a straight way is worst at its end (convex area)."""
    fence, obstacle = -math.inf, -math.inf
    for s in range(count):
        ax, ay, bx, by = ways[s, 0], ways[s, 1], ways[s, 2], ways[s, 3]
        fence = max(fence, _fence_depth_m(bx, by, b))
        for p in range(len(starts) - 1):
            depth = segment_polygon_depth_m(ax, ay, bx, by, edges, starts[p], starts[p + 1], b.obstacle_margin_m)
            obstacle = max(obstacle, depth)
    return fence, obstacle


@njit(cache=True)
def _box_gap(a: FloatArray, count: int, box: FloatArray) -> bool:
    """No way of ``a`` comes within the box."""
    for s in range(count):
        east_apart = min(a[s, 0], a[s, 2]) > box[2] or max(a[s, 0], a[s, 2]) < box[0]
        if not (east_apart or min(a[s, 1], a[s, 3]) > box[3] or max(a[s, 1], a[s, 3]) < box[1]):
            return False
    return True


@njit(cache=True)
def _separation_depth_m(own: FloatArray, count: int, rival: FloatArray, rival_count: int, b: Bounds) -> float:
    """How much nearer than the separation any two ways come, whenever that is: the two may lag differently."""
    box = np.empty(4)
    box[0] = min(rival[:rival_count, 0].min(), rival[:rival_count, 2].min()) - b.separation_m
    box[1] = min(rival[:rival_count, 1].min(), rival[:rival_count, 3].min()) - b.separation_m
    box[2] = max(rival[:rival_count, 0].max(), rival[:rival_count, 2].max()) + b.separation_m
    box[3] = max(rival[:rival_count, 1].max(), rival[:rival_count, 3].max()) + b.separation_m
    if _box_gap(own, count, box):
        return -math.inf
    nearest = math.inf
    for s in range(count):
        ax, ay, bx, by = own[s, 0], own[s, 1], own[s, 2], own[s, 3]
        for r in range(rival_count):
            cx, cy, dx, dy = rival[r, 0], rival[r, 1], rival[r, 2], rival[r, 3]
            east_m = max(min(ax, bx) - max(cx, dx), min(cx, dx) - max(ax, bx), 0.0)
            north_m = max(min(ay, by) - max(cy, dy), min(cy, dy) - max(ay, by), 0.0)
            if east_m * east_m + north_m * north_m < nearest * nearest:  # else they cannot come nearer still
                nearest = min(nearest, segments_m(ax, ay, bx, by, cx, cy, dx, dy))
    return b.separation_m - nearest


@njit(cache=True)
def heights_m(place: FloatArray, lowest_mps: float, highest_mps: float, b: Bounds) -> tuple[float, float]:
    """Between which heights a UAV levels off: of its present climb and of the lowest and highest that it may obey."""
    now, low, high = levelled_off_m(place[5], b), levelled_off_m(lowest_mps, b), levelled_off_m(highest_mps, b)
    return place[2] + min(0.0, now, low), place[2] + max(0.0, now, high)


@njit(cache=True)
def _is_level(i: int, up: float, r: int, places: FloatArray, climbs: FloatArray, b: Bounds) -> bool:
    """The heights of two UAVs may come nearer than the vertical separation, should the first be told to climb by up."""
    low, high = heights_m(places[i], min(up, climbs[i, 0]), max(up, climbs[i, 1]), b)
    rival_low, rival_high = heights_m(places[r], climbs[r, 0], climbs[r, 1], b)
    apart_m: float = max(low - rival_high, rival_low - high)
    return apart_m < b.vertical_separation_m


@njit(cache=True)
def _climb_bounds(
    i: int, up: float, places: FloatArray, near: IntArray, ways: FloatArray, ways_count: IntArray, b: Bounds
) -> tuple[float, float]:
    """Least and greatest climb with rivals over and under, whose ways the UAV's own may cross.

    Each of the two may come nearer in height only so fast that it still stops beyond the separation and the spare;
    within it both are pushed apart. Without that, what gusts add to two heights held is never taken back.
    """
    low, high = -math.inf, math.inf
    for r in near:
        gap_m = places[i, 2] - places[r, 2]
        above = gap_m > 0.0 or (gap_m == 0.0 and i < r)
        room_m = abs(gap_m) - (1.0 + HEIGHT_SPARE) * b.vertical_separation_m
        toward = _approach_mps(0.5 * room_m, b) if room_m > 0.0 else max(-HOLDING_MPS, room_m)
        if toward >= 0.0 and (-up if above else up) <= toward:
            continue
        if _separation_depth_m(ways[i], ways_count[i], ways[r], ways_count[r], b) <= 0.0:
            continue
        if above:
            low = max(low, -toward)
        else:
            high = min(high, toward)
    return low, high


@njit(cache=True)
def _between(climb: float, bounds: tuple[float, float], alt_m: float, b: Bounds) -> float:
    """The climb within the bounds, in the middle where they leave nothing; the altitude band stands above them."""
    low, high = bounds
    if low <= climb <= high:
        return climb
    return _in_band(0.5 * (low + high) if low > high else min(high, max(low, climb)), alt_m, b)


@njit(cache=True)
def _push(
    place: FloatArray, places: FloatArray, near: IntArray, b: Bounds, edges: FloatArray, starts: IntArray
) -> tuple[float, float]:
    """Velocity out of the margins that the UAV is in."""
    x, y = place[0], place[1]
    m, east, north = b.fence_margin_m + _PUSH_BEYOND_M, 0.0, 0.0
    wall_m, apart_m = b.obstacle_margin_m + _PUSH_BEYOND_M, b.separation_m + _PUSH_BEYOND_M
    east += max(0.0, m - x) - max(0.0, x - (b.width_m - m))
    north += max(0.0, m - y) - max(0.0, y - (b.height_m - m))
    for p in range(len(starts) - 1):
        depth = segment_polygon_depth_m(x, y, x, y, edges, starts[p], starts[p + 1], wall_m)
        if depth > 0.0:
            ex, ey = _outward(x, y, edges, starts[p], starts[p + 1], depth > wall_m)
            east, north = east + depth * ex, north + depth * ey
    for r in near:
        ex, ey = x - places[r, 0], y - places[r, 1]
        gap = math.sqrt(ex * ex + ey * ey)
        if 0.0 < gap < apart_m:
            east, north = east + ex / gap * (apart_m - gap), north + ey / gap * (apart_m - gap)
    size = math.sqrt(east * east + north * north)
    if size == 0.0:
        return 0.0, 0.0
    share = min(_PUSH_MPS, _PUSH_PER_S * size) / size
    return east * share, north * share


@njit(cache=True)
def _outward(x: float, y: float, edges: FloatArray, first: int, last: int, inside: bool) -> tuple[float, float]:
    """Unit vector from the nearest wall to the point, or to the wall from a point inside."""
    best, which = math.inf, first
    for e in range(first, last):
        gap = point_segment_m(x, y, edges[e, 0], edges[e, 1], edges[e, 2], edges[e, 3])
        if gap < best:
            best, which = gap, e
    dx, dy = edges[which, 2] - edges[which, 0], edges[which, 3] - edges[which, 1]
    share = min(1.0, max(0.0, ((x - edges[which, 0]) * dx + (y - edges[which, 1]) * dy) / (dx * dx + dy * dy)))
    ex, ey = x - edges[which, 0] - share * dx, y - edges[which, 1] - share * dy
    size = math.sqrt(ex * ex + ey * ey)
    if size == 0.0:
        return 0.0, 0.0
    return (-ex / size, -ey / size) if inside else (ex / size, ey / size)


@njit(cache=True)
def _in_order(k: int, kept: bool) -> int:
    """The k-th choice to try: to both sides in turn, or, going round something, first all on the side kept."""
    if not kept or k >= 2 * _ONWARD:
        return k
    return 2 * k if k < _ONWARD else 2 * (k - _ONWARD) + 1


@njit(cache=True)
def _candidate(
    out: FloatArray, choice: int, vel: FloatArray, push: tuple[float, float], hold: float, side: float
) -> bool:
    """Write velocity number ``choice``; ``hold``: the climb that stops it. False where it repeats another one."""
    if choice == BRAKE:
        out[0], out[1], out[2] = push[0], push[1], hold
        return True
    i, mirrored = choice // 2, choice % 2 == 1
    if mirrored and (_TURNS[i] == 0.0 or _TURNS[i] > 3.1):
        return False
    turn = _TURNS[i] * (-side if mirrored else side)
    cos, sin, share = math.cos(turn), math.sin(turn), _SHARES[i]
    out[0] = share * (vel[0] * cos + vel[1] * sin) + push[0]
    out[1] = share * (vel[1] * cos - vel[0] * sin) + push[1]
    out[2] = hold if i == 1 else vel[2]
    return True


@njit(cache=True)
def judge_fleet(
    places: FloatArray,
    told: FloatArray,
    tolds: IntArray,
    climbs: FloatArray,
    wishes: FloatArray,
    sides: FloatArray,
    b: Bounds,
    edges: FloatArray,
    starts: IntArray,
) -> tuple[FloatArray, IntArray, IntArray]:
    """Safe velocities [K, 3], choices [K] and causes [K] for the first K of N UAVs; their order is the right of way.

    ``places`` [N, 6] east, north, up and velocity; ``told`` [N, TOLD_MOST, 3] the velocities of which the first
    ``tolds`` [N], at least one, may still act, the newest first (gcs.safety.acting); ``climbs`` [N, 2] the lowest
    and highest climb among all that may (gcs.safety.acting), widened here by the new ones; ``wishes`` [K, 3];
    ``sides`` [N, 2] the side a UAV is going round (1 right, -1 left) and for how many more ticks, updated here.
    """
    count, steered = len(places), len(wishes)
    out, choices, causes = np.zeros((steered, 3)), np.zeros(steered, np.int64), np.zeros(steered, np.int64)
    ways, ways_count = np.empty((count, 2 * SEGMENTS, 4)), np.zeros(count, np.int64)
    for i in range(count):
        ways_count[i] = fill_kept_ways(ways[i], places[i], told[i, : tolds[i]], b)
    for i in range(steered):
        vel, acting = np.array(limited(wishes[i], places[i, 2], b)), told[i, : tolds[i]]
        choices[i], causes[i] = _choose(
            i, vel, out[i], places, acting, climbs, ways, ways_count, sides, b, edges, starts
        )
        if choices[i] == 0 and causes[i] == NONE and np.max(np.abs(out[i] - wishes[i])) > 1e-9:
            causes[i] = LIMIT
        climbs[i, 0], climbs[i, 1] = min(climbs[i, 0], out[i, 2]), max(climbs[i, 1], out[i, 2])
        ways_count[i] += fill_ways(ways[i, ways_count[i] :], places[i], acting, out[i], b)
    return out, choices, causes


@njit(cache=True)
def _choose(
    i: int,
    vel: FloatArray,
    out: FloatArray,
    places: FloatArray,
    told: FloatArray,
    climbs: FloatArray,
    ways: FloatArray,
    ways_count: IntArray,
    sides: FloatArray,
    b: Bounds,
    edges: FloatArray,
    starts: IntArray,
) -> tuple[int, int]:
    near = _rivals(i, places, b)
    bounds = _climb_bounds(i, vel[2], places, near, ways, ways_count, b)
    hold = _between(0.0, bounds, places[i, 2], b)
    level = np.array([r for r in near if _is_level(i, hold, r, places, climbs, b)], dtype=np.int64)
    push = _push(places[i], places, level, b, edges, starts)
    asked_up, vel[2] = vel[2], _between(vel[2], bounds, places[i, 2], b)
    kept = sides[i, 1] > 0.0
    side = sides[i, 0] if kept else 1.0
    own = np.empty((SEGMENTS, 4))
    allowed, depths = np.zeros(3), np.zeros(3)
    cause, choice = NONE, 0
    # Lean spent on a speed that it does not reach against the wind is lacking for the turn: it drifts on as before.
    drift, speed = _drifts_into(places[i], b, edges, starts), math.hypot(places[i, 3], places[i, 4])
    for k in range(BRAKE + 1):
        choice = _in_order(k, kept)
        if not _candidate(out, choice, vel, push, hold, side):
            continue
        n = fill_ways(own, places[i], told, out, b)
        depths[0], depths[1] = _fixed_depths(own, n, b, edges, starts)
        depths[2] = -math.inf
        for r in near:
            if _is_level(i, out[2], r, places, climbs, b):
                depths[2] = max(depths[2], _separation_depth_m(own, n, ways[r], ways_count[r], b))
        if choice == 0 and np.max(depths) > 0.0:
            cause = FENCE + int(np.argmax(depths))
            braking = np.array([push[0], push[1], hold])
            _allow(allowed, i, braking, places, told, climbs, ways, ways_count, near, own, b, edges, starts)
        too_fast = drift != NONE and math.hypot(out[0], out[1]) > speed
        if choice == BRAKE or (_is_allowed(depths, allowed) and not too_fast):
            break
        if choice == 0 and cause == NONE:
            cause = drift
    _remember(sides, i, choice, side)
    if choice == 0 and (push[0] != 0.0 or push[1] != 0.0) and cause == NONE:
        cause = _pushed_by(places[i], places, level, b)
    if choice == 0 and cause == NONE and vel[2] != asked_up:
        cause = SEPARATION
    return choice, cause


@njit(cache=True)
def _pushed_by(place: FloatArray, places: FloatArray, level: IntArray, b: Bounds) -> int:
    if _fence_depth_m(place[0], place[1], b) > -_PUSH_BEYOND_M:
        return FENCE
    for r in level:
        if math.hypot(place[0] - places[r, 0], place[1] - places[r, 1]) < b.separation_m + _PUSH_BEYOND_M:
            return SEPARATION
    return OBSTACLE


@njit(cache=True)
def _drifts_into(place: FloatArray, b: Bounds, edges: FloatArray, starts: IntArray) -> int:
    """Which margin the UAV enters, or goes deeper into, as it flies now and then brakes, whatever it is told."""
    x, y, vx, vy = place[0], place[1], place[3], place[4]
    lasting_s = b.reaction_s + math.sqrt(vx * vx + vy * vy) / (2.0 * b.brake_mps2)
    end_x, end_y = x + vx * lasting_s, y + vy * lasting_s
    if _fence_depth_m(end_x, end_y, b) > max(0.0, _fence_depth_m(x, y, b) + _DEEPER_M):
        return FENCE
    for p in range(len(starts) - 1):
        now = segment_polygon_depth_m(x, y, x, y, edges, starts[p], starts[p + 1], b.obstacle_margin_m)
        then = segment_polygon_depth_m(x, y, end_x, end_y, edges, starts[p], starts[p + 1], b.obstacle_margin_m)
        if then > max(0.0, now + _DEEPER_M):
            return OBSTACLE
    return NONE


@njit(cache=True)
def _is_allowed(depths: FloatArray, allowed: FloatArray) -> bool:
    """Clear, or less deep than full braking would lead: as deep is no better, and crossing ways are all as deep."""
    return bool(np.all((depths <= 0.0) | (depths < allowed - 1e-6)))


@njit(cache=True)
def _allow(
    allowed: FloatArray,
    i: int,
    braking: FloatArray,
    places: FloatArray,
    told: FloatArray,
    climbs: FloatArray,
    ways: FloatArray,
    ways_count: IntArray,
    near: IntArray,
    own: FloatArray,
    b: Bounds,
    edges: FloatArray,
    starts: IntArray,
) -> None:
    """What full braking cannot avoid is no reason against another velocity."""
    n = fill_ways(own, places[i], told, braking, b)
    fence, obstacle = _fixed_depths(own, n, b, edges, starts)
    allowed[0], allowed[1], allowed[2] = max(0.0, fence), max(0.0, obstacle), 0.0
    for r in near:
        if _is_level(i, braking[2], r, places, climbs, b):
            allowed[2] = max(allowed[2], _separation_depth_m(own, n, ways[r], ways_count[r], b))


@njit(cache=True)
def _rivals(i: int, places: FloatArray, b: Bounds) -> IntArray:
    """UAVs near enough in height and distance for a closer look."""
    top = b.max_speed_mps
    reach_m = 2.0 * (top * (b.reaction_s + b.tick_s + b.timeout_s) + top * top / (2.0 * b.brake_mps2)) + b.separation_m
    rise_m = 2.0 * abs(levelled_off_m(max(b.max_climb_mps, b.max_descent_mps), b)) + b.vertical_separation_m
    near = np.zeros(len(places), np.int64)
    count = 0
    for r in range(len(places)):
        if r == i or abs(places[r, 2] - places[i, 2]) > rise_m:
            continue
        if math.hypot(places[r, 0] - places[i, 0], places[r, 1] - places[i, 1]) < reach_m:
            near[count] = r
            count += 1
    return near[:count]


@njit(cache=True)
def _remember(sides: FloatArray, i: int, choice: int, side: float) -> None:
    if choice < BRAKE and _TURNS[choice // 2] != 0.0:
        sides[i, 0] = -side if choice % 2 == 1 else side
        sides[i, 1] = SIDE_KEPT_TICKS
    else:
        sides[i, 1] -= 1.0
