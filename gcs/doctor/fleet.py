"""The links: does every configured drone speak, and what does it say of itself."""

import time
from collections.abc import Callable, Iterator, Mapping

import httpx

from gcs.doctor.finding import Finding, caution, ok, red
from gcs.links.pymavlink_link import PymavlinkFleetLink
from gcs.links.transport import LinkError
from gcs.ports import VehicleStatus

LISTEN_S = 6.0  # six heartbeats
STEP_S = 0.02
LOSSY = 0.05
OWN_IDS = "give every drone its own id (MAV_SYS_ID, SYSID_THISMAV)"


def check_fleet(drones: Mapping[int, str], listen_s: float = LISTEN_S) -> Iterator[Finding]:
    """Listen on every address and report each drone: heartbeats and questions are sent, orders are not."""
    if not drones:
        yield caution("links", "no drones are configured", "give --drone SYSID=ADDRESS, or [drones] in --config FILE")
        return
    try:
        link = PymavlinkFleetLink(list(dict.fromkeys(drones.values())), {where: i for i, where in drones.items()})
    except LinkError as error:
        yield red("links", str(error), "a running gcs serve has the port: end it, or ask it with GET /api/v1/drones")
        return
    try:
        heard = _listen(link, drones, listen_s)
    finally:
        link.close()
    for system_id, address in drones.items():
        yield judge(system_id, address, heard.get(system_id), listen_s)
    for notice in link.drain_notices():
        yield caution("links", notice, OWN_IDS)


def judge(system_id: int, address: str, vehicle: VehicleStatus | None, listen_s: float) -> Finding:
    """One drone."""
    check = f"drone {system_id}"
    if vehicle is None or vehicle.heartbeat_s is None:
        remedy = "is it on, is the address right, does a firewall or another ground station hold the port?"
        return red(check, f"nothing heard on {address} for {listen_s:.0f} s", remedy)
    if vehicle.conflict:
        return red(check, vehicle.conflict, OWN_IDS)
    facts = f"{vehicle.autopilot}, {vehicle.mode_name or 'mode unknown'}, {address}"
    if vehicle.autopilot == "unknown":
        return red(check, facts, "only PX4 and ArduPilot are flown; check what answers there")
    for true, words, remedy in (
        (vehicle.armed, "armed", "a campaign starts with disarmed drones"),
        (
            vehicle.loss_ratio > LOSSY,
            f"{100.0 * vehicle.loss_ratio:.0f} % of its messages lost",
            "better antenna, lower telemetry rates, or a wired link",
        ),
        (not vehicle.position_ready, "not ready to fly by position", "wait for GPS and the vehicle's own checks"),
    ):
        if true:
            return caution(check, f"{facts}, {words}", remedy)
    return ok(check, f"{facts}, ready")


def check_policy_service(url: str | None, get: Callable[..., httpx.Response] = httpx.get) -> Iterator[Finding]:
    """A policy service that decisions are asked of; nothing without one."""
    if url is None:
        return
    try:
        answer = get(f"{url.rstrip('/')}/healthz", timeout=3.0)
        answer.raise_for_status()
    except (httpx.HTTPError, httpx.InvalidURL) as error:
        remedy = "start it with python -m policy serve, or leave [policy] url out to decide in this process"
        yield red("policy service", f"{url}: {error}", remedy)
        return
    yield ok("policy service", url)


def _listen(link: PymavlinkFleetLink, drones: Mapping[int, str], listen_s: float) -> Mapping[int, VehicleStatus]:
    """Until everyone is ready, or the time is up."""
    begun_s = time.monotonic()
    while (now_s := time.monotonic()) - begun_s < listen_s:
        link.poll(now_s)
        link.flush(now_s)
        heard = link.vehicles()
        if all(i in heard and heard[i].position_ready for i in drones):
            return heard
        time.sleep(STEP_S)
    return link.vehicles()
