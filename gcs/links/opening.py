"""Which link a fleet is flown over: addresses as the operator wrote them, the library, the key, the recorder."""

from collections.abc import Mapping
from pathlib import Path
from typing import Final

from gcs.links.fleet_link import Clock, WiredFleetLink
from gcs.links.mavsdk_link import MavsdkFleetLink
from gcs.links.pymavlink_link import PymavlinkFleetLink
from gcs.links.signing import read_key
from gcs.links.tlog import TlogRecorder
from gcs.links.transport import LinkError

LIBRARIES: Final = ("pymavlink", "mavsdk")


def addresses_of(drones: Mapping[int, str]) -> dict[str, int | None]:
    """Address -> the system id that must answer there, None where several share a listening port.

    One drone may have several links, with commas between: ``udpout:10.0.0.7:14550,serial:/dev/ttyUSB0:57600``.
    """
    found: dict[str, int | None] = {}
    for system_id, text in drones.items():
        for address in map(str.strip, text.split(",")):
            shared = address in found and found[address] != system_id
            found[address] = None if shared else system_id
    return found


def open_link(
    drones: Mapping[int, str],
    library: str = "pymavlink",
    *,
    signing_key: Path | None = None,
    recorder: TlogRecorder | None = None,
    clock: Clock | None = None,
) -> WiredFleetLink:
    """Open all links of a fleet; LinkError, in one line, when one cannot be. ``clock``: the flight's, in real time."""
    addresses = addresses_of(drones)
    expected = {address: system_id for address, system_id in addresses.items() if system_id is not None}
    if library == "mavsdk":
        if signing_key is not None:
            raise LinkError("the mavsdk link cannot sign; fly signed vehicles with --link pymavlink")
        return MavsdkFleetLink(list(addresses), expected, recorder, clock)
    if library != "pymavlink":
        raise LinkError(f"link {library!r} is not known; choose one of {', '.join(LIBRARIES)}")
    signing = None if signing_key is None else read_key(signing_key)
    return PymavlinkFleetLink(list(addresses), expected, recorder, signing, clock)
