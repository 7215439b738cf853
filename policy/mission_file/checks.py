"""Checks that need geometry, physics or other files: a document of the right shape may still not be flyable."""

import numpy as np

from policy.mission_file.mission import Source
from policy.world.airspace import inside_area
from policy.world.arrays import FloatArray
from policy.world.channel import check_radio
from policy.world.energy import propulsion_power_w
from policy.world.geometry import Polygon, distance_to_polygon_m, polygon_area_m2
from policy.world.scenario import Obstacle, Scenario

Point = tuple[float, float]

MIN_FLIGHT_ALTITUDE_M = 10.0
"""The lowest layer stays above people, vehicles and hedges."""
MAX_LATITUDE_DEG = 85.0
"""Nearer to a pole a rectangle of metres is no rectangle of degrees."""
MIN_OBSTACLE_AREA_M2 = 0.01


def check_scenario(scenario: Scenario, source: Source) -> None:
    """Everything that must hold for a campaign; also run again when a campaign is varied (--uavs, --mcl-db)."""
    _check_frame(scenario, source)
    for index, obstacle in enumerate(scenario.area.obstacles):
        _check_obstacle(index, obstacle, scenario, source)
    _check_layers(scenario, source)
    _check_launch(scenario, source)
    _check_radio(scenario, source)
    _check_battery(scenario, source)
    if float(np.sum(scenario.collect_mbps)) <= 0.0:
        source.fail(("users", "collect_mbps"), "is 0 for every user: there is nothing to collect; give a rate above 0")


def warnings_of(scenario: Scenario) -> tuple[str, ...]:
    """What may go wrong in flight: batteries that last for cautious flying only."""
    worst_w = float(np.max(_power_w(scenario)))
    share = worst_w * scenario.slots * scenario.slot_s / scenario.battery_j
    if share <= 1.0:
        return ()
    return (f"[fleet] battery_mah: the battery holds {1 / share:.0%} of what the hungriest flight of all slots needs",)


def _check_frame(scenario: Scenario, source: Source) -> None:
    lat_deg, lon_deg = scenario.area.south_west_deg
    if abs(lat_deg) > MAX_LATITUDE_DEG or abs(lon_deg) > 180.0:
        source.fail(
            ("area", "south_west"),
            f"[{lat_deg:g}, {lon_deg:g}] is no [latitude, longitude] within {MAX_LATITUDE_DEG:g} and 180 degrees",
        )


def _check_obstacle(index: int, obstacle: Obstacle, scenario: Scenario, source: Source) -> None:
    key = ("area", "obstacles", index, "polygon_m")
    polygon = obstacle.polygon_m
    if _crosses_itself(polygon):
        source.fail(key, f'the outline of obstacle "{obstacle.name}" crosses itself; give its corners in order')
    if polygon_area_m2(polygon) < MIN_OBSTACLE_AREA_M2:
        source.fail(key, f'obstacle "{obstacle.name}" encloses no area; give its corners in order')
    corners = np.asarray(polygon)
    size = np.asarray(scenario.area.size_m)
    if np.any(np.max(corners, axis=0) < 0.0) or np.any(np.min(corners, axis=0) > size):
        source.fail(key, f'obstacle "{obstacle.name}" lies outside the area of {size[0]:g} x {size[1]:g} m')


def _check_layers(scenario: Scenario, source: Source) -> None:
    lowest_m = scenario.altitude_m - scenario.layer_m * (scenario.num_uavs - 1)
    if lowest_m < MIN_FLIGHT_ALTITUDE_M:
        source.fail(
            ("fleet", "altitude_m"),
            f"{scenario.num_uavs} UAVs {scenario.layer_m:g} m above each other below {scenario.altitude_m:g} m put the "
            f"lowest at {lowest_m:g} m, under {MIN_FLIGHT_ALTITUDE_M:g} m; raise altitude_m or lower layer_m",
        )


def _check_launch(scenario: Scenario, source: Source) -> None:
    key = ("fleet", "launch_m")
    for east_m, north_m in scenario.launch_enu_m:
        point = np.asarray([east_m, north_m])
        spot = f"launch point [{east_m:g}, {north_m:g}]"
        if not inside_area(point, scenario):
            width_m, depth_m = scenario.area.size_m
            source.fail(key, f"{spot} is outside the area of {width_m:g} x {depth_m:g} m; move it inside")
        for obstacle in scenario.area.obstacles:
            _check_clear(point, spot, obstacle, scenario, source)


def _check_clear(point: FloatArray, spot: str, obstacle: Obstacle, scenario: Scenario, source: Source) -> None:
    """Obstacles as high as the UAVs fly are flown around; one in the way of the climb itself cannot be."""
    distance_m = float(distance_to_polygon_m(point, obstacle.polygon_m))
    tall = f'obstacle "{obstacle.name}" ({obstacle.height_m:g} m high)'
    if distance_m <= 0.0:
        source.fail(("fleet", "launch_m"), f"{spot} is inside {tall}, climbing would cross it; move the launch point")
    if obstacle in scenario.blocking_obstacles and distance_m <= scenario.obstacle_margin_m:
        source.fail(
            ("fleet", "altitude_m"),
            f"{scenario.altitude_m:g} m is not clear of {tall}, {distance_m:.1f} m from {spot}; fly higher or "
            f"launch more than {scenario.obstacle_margin_m:g} m away from it",
        )


def _check_radio(scenario: Scenario, source: Source) -> None:
    try:
        check_radio(scenario.altitude_m, scenario.radio)
    except ValueError as error:
        source.fail(("radio",), str(error))
    if scenario.serving_radius_m <= 0.0:
        source.fail(
            ("radio", "mcl_db"),
            f"at {scenario.radio.mcl_db:g} dB nobody can be served from {scenario.altitude_m:g} m; raise it or descend",
        )


def _check_battery(scenario: Scenario, source: Source) -> None:
    least_j = float(np.min(_power_w(scenario))) * scenario.slots * scenario.slot_s
    if least_j > scenario.battery_j:
        source.fail(
            ("fleet", "battery_mah"),
            f"the battery ({scenario.battery_j:.0f} J) is empty before the last slot at any speed (at least "
            f"{least_j:.0f} J for {scenario.slots} slots of {scenario.slot_s:g} s); fly fewer slots or more battery",
        )


def _power_w(scenario: Scenario) -> FloatArray:
    """Power over the speeds that the UAV may choose."""
    return np.asarray(propulsion_power_w(np.linspace(0.0, scenario.max_speed_mps, 181)), dtype=np.float64)


def _crosses_itself(polygon: Polygon) -> bool:
    count = len(polygon)
    edges = [(polygon[i], polygon[(i + 1) % count]) for i in range(count)]
    apart = ((i, j) for i in range(count) for j in range(i + 2, count) if (i, j) != (0, count - 1))
    return any(_cross(*edges[i], *edges[j]) for i, j in apart)


def _cross(a: Point, b: Point, c: Point, d: Point) -> bool:
    """Open segments a-b and c-d cross: each has the other's ends on both sides."""
    return _side(a, b, c) * _side(a, b, d) < 0 and _side(c, d, a) * _side(c, d, b) < 0


def _side(a: Point, b: Point, p: Point) -> int:
    turn = (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])
    return (turn > 0.0) - (turn < 0.0)
