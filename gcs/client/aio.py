"""The client that awaits. ``sync.py`` is written from this file by ``python gcs/client/unasync.py``."""

import asyncio
from collections.abc import AsyncGenerator, Mapping, Sequence
from contextlib import aclosing
from datetime import datetime
from types import TracebackType
from typing import Any, Self, TypeVar

import httpx
from websockets.asyncio.client import connect
from websockets.exceptions import WebSocketException

from gcs.client import calls, models
from gcs.client.errors import UnreachableError, raise_problem

T = TypeVar("T")


class AsyncClient:
    """One server. Use it in an ``async with``, or close it.

    Calls raise :class:`~gcs.client.errors.ApiError` when the server says no and ``UnreachableError`` when it does not
    answer after three tries. Changes carry an Idempotency-Key, so a repeated try acts once; 429 is waited for.
    """

    def __init__(
        self,
        url: str = "http://127.0.0.1:8080",
        key: str | None = None,
        *,
        timeout_s: float = calls.TIMEOUT_S,
        transport: httpx.AsyncBaseTransport | None = None,
    ) -> None:
        self.url = url.rstrip("/")
        self._key = key
        self._http = httpx.AsyncClient(
            base_url=self.url, headers=calls.headers(key), timeout=calls.timeouts(timeout_s), transport=transport
        )

    async def __aenter__(self) -> Self:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await self.aclose()

    async def aclose(self) -> None:
        """End the connections."""
        await self._http.aclose()

    # Campaigns

    async def create(self, mission: calls.MissionLike, policy: str | None = None) -> models.CampaignFull:
        """A campaign from the name of a mission at hand, or from a mission document."""
        return await self._post(models.CampaignFull, "/api/v1/campaigns", calls.mission_body(mission, policy))

    async def campaigns(self, limit: int = 100, offset: int = 0) -> list[models.CampaignBrief]:
        """Newest first."""
        return await self._get(list[models.CampaignBrief], "/api/v1/campaigns", limit=limit, offset=offset)

    async def campaign(self, campaign_id: str) -> models.CampaignFull:
        """State, slot, metrics so far, the mission."""
        return await self._get(models.CampaignFull, f"/api/v1/campaigns/{campaign_id}")

    async def preflight(self, campaign_id: str) -> models.PreflightView:
        """The checklist with the drones as they are now."""
        return await self._get(models.PreflightView, f"/api/v1/campaigns/{campaign_id}/preflight")

    async def start(self, campaign_id: str, *, override: bool = False) -> models.Taken:
        """Launch; ``override`` takes off in spite of red pre-flight lines, for admins."""
        suffix = "?override=true" if override else ""
        return await self._post(models.Taken, f"/api/v1/campaigns/{campaign_id}/start{suffix}")

    async def pause(self, campaign_id: str) -> models.Taken:
        """Hold in place."""
        return await self._post(models.Taken, f"/api/v1/campaigns/{campaign_id}/pause")

    async def resume(self, campaign_id: str) -> models.Taken:
        """Go on after a pause."""
        return await self._post(models.Taken, f"/api/v1/campaigns/{campaign_id}/resume")

    async def abort(self, campaign_id: str) -> models.Taken:
        """All drones return and land; a campaign that never flew is struck off."""
        return await self._post(models.Taken, f"/api/v1/campaigns/{campaign_id}/abort")

    async def wait(self, campaign_id: str, *, poll_s: float = 1.0) -> models.CampaignFull:
        """Until it is done, aborted or failed."""
        while (found := await self.campaign(campaign_id)).state not in calls.FINAL_STATES:  # noqa: ASYNC110
            await asyncio.sleep(poll_s)
        return found

    async def report(self, campaign_id: str, *, places: bool = True) -> dict[str, Any]:
        """Metrics, slots, events, comparison, and how to fly it again."""
        return await self._get(dict[str, Any], f"/api/v1/campaigns/{campaign_id}/report", places=places)

    async def report_file(self, campaign_id: str, form: str, *, places: bool = True) -> bytes:
        """The report as ``html``, ``csv``, ``geojson`` or ``kml``."""
        query = {"format": form} | ({} if places else {"places": False})
        return (await self._send("GET", f"/api/v1/campaigns/{campaign_id}/report", query=query)).content

    async def series(self, campaign_id: str) -> list[models.SeriesPoint]:
        """A point a finished slot, without users."""
        return await self._get(list[models.SeriesPoint], f"/api/v1/campaigns/{campaign_id}/series")

    async def recording(self, campaign_id: str) -> models.RecordingView:
        """Area, state and log of a campaign with its slots' range; 409 when it was never started."""
        return await self._get(models.RecordingView, f"/api/v1/campaigns/{campaign_id}/recording")

    async def recorded_slots(self, campaign_id: str, first: int = 0, limit: int = 60) -> models.SlotsPage:
        """Slots with everybody's places from number ``first`` on; the rest with ``first=page.next_first``."""
        path = f"/api/v1/campaigns/{campaign_id}/recording/slots"
        return await self._get(models.SlotsPage, path, first=first, limit=limit)

    async def recorded_telemetry(self, campaign_id: str, first: int = 0, limit: int = 1000) -> models.TelemetryPage:
        """What all vehicles said, from sample number ``first`` on."""
        path = f"/api/v1/campaigns/{campaign_id}/recording/telemetry"
        return await self._get(models.TelemetryPage, path, first=first, limit=limit)

    async def recorded_explanations(
        self, campaign_id: str, first: int = 0, limit: int = 500
    ) -> models.ExplanationsPage:
        """Decisions that were flown and why, from decision number ``first`` on."""
        path = f"/api/v1/campaigns/{campaign_id}/recording/explanations"
        return await self._get(models.ExplanationsPage, path, first=first, limit=limit)

    async def explanation(self, campaign_id: str) -> models.ExplanationView:
        """Why the policy chose what is being flown."""
        return await self._get(models.ExplanationView, f"/api/v1/campaigns/{campaign_id}/explanation")

    async def send_fixes(self, campaign_id: str, fixes: Sequence[Mapping[str, Any]]) -> models.FixesTaken:
        """Where live users were: ``user``, ``lat_deg``, ``lon_deg``, ``time``, if known ``pending_mb``."""
        return await self._post(models.FixesTaken, f"/api/v1/campaigns/{campaign_id}/fixes", calls.rows(fixes))

    async def send_uploads(self, campaign_id: str, receipts: Sequence[Mapping[str, Any]]) -> models.UploadsTaken:
        """Receipts of successful uploads: ``user``, ``time``, if known ``uploaded_mb``."""
        return await self._post(models.UploadsTaken, f"/api/v1/campaigns/{campaign_id}/uploads", calls.rows(receipts))

    async def send_departures(self, campaign_id: str, users: Sequence[Mapping[str, Any]]) -> models.DeparturesTaken:
        """Users who leave (``user``, ``time``): they take no part from the next slot on, their places are forgotten."""
        return await self._post(
            models.DeparturesTaken, f"/api/v1/campaigns/{campaign_id}/departures", calls.rows(users)
        )

    # Dry runs

    async def begin_dry_run(self, mission: calls.MissionLike, policy: str | None = None) -> models.DryRunView:
        """Fly a mission in the world model on the server; ``{"campaign": ID}`` for one that exists."""
        return await self._post(models.DryRunView, "/api/v1/dry-runs", calls.mission_body(mission, policy))

    async def dry_run(self, dry_run_id: str) -> models.DryRunView:
        """How far it is, and its forecast when it is done."""
        return await self._get(models.DryRunView, f"/api/v1/dry-runs/{dry_run_id}")

    async def dry_runs(self) -> list[models.DryRunView]:
        """Newest first; the last few are kept until the server ends."""
        return await self._get(list[models.DryRunView], "/api/v1/dry-runs")

    async def forecast(self, campaign_id: str) -> models.DryRunView:
        """The newest finished dry run of exactly this campaign's mission; 404 when there is none."""
        return await self._get(models.DryRunView, f"/api/v1/campaigns/{campaign_id}/forecast")

    async def cancel_dry_run(self, dry_run_id: str) -> models.DryRunView:
        """End it."""
        path = f"/api/v1/dry-runs/{dry_run_id}"
        return calls.parse(models.DryRunView, await self._send("DELETE", path))

    # Drones

    async def drones(self) -> list[models.VehicleView]:
        """Every vehicle ever heard, with the age of what is known."""
        return await self._get(list[models.VehicleView], "/api/v1/drones")

    async def drone(self, system_id: int) -> models.VehicleView:
        """One vehicle."""
        return await self._get(models.VehicleView, f"/api/v1/drones/{system_id}")

    async def command(
        self, system_id: int, command: str, *, altitude_m: float | None = None, force: bool = False
    ) -> models.VerdictBody:
        """``arm``, ``disarm``, ``takeoff``, ``hold``, ``rtl``, ``land`` or ``terminate``; the vehicle's own verdict.

        A refusal by the vehicle is an answer with ``accepted`` false, not an error.
        """
        body = calls.without_none({"command": command, "altitude_m": altitude_m, "force": force})
        return await self._post(models.VerdictBody, f"/api/v1/drones/{system_id}/commands", body)

    async def emergency_stop(self) -> models.Taken:
        """Every vehicle stops where it is; latched until it is reset."""
        return await self._post(models.Taken, "/api/v1/emergency-stop")

    async def reset_emergency_stop(self) -> models.Taken:
        """Take the latch off."""
        return await self._post(models.Taken, "/api/v1/emergency-stop/reset")

    async def emergency_stop_one(self, system_id: int) -> models.Taken:
        """One vehicle stops where it is, latched until it is reset; the others go on."""
        return await self._post(models.Taken, f"/api/v1/drones/{system_id}/emergency-stop")

    async def reset_emergency_stop_one(self, system_id: int) -> models.Taken:
        """Take the latch of one vehicle off."""
        return await self._post(models.Taken, f"/api/v1/drones/{system_id}/emergency-stop/reset")

    # What is at hand, the log, keys

    async def missions(self) -> list[models.MissionView]:
        """Missions at hand."""
        return await self._get(list[models.MissionView], "/api/v1/missions")

    async def mission(self, name: str) -> dict[str, Any]:
        """A mission at hand as a document, to change and to create a campaign from."""
        return await self._get(dict[str, Any], f"/api/v1/missions/{name}")

    async def policies(self) -> list[models.PolicyView]:
        """Policies at hand, with their models."""
        return await self._get(list[models.PolicyView], "/api/v1/policies")

    async def map_background(self) -> models.MapView:
        """What lies under the page's map."""
        return await self._get(models.MapView, "/api/v1/map")

    async def map_tiles(self, offset: int = 0, length: int | None = None) -> bytes:
        """Bytes of the PMTiles file that the server hands out, to its end without ``length``; 404 when it has none."""
        last = "" if length is None else offset + length - 1
        headers = {"range": f"bytes={offset}-{last}"}
        return (await self._send("GET", "/api/v1/map/tiles.pmtiles", headers=headers)).content

    async def events(
        self,
        *,
        campaign_id: str | None = None,
        severity: str | None = None,
        kind: str | None = None,
        since: datetime | None = None,
        after_id: int | None = None,
        limit: int = 200,
        newest: bool = False,
    ) -> models.EventPage:
        """A page of the audit log, oldest first; the rest with ``after_id=page.next_after_id``."""
        wanted = {"campaign_id": campaign_id, "severity": severity, "kind": kind, "since": since}
        more = {"after_id": after_id, "limit": limit, "newest": newest}
        return await self._get(models.EventPage, "/api/v1/events", **calls.without_none(wanted | more))

    async def acknowledge(self, sequence: int, time_s: float) -> models.Acknowledged:
        """Take note of a warning or caution of the stream."""
        body = {"sequence": sequence, "time_s": time_s}
        return await self._post(models.Acknowledged, "/api/v1/acknowledgements", body)

    async def keys(self) -> list[models.KeyView]:
        """Every key that ever was, without secrets; for admins, like the two below."""
        return await self._get(list[models.KeyView], "/api/v1/keys")

    async def add_key(self, name: str, role: str) -> models.NewKeyView:
        """A new key; its text is in this answer only."""
        return await self._post(models.NewKeyView, "/api/v1/keys", {"name": name, "role": role})

    async def revoke_key(self, key_id: str) -> None:
        """A revoked key stops working at once."""
        await self._send("DELETE", f"/api/v1/keys/{key_id}")

    async def me(self) -> models.SessionView:
        """Name and role of the key."""
        return await self._get(models.SessionView, "/api/v1/me")

    async def readiness(self) -> models.Readiness:
        """Whether the flight loop ticks and the store takes records; ``problems`` says what is not well."""
        return calls.parse(models.Readiness, await self._send("GET", "/readyz", good=frozenset({200, 503})))

    async def liveness(self) -> models.Liveness:
        """The process answers."""
        return await self._get(models.Liveness, "/healthz")

    # Stream

    async def stream(
        self, rate_hz: float = 5.0, topics: Sequence[str] = ("snapshot", "events")
    ) -> AsyncGenerator[calls.Message]:
        """Hello, then snapshots and events until the server ends the stream or the caller stops asking.

        Raises UnreachableError when there is no stream, or it breaks.
        """
        query = "&".join([f"rate_hz={rate_hz:g}", *(f"topics={topic}" for topic in topics)])
        address = f"{calls.stream_address(self.url)}?{query}"
        try:
            async with connect(address, additional_headers=calls.headers(self._key), proxy=None) as socket:
                async for text in socket:
                    found = calls.message(text)
                    if found is not None:
                        yield found
        except (OSError, WebSocketException) as error:
            raise UnreachableError(f"the stream of {self.url}: {error}") from error

    async def first(self, kind: type[T], rate_hz: float = 5.0) -> T:
        """The next message of one kind, for example ``models.SnapshotMessage``."""
        async with aclosing(self.stream(rate_hz)) as messages:
            async for found in messages:
                if isinstance(found, kind):
                    return found
        raise UnreachableError(f"the stream of {self.url} ended before a {kind.__name__} came")

    # Sending

    async def _get(self, answer: type[T], path: str, **query: Any) -> T:
        return calls.parse(answer, await self._send("GET", path, query=query))

    async def _post(self, answer: type[T], path: str, body: Any = None) -> T:
        return calls.parse(answer, await self._send("POST", path, body=body))

    async def _send(
        self,
        method: str,
        path: str,
        *,
        query: Mapping[str, Any] | None = None,
        body: Any = None,
        headers: Mapping[str, str] | None = None,
        good: frozenset[int] = frozenset(),
    ) -> httpx.Response:
        headers = {**(headers or {}), **({} if method == "GET" else calls.idempotency())}
        for attempt in range(calls.RETRIES):
            last = attempt == calls.RETRIES - 1
            response = None
            try:
                response = await self._http.request(method, path, params=query, json=body, headers=headers)
            except httpx.TransportError as error:
                if last:
                    raise UnreachableError(f"{self.url}: {error or type(error).__name__}") from error
            if response is not None and (response.status_code != httpx.codes.TOO_MANY_REQUESTS or last):
                if response.status_code not in good:
                    raise_problem(response)
                return response
            await asyncio.sleep(calls.wait_s(attempt, response))
        raise AssertionError("the last attempt returns or raises")
