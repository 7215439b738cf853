"""Metres from a pad to latitude and longitude: WGS 84 radii of curvature on a locally flat earth.

The mock's own arithmetic on purpose: ground control has another, so that a frame or scale mistake shows.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, degrees, radians, sin, sqrt

WGS84_A_M = 6_378_137.0  # NIMA TR8350.2, semi-major axis
WGS84_E2 = 6.694_379_990_14e-3  # first eccentricity squared


@dataclass(frozen=True, slots=True)
class Geodetic:
    """A place: degrees north and east, metres above mean sea level (taken as the ellipsoid)."""

    lat_deg: float
    lon_deg: float
    alt_amsl_m: float


def _radii_m(lat_deg: float) -> tuple[float, float]:
    """Radii of curvature along the meridian and across it."""
    root = sqrt(1.0 - WGS84_E2 * sin(radians(lat_deg)) ** 2)
    return WGS84_A_M * (1.0 - WGS84_E2) / root**3, WGS84_A_M / root


def to_geodetic(origin: Geodetic, north_m: float, east_m: float, up_m: float) -> Geodetic:
    """The place so many metres north, east and up of `origin`; radii are taken half way."""
    meridian_m, _ = _radii_m(origin.lat_deg)
    lat_deg = origin.lat_deg + degrees(north_m / (meridian_m + origin.alt_amsl_m))
    middle_deg = 0.5 * (lat_deg + origin.lat_deg)
    _, prime_m = _radii_m(middle_deg)
    lon_deg = origin.lon_deg + degrees(east_m / ((prime_m + origin.alt_amsl_m) * cos(radians(middle_deg))))
    return Geodetic(lat_deg, lon_deg, origin.alt_amsl_m + up_m)


def to_ned_m(origin: Geodetic, place: Geodetic) -> tuple[float, float, float]:
    """North, east, down metres from `origin` to `place`: the inverse of `to_geodetic`."""
    meridian_m, _ = _radii_m(origin.lat_deg)
    middle_deg = 0.5 * (place.lat_deg + origin.lat_deg)
    _, prime_m = _radii_m(middle_deg)
    north_m = radians(place.lat_deg - origin.lat_deg) * (meridian_m + origin.alt_amsl_m)
    across_m = (prime_m + origin.alt_amsl_m) * cos(radians(middle_deg))
    east_m = radians(place.lon_deg - origin.lon_deg) * across_m
    return north_m, east_m, origin.alt_amsl_m - place.alt_amsl_m


def plausible(place: Geodetic) -> bool:
    """Whether this is a place on the globe that a vehicle could be sent to (False for NaN)."""
    return abs(place.lat_deg) <= 90.0 and abs(place.lon_deg) <= 180.0 and abs(place.alt_amsl_m) <= 1e5
