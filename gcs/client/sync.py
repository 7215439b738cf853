"""The client that waits. Written from ``aio.py`` by ``gcs/client/unasync.py``; change those."""

import time
from collections.abc import Generator, Mapping, Sequence
from contextlib import closing
from datetime import datetime
from types import TracebackType
from typing import Any, Self, TypeVar

import httpx
from websockets.exceptions import WebSocketException
from websockets.sync.client import connect

from gcs.client import calls, models
from gcs.client.errors import UnreachableError, raise_problem

T = TypeVar("T")


class Client:
    """One server. Use it in a ``with``, or close it.

    Calls raise :class:`~gcs.client.errors.ApiError` when the server says no and ``UnreachableError`` when it does not
    answer after three tries. Changes carry an Idempotency-Key, so a repeated try acts once; 429 is waited for.
    """

    def __init__(
        self,
        url: str = "http://127.0.0.1:8080",
        key: str | None = None,
        *,
        timeout_s: float = calls.TIMEOUT_S,
        transport: httpx.BaseTransport | None = None,
    ) -> None:
        self.url = url.rstrip("/")
        self._key = key
        self._http = httpx.Client(
            base_url=self.url, headers=calls.headers(key), timeout=calls.timeouts(timeout_s), transport=transport
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """End the connections."""
        self._http.close()

    # Campaigns

    def create(self, mission: calls.MissionLike, policy: str | None = None) -> models.CampaignFull:
        """A campaign from the name of a mission at hand, or from a mission document."""
        return self._post(models.CampaignFull, "/api/v1/campaigns", calls.mission_body(mission, policy))

    def campaigns(self, limit: int = 100, offset: int = 0) -> list[models.CampaignBrief]:
        """Newest first."""
        return self._get(list[models.CampaignBrief], "/api/v1/campaigns", limit=limit, offset=offset)

    def campaign(self, campaign_id: str) -> models.CampaignFull:
        """State, slot, metrics so far, the mission."""
        return self._get(models.CampaignFull, f"/api/v1/campaigns/{campaign_id}")

    def preflight(self, campaign_id: str) -> models.PreflightView:
        """The checklist with the drones as they are now."""
        return self._get(models.PreflightView, f"/api/v1/campaigns/{campaign_id}/preflight")

    def start(self, campaign_id: str, *, override: bool = False) -> models.Taken:
        """Launch; ``override`` takes off in spite of red pre-flight lines, for admins."""
        suffix = "?override=true" if override else ""
        return self._post(models.Taken, f"/api/v1/campaigns/{campaign_id}/start{suffix}")

    def pause(self, campaign_id: str) -> models.Taken:
        """Hold in place."""
        return self._post(models.Taken, f"/api/v1/campaigns/{campaign_id}/pause")

    def resume(self, campaign_id: str) -> models.Taken:
        """Go on after a pause."""
        return self._post(models.Taken, f"/api/v1/campaigns/{campaign_id}/resume")

    def abort(self, campaign_id: str) -> models.Taken:
        """All drones return and land; a campaign that never flew is struck off."""
        return self._post(models.Taken, f"/api/v1/campaigns/{campaign_id}/abort")

    def wait(self, campaign_id: str, *, poll_s: float = 1.0) -> models.CampaignFull:
        """Until it is done, aborted or failed."""
        while (found := self.campaign(campaign_id)).state not in calls.FINAL_STATES:
            time.sleep(poll_s)
        return found

    def report(self, campaign_id: str, *, places: bool = True) -> dict[str, Any]:
        """Metrics, slots, events, comparison, and how to fly it again."""
        return self._get(dict[str, Any], f"/api/v1/campaigns/{campaign_id}/report", places=places)

    def report_file(self, campaign_id: str, form: str, *, places: bool = True) -> bytes:
        """The report as ``html``, ``csv``, ``geojson`` or ``kml``."""
        query = {"format": form} | ({} if places else {"places": False})
        return (self._send("GET", f"/api/v1/campaigns/{campaign_id}/report", query=query)).content

    def series(self, campaign_id: str) -> list[models.SeriesPoint]:
        """A point a finished slot, without users."""
        return self._get(list[models.SeriesPoint], f"/api/v1/campaigns/{campaign_id}/series")

    def recording(self, campaign_id: str) -> models.RecordingView:
        """Area, state and log of a campaign with its slots' range; 409 when it was never started."""
        return self._get(models.RecordingView, f"/api/v1/campaigns/{campaign_id}/recording")

    def recorded_slots(self, campaign_id: str, first: int = 0, limit: int = 60) -> models.SlotsPage:
        """Slots with everybody's places from number ``first`` on; the rest with ``first=page.next_first``."""
        path = f"/api/v1/campaigns/{campaign_id}/recording/slots"
        return self._get(models.SlotsPage, path, first=first, limit=limit)

    def recorded_telemetry(self, campaign_id: str, first: int = 0, limit: int = 1000) -> models.TelemetryPage:
        """What all vehicles said, from sample number ``first`` on."""
        path = f"/api/v1/campaigns/{campaign_id}/recording/telemetry"
        return self._get(models.TelemetryPage, path, first=first, limit=limit)

    def recorded_explanations(self, campaign_id: str, first: int = 0, limit: int = 500) -> models.ExplanationsPage:
        """Decisions that were flown and why, from decision number ``first`` on."""
        path = f"/api/v1/campaigns/{campaign_id}/recording/explanations"
        return self._get(models.ExplanationsPage, path, first=first, limit=limit)

    def explanation(self, campaign_id: str) -> models.ExplanationView:
        """Why the policy chose what is being flown."""
        return self._get(models.ExplanationView, f"/api/v1/campaigns/{campaign_id}/explanation")

    def send_fixes(self, campaign_id: str, fixes: Sequence[Mapping[str, Any]]) -> models.FixesTaken:
        """Where live users were: ``user``, ``lat_deg``, ``lon_deg``, ``time``, if known ``pending_mb``."""
        return self._post(models.FixesTaken, f"/api/v1/campaigns/{campaign_id}/fixes", calls.rows(fixes))

    def send_uploads(self, campaign_id: str, receipts: Sequence[Mapping[str, Any]]) -> models.UploadsTaken:
        """Receipts of successful uploads: ``user``, ``time``, if known ``uploaded_mb``."""
        return self._post(models.UploadsTaken, f"/api/v1/campaigns/{campaign_id}/uploads", calls.rows(receipts))

    def send_departures(self, campaign_id: str, users: Sequence[Mapping[str, Any]]) -> models.DeparturesTaken:
        """Users who leave (``user``, ``time``): they take no part from the next slot on, their places are forgotten."""
        return self._post(models.DeparturesTaken, f"/api/v1/campaigns/{campaign_id}/departures", calls.rows(users))

    # Dry runs

    def begin_dry_run(self, mission: calls.MissionLike, policy: str | None = None) -> models.DryRunView:
        """Fly a mission in the world model on the server; ``{"campaign": ID}`` for one that exists."""
        return self._post(models.DryRunView, "/api/v1/dry-runs", calls.mission_body(mission, policy))

    def dry_run(self, dry_run_id: str) -> models.DryRunView:
        """How far it is, and its forecast when it is done."""
        return self._get(models.DryRunView, f"/api/v1/dry-runs/{dry_run_id}")

    def dry_runs(self) -> list[models.DryRunView]:
        """Newest first; the last few are kept until the server ends."""
        return self._get(list[models.DryRunView], "/api/v1/dry-runs")

    def forecast(self, campaign_id: str) -> models.DryRunView:
        """The newest finished dry run of exactly this campaign's mission; 404 when there is none."""
        return self._get(models.DryRunView, f"/api/v1/campaigns/{campaign_id}/forecast")

    def cancel_dry_run(self, dry_run_id: str) -> models.DryRunView:
        """End it."""
        path = f"/api/v1/dry-runs/{dry_run_id}"
        return calls.parse(models.DryRunView, self._send("DELETE", path))

    # Drones

    def drones(self) -> list[models.VehicleView]:
        """Every vehicle ever heard, with the age of what is known."""
        return self._get(list[models.VehicleView], "/api/v1/drones")

    def drone(self, system_id: int) -> models.VehicleView:
        """One vehicle."""
        return self._get(models.VehicleView, f"/api/v1/drones/{system_id}")

    def command(
        self, system_id: int, command: str, *, altitude_m: float | None = None, force: bool = False
    ) -> models.VerdictBody:
        """``arm``, ``disarm``, ``takeoff``, ``hold``, ``rtl``, ``land`` or ``terminate``; the vehicle's own verdict.

        A refusal by the vehicle is an answer with ``accepted`` false, not an error.
        """
        body = calls.without_none({"command": command, "altitude_m": altitude_m, "force": force})
        return self._post(models.VerdictBody, f"/api/v1/drones/{system_id}/commands", body)

    def emergency_stop(self) -> models.Taken:
        """Every vehicle stops where it is; latched until it is reset."""
        return self._post(models.Taken, "/api/v1/emergency-stop")

    def reset_emergency_stop(self) -> models.Taken:
        """Take the latch off."""
        return self._post(models.Taken, "/api/v1/emergency-stop/reset")

    def emergency_stop_one(self, system_id: int) -> models.Taken:
        """One vehicle stops where it is, latched until it is reset; the others go on."""
        return self._post(models.Taken, f"/api/v1/drones/{system_id}/emergency-stop")

    def reset_emergency_stop_one(self, system_id: int) -> models.Taken:
        """Take the latch of one vehicle off."""
        return self._post(models.Taken, f"/api/v1/drones/{system_id}/emergency-stop/reset")

    # What is at hand, the log, keys

    def missions(self) -> list[models.MissionView]:
        """Missions at hand."""
        return self._get(list[models.MissionView], "/api/v1/missions")

    def mission(self, name: str) -> dict[str, Any]:
        """A mission at hand as a document, to change and to create a campaign from."""
        return self._get(dict[str, Any], f"/api/v1/missions/{name}")

    def policies(self) -> list[models.PolicyView]:
        """Policies at hand, with their models."""
        return self._get(list[models.PolicyView], "/api/v1/policies")

    def map_background(self) -> models.MapView:
        """What lies under the page's map."""
        return self._get(models.MapView, "/api/v1/map")

    def map_tiles(self, offset: int = 0, length: int | None = None) -> bytes:
        """Bytes of the PMTiles file that the server hands out, to its end without ``length``; 404 when it has none."""
        last = "" if length is None else offset + length - 1
        headers = {"range": f"bytes={offset}-{last}"}
        return (self._send("GET", "/api/v1/map/tiles.pmtiles", headers=headers)).content

    def events(
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
        return self._get(models.EventPage, "/api/v1/events", **calls.without_none(wanted | more))

    def acknowledge(self, sequence: int, time_s: float) -> models.Acknowledged:
        """Take note of a warning or caution of the stream."""
        body = {"sequence": sequence, "time_s": time_s}
        return self._post(models.Acknowledged, "/api/v1/acknowledgements", body)

    def keys(self) -> list[models.KeyView]:
        """Every key that ever was, without secrets; for admins, like the two below."""
        return self._get(list[models.KeyView], "/api/v1/keys")

    def add_key(self, name: str, role: str) -> models.NewKeyView:
        """A new key; its text is in this answer only."""
        return self._post(models.NewKeyView, "/api/v1/keys", {"name": name, "role": role})

    def revoke_key(self, key_id: str) -> None:
        """A revoked key stops working at once."""
        self._send("DELETE", f"/api/v1/keys/{key_id}")

    def me(self) -> models.SessionView:
        """Name and role of the key."""
        return self._get(models.SessionView, "/api/v1/me")

    def readiness(self) -> models.Readiness:
        """Whether the flight loop ticks and the store takes records; ``problems`` says what is not well."""
        return calls.parse(models.Readiness, self._send("GET", "/readyz", good=frozenset({200, 503})))

    def liveness(self) -> models.Liveness:
        """The process answers."""
        return self._get(models.Liveness, "/healthz")

    # Stream

    def stream(self, rate_hz: float = 5.0, topics: Sequence[str] = ("snapshot", "events")) -> Generator[calls.Message]:
        """Hello, then snapshots and events until the server ends the stream or the caller stops asking.

        Raises UnreachableError when there is no stream, or it breaks.
        """
        query = "&".join([f"rate_hz={rate_hz:g}", *(f"topics={topic}" for topic in topics)])
        address = f"{calls.stream_address(self.url)}?{query}"
        try:
            with connect(address, additional_headers=calls.headers(self._key), proxy=None) as socket:
                for text in socket:
                    found = calls.message(text)
                    if found is not None:
                        yield found
        except (OSError, WebSocketException) as error:
            raise UnreachableError(f"the stream of {self.url}: {error}") from error

    def first(self, kind: type[T], rate_hz: float = 5.0) -> T:
        """The next message of one kind, for example ``models.SnapshotMessage``."""
        with closing(self.stream(rate_hz)) as messages:
            for found in messages:
                if isinstance(found, kind):
                    return found
        raise UnreachableError(f"the stream of {self.url} ended before a {kind.__name__} came")

    # Sending

    def _get(self, answer: type[T], path: str, **query: Any) -> T:
        return calls.parse(answer, self._send("GET", path, query=query))

    def _post(self, answer: type[T], path: str, body: Any = None) -> T:
        return calls.parse(answer, self._send("POST", path, body=body))

    def _send(
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
                response = self._http.request(method, path, params=query, json=body, headers=headers)
            except httpx.TransportError as error:
                if last:
                    raise UnreachableError(f"{self.url}: {error or type(error).__name__}") from error
            if response is not None and (response.status_code != httpx.codes.TOO_MANY_REQUESTS or last):
                if response.status_code not in good:
                    raise_problem(response)
                return response
            time.sleep(calls.wait_s(attempt, response))
        raise AssertionError("the last attempt returns or raises")
