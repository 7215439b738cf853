"""The one module that converts between geodetic coordinates, local metres, headings and velocities.

Source: WGS 84 (NIMA TR8350.2), meridian and prime-vertical radii of curvature.
"""

import math
from dataclasses import dataclass
from functools import cached_property

from policy.world.arrays import Array, array_namespace

WGS84_SEMI_MAJOR_M = 6378137.0
WGS84_FLATTENING = 1.0 / 298.257223563
TWO_PI = 2.0 * math.pi


@dataclass(frozen=True)
class LocalFrame:
    """East/north metres around an origin, by the ellipsoid's radii of curvature there.

    Good to 1 m within 3 km of the origin, which is below a GNSS receiver's own error.
    """

    origin_lat_deg: float
    origin_lon_deg: float

    @cached_property
    def _metres_per_degree(self) -> tuple[float, float]:
        """(east, north) metres per degree of longitude and latitude at the origin."""
        lat_rad = math.radians(self.origin_lat_deg)
        eccentricity_2 = WGS84_FLATTENING * (2.0 - WGS84_FLATTENING)
        w_2 = 1.0 - eccentricity_2 * math.sin(lat_rad) ** 2
        prime_vertical_m = WGS84_SEMI_MAJOR_M / math.sqrt(w_2)
        meridian_m = WGS84_SEMI_MAJOR_M * (1.0 - eccentricity_2) / w_2**1.5
        return (math.radians(1.0) * prime_vertical_m * math.cos(lat_rad), math.radians(1.0) * meridian_m)

    def to_enu_m(self, lat_deg: Array, lon_deg: Array) -> tuple[Array, Array]:
        """Latitude and longitude in degrees, [...] each, to (east, north) metres, [...] each."""
        east_per_deg, north_per_deg = self._metres_per_degree
        return (
            (lon_deg - self.origin_lon_deg) * east_per_deg,
            (lat_deg - self.origin_lat_deg) * north_per_deg,
        )

    def to_geodetic_deg(self, east_m: Array, north_m: Array) -> tuple[Array, Array]:
        """East and north metres, [...] each, to (latitude, longitude) degrees, [...] each."""
        east_per_deg, north_per_deg = self._metres_per_degree
        return (self.origin_lat_deg + north_m / north_per_deg, self.origin_lon_deg + east_m / east_per_deg)


def velocity_enu_mps(heading_rad: Array, speed_mps: Array) -> Array:
    """Heading clockwise from north and speed, [...] each, to velocity east/north [..., 2]."""
    xp = array_namespace(heading_rad, speed_mps)
    return xp.stack((speed_mps * xp.sin(heading_rad), speed_mps * xp.cos(heading_rad)), axis=-1)


def heading_rad(vel_enu_mps: Array) -> Array:
    """Direction of travel clockwise from north in [0, 2 pi): [..., 2] -> [...]; 0 when at rest."""
    xp = array_namespace(vel_enu_mps)
    angle = xp.atan2(vel_enu_mps[..., 0], vel_enu_mps[..., 1])
    wrapped = xp.where(angle < 0.0, angle + TWO_PI, angle)
    return xp.where(wrapped >= TWO_PI, wrapped - TWO_PI, wrapped)
