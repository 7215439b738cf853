"""A small real flight control: one campaign at a time, vehicles that answer at once or when told to."""

import math
import threading
from concurrent.futures import Future
from dataclasses import replace
from typing import Any

from gcs.ports import (
    CampaignSnapshot,
    CampaignState,
    CommandKind,
    FlightMode,
    FlightSnapshot,
    Landed,
    OperatorRequest,
    RequestKind,
    RequestOutcome,
    SlotRecord,
    UavPlan,
    UserSlot,
    VehicleStatus,
    Verdict,
    VerdictResult,
)
from policy.world.metrics import Metrics

MOVES = {
    RequestKind.PAUSE: (CampaignState.FLYING, CampaignState.PAUSED),
    RequestKind.RESUME: (CampaignState.PAUSED, CampaignState.FLYING),
}
ABORTABLE = {CampaignState.LAUNCHING, CampaignState.FLYING, CampaignState.PAUSED}
METRICS = Metrics(5.5, 0.8, 0.4, 0.1, 6.5)


def vehicle(system_id: int) -> VehicleStatus:
    """Flying north-east over Purdue, heard 0.25 s ago."""
    return VehicleStatus(
        system_id,
        autopilot="px4",
        mode=FlightMode.GUIDED,
        mode_name="OFFBOARD",
        armed=True,
        landed=Landed.IN_AIR,
        lat_deg=40.4253,
        lon_deg=-86.92,
        alt_home_m=120.0,
        vel_ned_mps=(3.0, 4.0, 0.0),
        yaw_rad=-0.5,
        battery_fraction=0.75,
        heartbeat_s=9.75,
        position_s=9.9,
        texts=("Arm: not ready\x00",),
    )


class FakeControl:
    """ports.FlightControl; ``silent`` leaves requests unanswered, ``late`` makes the loop unhealthy."""

    def __init__(self, vehicles: int = 2) -> None:
        self._lock = threading.Lock()
        self._snapshot = FlightSnapshot(10.0, 100, tuple(vehicle(i + 1) for i in range(vehicles)))
        self.requests: list[OperatorRequest] = []
        self.unanswered: list[Future[RequestOutcome]] = []
        self.silent = self.late = False

    def snapshot(self) -> FlightSnapshot:
        return self._snapshot

    def healthy(self) -> bool:
        return not self.late

    def submit(self, request: OperatorRequest) -> Future[RequestOutcome]:
        future: Future[RequestOutcome] = Future()
        with self._lock:
            self.requests.append(request)
            if self.silent:
                self.unanswered.append(future)
            else:
                future.set_result(self._answer(request))
        return future

    def tick(self) -> None:
        """A tick of the loop."""
        with self._lock:
            self.publish(replace(self._snapshot, time_s=self._snapshot.time_s + 0.1))

    def end_slot(self, slot: int) -> SlotRecord:
        """The campaign comes to the end of a slot."""
        users = (UserSlot("u1", 10.0, 20.0, 3.0, 0.5, False), UserSlot("u2", math.nan, math.nan, 1.0, 0.0, True))
        record = SlotRecord(slot, 15.0 * slot, (), users, METRICS if slot else None)
        with self._lock:
            self._change(slot=slot, latest=record, metrics=METRICS)
        return record

    def finish(self) -> None:
        """The campaign is flown."""
        with self._lock:
            self._change(state=CampaignState.DONE)

    def _answer(self, request: OperatorRequest) -> RequestOutcome:
        state = None if self._snapshot.campaign is None else self._snapshot.campaign.state
        match request.kind:
            case RequestKind.START:
                return self._start(request)
            case RequestKind.COMMAND:
                return self._command(request)
            case RequestKind.EMERGENCY_STOP | RequestKind.RESET_STOP if request.system_id is not None:
                others = set(self._snapshot.stopped_ids) - {request.system_id}
                mine = {request.system_id} if request.kind is RequestKind.EMERGENCY_STOP else set()
                self.publish(replace(self._snapshot, stopped_ids=tuple(sorted(others | mine))))
                return RequestOutcome(True)
            case RequestKind.EMERGENCY_STOP | RequestKind.RESET_STOP:
                self.publish(replace(self._snapshot, stopped=request.kind is RequestKind.EMERGENCY_STOP))
                return RequestOutcome(True)
            case RequestKind.ABORT if state in ABORTABLE:
                self._change(state=CampaignState.RECOVERING)
                return RequestOutcome(True)
        before, after = MOVES.get(request.kind, (None, None))
        if after is None or state is not before:
            return RequestOutcome(False, f"cannot {request.kind} while {state}")
        self._change(state=after)
        return RequestOutcome(True)

    def _start(self, request: OperatorRequest) -> RequestOutcome:
        mission, campaign_id = request.mission, request.campaign_id
        assert mission is not None
        assert campaign_id is not None
        if self._snapshot.campaign is not None and self._snapshot.campaign.state is CampaignState.FLYING:
            return RequestOutcome(False, "another campaign is in the air")
        plan = UavPlan(1, -math.pi / 2, 12.0, ((0.0, 0.0), (10.0, 0.0)))
        campaign = CampaignSnapshot(
            campaign_id, mission.name, mission.policy, CampaignState.FLYING, 0, 4, 15.0, 0.0, plans=(plan,)
        )
        self.publish(replace(self._snapshot, campaign=campaign))
        return RequestOutcome(True)

    def _command(self, request: OperatorRequest) -> RequestOutcome:
        command = request.command
        assert command is not None
        if command.kind is CommandKind.TERMINATE and not command.force:
            return RequestOutcome(False, "terminate needs force while flying")
        if command.kind is CommandKind.ARM:
            return RequestOutcome(True, "", Verdict(command, VerdictResult.REFUSED, "Arm: GPS not ready", 1, 0.2))
        return RequestOutcome(True, "", Verdict(command, VerdictResult.ACCEPTED, "", 1, 0.1))

    def _change(self, **changes: Any) -> None:
        assert self._snapshot.campaign is not None
        self.publish(replace(self._snapshot, campaign=replace(self._snapshot.campaign, **changes)))

    def publish(self, snapshot: FlightSnapshot) -> None:
        """The newest."""
        self._snapshot = replace(snapshot, tick=self._snapshot.tick + 1)
