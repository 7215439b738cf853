"""Prometheus: what the flight, the journal and HTTP are doing. One registry an app, so that tests do not share."""

import time
from collections.abc import Iterable

from prometheus_client import CollectorRegistry, Counter, Gauge, Histogram
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from gcs.api.context import ApiContext
from gcs.ports import CampaignSnapshot, FlightSnapshot

METHODS = frozenset({"GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"})


class FlightCollector(Collector):
    """Reads the newest snapshot and counters when it is scraped."""

    def __init__(self, context: ApiContext) -> None:
        self._context = context

    def collect(self) -> Iterable[Metric]:
        """Everything about the flight and the journal."""
        snapshot = self._context.control.snapshot()
        yield from _flight_metrics(snapshot, self._context.control.healthy())
        yield from _vehicle_metrics(snapshot)
        if snapshot.campaign is not None:
            yield from _campaign_metrics(snapshot.campaign)
        yield from self._journal_metrics()

    def _journal_metrics(self) -> Iterable[Metric]:
        health, tail = self._context.store.journal.health(), self._context.store.tail
        yield GaugeMetricFamily("gcs_store_queued_records", "Records that wait for the store", health.queued)
        yield CounterMetricFamily("gcs_store_written_records", "Records written", health.written)
        yield CounterMetricFamily("gcs_store_lost_records", "Records lost", health.lost)
        yield CounterMetricFamily("gcs_store_skipped_samples", "Telemetry that was left out", health.skipped)
        yield CounterMetricFamily("gcs_store_failures", "Failed attempts to write", health.failures)
        events = CounterMetricFamily("gcs_events", "Events by kind and severity", labels=("kind", "severity"))
        for (kind, severity), count in tail.counts().items():
            events.add_metric((kind, severity), count)
        yield events


def _flight_metrics(snapshot: FlightSnapshot, healthy: bool) -> Iterable[Metric]:
    yield CounterMetricFamily("gcs_flight_ticks", "Ticks of the flight loop", snapshot.tick)
    yield GaugeMetricFamily("gcs_flight_healthy", "The flight loop ticks within its deadline", float(healthy))
    yield GaugeMetricFamily("gcs_emergency_stop", "Emergency stop latched", float(snapshot.stopped))
    if snapshot.setpoint_period_s is not None:
        yield GaugeMetricFamily("gcs_setpoint_period_seconds", "Newest, wall clock", snapshot.setpoint_period_s)


def _vehicle_metrics(snapshot: FlightSnapshot) -> Iterable[Metric]:
    loss = GaugeMetricFamily("gcs_link_loss_ratio", "Share of messages lost", labels=("system_id",))
    age = GaugeMetricFamily("gcs_heartbeat_age_seconds", "Since the last heartbeat", labels=("system_id",))
    battery = GaugeMetricFamily("gcs_battery_ratio", "Remaining", labels=("system_id",))
    for vehicle in snapshot.vehicles:
        label = (str(vehicle.system_id),)
        loss.add_metric(label, vehicle.loss_ratio)
        if vehicle.heartbeat_s is not None:
            age.add_metric(label, snapshot.time_s - vehicle.heartbeat_s)
        if vehicle.battery_fraction is not None:
            battery.add_metric(label, vehicle.battery_fraction)
    yield from (loss, age, battery)


def _campaign_metrics(campaign: CampaignSnapshot) -> Iterable[Metric]:
    yield GaugeMetricFamily("gcs_campaign_slot", "Present slot", campaign.slot)
    decisions = 0 if campaign.latest is None else campaign.latest.slot
    yield GaugeMetricFamily("gcs_campaign_decided_slots", "Slots decided and flown", decisions)
    if campaign.decision_ms is not None:
        yield GaugeMetricFamily("gcs_decision_seconds", "Newest decision", campaign.decision_ms / 1000.0)
    if campaign.metrics is not None:
        yield GaugeMetricFamily("gcs_campaign_aoi_slots", "Mean age of information", campaign.metrics.episodic_aoi)


class HttpMetrics:
    """ASGI: counts answers and measures them by route."""

    def __init__(self, app: ASGIApp, registry: CollectorRegistry) -> None:
        self._app = app
        labels = ("method", "route", "status")
        self._answers = Counter("gcs_http_answers", "HTTP answers", labels, registry=registry)
        self._seconds = Histogram("gcs_http_seconds", "Time to answer", ("route",), registry=registry)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """One request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        status, began_s = "500", time.perf_counter()

        async def watch(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = str(message["status"])
            await send(message)

        try:
            await self._app(scope, receive, watch)
        finally:
            route = getattr(scope.get("route"), "path", "none")  # a client's own words would be endless labels
            method = scope["method"] if scope["method"] in METHODS else "other"
            self._answers.labels(method, route, status).inc()
            self._seconds.labels(route).observe(time.perf_counter() - began_s)


def new_registry(context: ApiContext) -> tuple[CollectorRegistry, Gauge]:
    """The registry, and the gauge of stream clients."""
    registry = CollectorRegistry()
    registry.register(FlightCollector(context))
    return registry, Gauge("gcs_stream_clients", "Open streams", registry=registry)
