"""A small real flight for the page: a campaign of the world model, replayed on the wall clock, that takes orders."""

import math
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from gcs.ports import (
    CampaignSnapshot,
    CampaignState,
    Event,
    FlightMode,
    FlightSnapshot,
    Journal,
    Landed,
    OperatorRequest,
    RequestKind,
    RequestOutcome,
    Severity,
    SlotRecord,
    UavPlan,
    UavSlot,
    UserSlot,
    VehicleStatus,
    Verdict,
    VerdictResult,
)
from policy.agents.base import Agent, Decision
from policy.evaluation.rollout import CampaignRecord, fly
from policy.mission_file import Mission, open_campaign
from policy.mobility.traces import UserTraces
from policy.world.metrics import campaign_metrics
from policy.world.scenario import Scenario
from policy.world.state import JointAction, WorldState

WALL_SLOT_S = 0.4
"""A slot of 15 s of flight takes this long in a test."""

MOVES = {
    RequestKind.PAUSE: ({CampaignState.FLYING}, CampaignState.PAUSED),
    RequestKind.RESUME: ({CampaignState.PAUSED}, CampaignState.FLYING),
    RequestKind.ABORT: ({CampaignState.FLYING, CampaignState.PAUSED}, CampaignState.RECOVERING),
}


def slot_records(flown: CampaignRecord) -> tuple[SlotRecord, ...]:
    """The rollout in ground control's words, with the metrics so far."""
    scenario = flown.scenario
    data_mb = np.stack([state.user_data_mb for state in flown.states[1:]])
    records = []
    for slot, state in enumerate(flown.states):
        used_j = scenario.battery_j - state.uav_energy_j
        before = max(0, slot - 1)
        uavs = tuple(
            UavSlot(
                uav + 1,
                *map(float, state.uav_pos_enu_m[uav]),
                math.degrees(flown.heading_rad[before][uav]),
                float(flown.speed_mps[before][uav]),
                float(used_j[uav]),
            )
            for uav in range(scenario.num_uavs)
        )
        served = flown.served[before] & (slot > 0)
        users = tuple(
            UserSlot(
                f"u{i}", *map(float, at), float(state.user_aoi_slots[i]), float(state.user_data_mb[i]), bool(served[i])
            )
            for i, at in enumerate(state.user_pos_enu_m)
        )
        scored = slot and campaign_metrics(
            scenario, flown.aoi_slots[:slot], data_mb[:slot], flown.served[:slot], np.asarray(used_j)
        )
        records.append(SlotRecord(slot, slot * scenario.slot_s, uavs, users, scored or None, 2.0 if slot else None))
    return tuple(records)


class Sight:
    """Users' places for a rollout."""

    def __init__(self, traces: UserTraces) -> None:
        self._traces = traces

    def positions(self, sample: int) -> np.ndarray:
        return np.asarray(self._traces.pos_enu_m[sample], dtype=np.float64)


class Rounds:
    """Ports of call on two circles, one a UAV: quick, and something to look at."""

    name = "rounds"

    def reset(self, scenario: Scenario, seed: int) -> None:
        self._middle_m = 0.5 * np.asarray(scenario.area.size_m)
        self._reach_m = scenario.max_speed_mps * scenario.slot_s
        self._slot_s = scenario.slot_s

    def decide(self, state: WorldState) -> Decision:
        uavs = np.arange(state.uav_pos_enu_m.shape[0])
        angle_rad = 0.6 * (state.slot + 1) * (1.0 - 2.0 * (uavs % 2)) + np.pi * uavs
        radius_m = self._middle_m.min() * (0.75 - 0.2 * uavs)
        aim_m = self._middle_m + radius_m[:, None] * np.stack((np.sin(angle_rad), np.cos(angle_rad)), axis=-1)
        way_m = aim_m - state.uav_pos_enu_m
        distance_m = np.minimum(np.linalg.norm(way_m, axis=-1), self._reach_m)
        return Decision(JointAction(np.arctan2(way_m[:, 0], way_m[:, 1]), distance_m / self._slot_s))


def reasons(record: SlotRecord) -> dict[str, Any]:
    """As gcrl tells them: each UAV attends to the users near it, and could have flown otherwise at a price."""
    places_m = np.array([(user.east_m, user.north_m) for user in record.users])
    relations = []
    for uav in record.uavs:
        distance_m = np.hypot(places_m[:, 0] - uav.east_m, places_m[:, 1] - uav.north_m)
        near = np.argsort(distance_m)[:5]
        relations.append([{"user": int(i), "weight": float(np.exp(-distance_m[i] / 400.0))} for i in near])
    uavs = [
        {
            "uav": index,
            "path_enu_m": [[uav.east_m + 150.0, uav.north_m], [uav.east_m + 300.0, uav.north_m]],
            "alternatives": [
                {"heading_deg": 45.0 * k, "speed_mps": 18.0, "value": 12.0 + 0.3 * k, "worse_by": 0.3 * k}
                for k in range(1, 7)
            ],
        }
        for index, uav in enumerate(record.uavs)
    ]
    ahead = [[user.east_m + 30.0, user.north_m + 20.0] for user in record.users]
    head = {"horizon_slots": 8, "value": 12.0, "predicted_gain": 0.2}
    return {**head, "uavs": uavs, "relations": relations, "predicted_user_enu_m": ahead}


class MovingFlight:
    """ports.FlightControl. ``lose`` silences a vehicle, ``battery`` sets its charge; ``pilot`` makes the agent."""

    def __init__(
        self,
        journal: Journal,
        pilot: Callable[[str], Agent] = lambda _: Rounds(),
        origin_deg: tuple[float, float] = (47.396, 8.54),
    ) -> None:
        self._journal, self._pilot, self._origin_deg = journal, pilot, origin_deg
        self._lock = threading.RLock()
        self._begun_s = self._counted_s = time.monotonic()
        self._flown_s = 0.0  # flight seconds since the campaign began; stands still while paused or stopped
        self._scenario: Scenario | None = None
        self._records: tuple[SlotRecord, ...] = ()
        self._campaign: CampaignSnapshot | None = None
        self._told_slot = -1
        self._stopped = False
        self._stopped_ids: frozenset[int] = frozenset()
        self._tick = 0
        self._lost_at: dict[int, float] = {}
        self.battery: dict[int, float] = {}
        self.requests: list[OperatorRequest] = []

    def healthy(self) -> bool:
        return True

    def lose(self, system_id: int) -> None:
        """Nothing more is heard of this vehicle."""
        with self._lock:
            self._lost_at[system_id] = self._now_s()
            lost = Event(self._now_s(), "link.lost", f"UAV {system_id} is not heard any more", Severity.WARNING)
            self._journal.record(replace(lost, system_id=system_id))

    def finish(self) -> None:
        """Everybody has landed."""
        self._move_to(CampaignState.DONE)

    def fly_on(self) -> None:
        """The campaign is in the air again."""
        self._move_to(CampaignState.FLYING)

    def _move_to(self, state: CampaignState) -> None:
        with self._lock:
            assert self._campaign is not None
            self._advance()
            self._enter(self._campaign, state)

    def snapshot(self) -> FlightSnapshot:
        with self._lock:
            self._advance()
            self._tick += 1
            vehicles = tuple(self._vehicle(system_id) for system_id in (1, 2))
            stopped_ids = tuple(sorted(self._stopped_ids))
            campaign = self._seen_campaign()
            return FlightSnapshot(self._now_s(), self._tick, vehicles, campaign, self._stopped, stopped_ids, 0.1)

    def submit(self, request: OperatorRequest) -> Future[RequestOutcome]:
        future: Future[RequestOutcome] = Future()
        with self._lock:
            self._advance()
            self.requests.append(request)
            future.set_result(self._answer(request))
        return future

    def _now_s(self) -> float:
        return 100.0 + time.monotonic() - self._begun_s

    def _advance(self) -> None:
        now_s = time.monotonic()
        campaign, scenario = self._campaign, self._scenario
        if campaign and scenario and campaign.state is CampaignState.FLYING and not self._stopped:
            self._flown_s += (now_s - self._counted_s) * scenario.slot_s / WALL_SLOT_S
            self._flown_s = min(self._flown_s, scenario.slots * scenario.slot_s)
            self._tell_slots(campaign.campaign_id)
        self._counted_s = now_s

    def _tell_slots(self, campaign_id: str) -> None:
        while self._told_slot < self._slot():
            self._told_slot += 1
            self._journal.record_slot(campaign_id, self._records[self._told_slot])

    def _slot(self) -> int:
        assert self._scenario is not None
        return int(self._flown_s // self._scenario.slot_s)

    def _seen_campaign(self) -> CampaignSnapshot | None:
        if self._campaign is None or self._scenario is None:
            return None
        slot = self._slot()
        record = self._records[slot]
        return replace(
            self._campaign,
            slot=slot,
            slot_elapsed_s=self._flown_s - slot * self._scenario.slot_s,
            metrics=record.metrics,
            latest=record,
            decision_ms=record.decision_ms,
            plans=self._plans(slot),
            explanation=reasons(record),
        )

    def _plans(self, slot: int) -> tuple[UavPlan, ...]:
        here, there = self._records[slot], self._records[min(slot + 1, len(self._records) - 1)]
        return tuple(
            UavPlan(
                b.system_id, math.radians(b.heading_deg), b.speed_mps, ((a.east_m, a.north_m), (b.east_m, b.north_m))
            )
            for a, b in zip(here.uavs, there.uavs, strict=True)
        )

    def _vehicle(self, system_id: int) -> VehicleStatus:
        now_s = self._now_s()
        heard_s = self._lost_at.get(system_id, now_s - 0.2)
        still = VehicleStatus(
            system_id,
            autopilot="px4",
            mode=FlightMode.HOLD,
            mode_name="AUTO.LOITER",
            position_ready=True,
            parameters_settled=True,
            landed=Landed.ON_GROUND,
            lat_deg=self._origin_deg[0] + 0.0054,
            lon_deg=self._origin_deg[1] + 0.0106,
            alt_home_m=0.0,
            home_lat_deg=self._origin_deg[0] + 0.0054,
            home_lon_deg=self._origin_deg[1] + 0.0106,
            battery_fraction=self.battery.get(system_id, 0.82),
            heartbeat_s=heard_s,
            position_s=heard_s,
            loss_ratio=0.01,
        )
        return self._flying(still, system_id) if self._campaign and self._scenario else still

    def _flying(self, still: VehicleStatus, system_id: int) -> VehicleStatus:
        assert self._scenario is not None
        slots = self._flown_s / self._scenario.slot_s
        before, after = list(pairwise(self._records))[min(int(slots), len(self._records) - 2)]
        a, b = before.uavs[system_id - 1], after.uavs[system_id - 1]
        share = slots - before.slot
        east_m, north_m = a.east_m + share * (b.east_m - a.east_m), a.north_m + share * (b.north_m - a.north_m)
        lat_deg, lon_deg = self._scenario.area.frame.to_geodetic_deg(np.float64(east_m), np.float64(north_m))
        heading_rad = math.atan2(b.east_m - a.east_m, b.north_m - a.north_m)
        speed_mps = math.dist((a.east_m, a.north_m), (b.east_m, b.north_m)) / self._scenario.slot_s
        return replace(
            still,
            mode=FlightMode.GUIDED,
            mode_name="OFFBOARD",
            armed=True,
            landed=Landed.IN_AIR,
            lat_deg=float(lat_deg),
            lon_deg=float(lon_deg),
            alt_home_m=125.0 - 5.0 * system_id,
            vel_ned_mps=(speed_mps * math.cos(heading_rad), speed_mps * math.sin(heading_rad), 0.0),
            yaw_rad=heading_rad,
        )

    def _answer(self, request: OperatorRequest) -> RequestOutcome:
        match request.kind:
            case RequestKind.START:
                return self._start(request)
            case RequestKind.COMMAND:
                assert request.command is not None
                words = "Mode change denied: no GPS"
                return RequestOutcome(True, "", Verdict(request.command, VerdictResult.REFUSED, words, 1, 0.2))
            case RequestKind.EMERGENCY_STOP | RequestKind.RESET_STOP if request.system_id is not None:
                one = {request.system_id}
                self._stopped_ids = (
                    self._stopped_ids | one if request.kind == "emergency_stop" else self._stopped_ids - one
                )
                return RequestOutcome(True)
            case RequestKind.EMERGENCY_STOP | RequestKind.RESET_STOP:
                self._stopped = request.kind is RequestKind.EMERGENCY_STOP
                return RequestOutcome(True)
        allowed, after = MOVES[request.kind]
        if self._campaign is None or self._campaign.state not in allowed:
            return RequestOutcome(False, f"cannot {request.kind} now")
        self._enter(self._campaign, after)
        return RequestOutcome(True)

    def _start(self, request: OperatorRequest) -> RequestOutcome:
        assert isinstance(request.mission, Mission)
        assert request.campaign_id is not None
        mission = request.mission
        scenario, traces = open_campaign(mission)
        assert traces is not None
        self._records = slot_records(fly(scenario, Sight(traces), self._pilot(mission.policy)))
        self._scenario, self._flown_s, self._told_slot = scenario, 0.0, -1
        self._counted_s = time.monotonic()
        campaign = CampaignSnapshot(
            request.campaign_id,
            mission.name,
            mission.policy,
            CampaignState.READY,
            0,
            scenario.slots,
            scenario.slot_s,
            0.0,
        )
        self._enter(campaign, CampaignState.FLYING)
        return RequestOutcome(True)

    def _enter(self, campaign: CampaignSnapshot, state: CampaignState) -> None:
        words = f"{campaign.name}: {campaign.state} to {state}"
        self._journal.record(Event(self._now_s(), "campaign.state", words, campaign_id=campaign.campaign_id))
        self._campaign = replace(campaign, state=state)
