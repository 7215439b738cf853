"""A campaign's books: data and AoI of every user, energy of every UAV, slot by slot (Eq. 3-7).

The same functions as in evaluation (``policy.world.transition.serve``), fed with where the vehicles really are.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from gcs.ports import SlotRecord, UavSlot, UserPlaces, UserSlot
from policy.world.arrays import Array, BoolArray, FloatArray
from policy.world.metrics import Metrics, campaign_metrics
from policy.world.scenario import Scenario
from policy.world.state import WorldState, initial_state
from policy.world.transition import serve


@dataclass(frozen=True)
class FleetState:
    """The UAVs in the order of the campaign: arrays [U, 2], [U, 2], [U], bool [U]."""

    pos_enu_m: FloatArray
    vel_enu_mps: FloatArray
    energy_used_j: FloatArray
    active: BoolArray


class CampaignLedger:
    """Opens with the state at the first slot's start; :meth:`close_slot` once for every slot."""

    def __init__(
        self,
        scenario: Scenario,
        places: UserPlaces,
        user_ids: tuple[str, ...],
        system_ids: tuple[int, ...],
        fleet: FleetState,
    ) -> None:
        if not len(user_ids) == places.num_users == scenario.num_users:
            raise ValueError(f"{len(user_ids)} user ids, {places.num_users} places and {scenario.num_users} rates")
        self.scenario = scenario
        self._places = places
        self._user_ids = user_ids
        self._system_ids = system_ids
        self._state = _with_fleet(initial_state(scenario, places.positions(0)), fleet, scenario)
        self._aoi: list[FloatArray] = []
        self._data_mb: list[FloatArray] = []
        self._served: list[BoolArray] = []

    def reopen(self, records: Sequence[SlotRecord]) -> None:
        """Take the books over from ``records`` (slots 0, 1, 2 ... without a gap), in place of the opening state."""
        if [record.slot for record in records] != list(range(len(records))) or not records:
            raise ValueError(f"the records hold slots {[record.slot for record in records]}, not 0, 1, 2 ...")
        for record in records[1:]:
            self._places.positions(record.slot)  # a trace reveals one sample after the other
            self._aoi.append(np.array([user.aoi_slots for user in record.users]))
            self._data_mb.append(np.array([user.data_mb for user in record.users]))
            self._served.append(np.array([user.served for user in record.users], dtype=np.bool_))
        last = records[-1]
        self._state = replace(
            self._state,
            slot=last.slot,
            user_pos_enu_m=np.array([(user.east_m, user.north_m) for user in last.users]),
            user_data_mb=np.array([user.data_mb for user in last.users]),
            user_aoi_slots=np.array([user.aoi_slots for user in last.users]),
        )

    @property
    def slots_closed(self) -> int:
        """How many slots are in the books."""
        return len(self._aoi)

    def state(self, fleet: FleetState) -> WorldState:
        """What the policy may know at the start of the present slot: users up to the present sample only."""
        self._state = _with_fleet(self._state, fleet, self.scenario)
        return self._state

    def close_slot(self, fleet: FleetState) -> BoolArray:
        """The end of a slot: users at sample t+1, UAVs where they are now. Returns who was served, [M]."""
        before = self._state
        next_pos_m = self._places.positions(before.slot + 1)
        (data_mb, aoi), served = serve(self.scenario, before, fleet.pos_enu_m, fleet.active, next_pos_m)
        moved = replace(
            before, slot=before.slot + 1, user_pos_enu_m=next_pos_m, user_data_mb=data_mb, user_aoi_slots=aoi
        )
        self._state = _with_fleet(moved, fleet, self.scenario)
        self._aoi.append(aoi)
        self._data_mb.append(data_mb)
        self._served.append(served)
        return np.asarray(served, dtype=np.bool_)

    def metrics(self, energy_used_j: FloatArray) -> Metrics | None:
        """Eq. 5-7 over the slots closed so far; None before the first."""
        if not self._aoi:
            return None
        return campaign_metrics(
            self.scenario, np.stack(self._aoi), np.stack(self._data_mb), np.stack(self._served), energy_used_j
        )

    def record(self, time_s: float, fleet: FleetState, decision_ms: float | None) -> SlotRecord:
        """The books after the newest slot, for store, page and trajectory file."""
        served = self._served[-1] if self._served else np.zeros(len(self._user_ids), dtype=np.bool_)
        return SlotRecord(
            slot=self._state.slot,
            time_s=time_s,
            uavs=tuple(self._uav_slot(i, fleet) for i in range(len(self._system_ids))),
            users=_user_slots(self._user_ids, self._state, served),
            metrics=self.metrics(fleet.energy_used_j),
            decision_ms=decision_ms,
        )

    def _uav_slot(self, index: int, fleet: FleetState) -> UavSlot:
        east_mps, north_mps = (float(v) for v in fleet.vel_enu_mps[index])
        return UavSlot(
            system_id=self._system_ids[index],
            east_m=float(fleet.pos_enu_m[index, 0]),
            north_m=float(fleet.pos_enu_m[index, 1]),
            heading_deg=math.degrees(math.atan2(east_mps, north_mps)) % 360.0,
            speed_mps=math.hypot(east_mps, north_mps),
            energy_j=float(fleet.energy_used_j[index]),
            active=bool(fleet.active[index]),
        )


def _user_slots(user_ids: tuple[str, ...], state: WorldState, served: Array) -> tuple[UserSlot, ...]:
    columns = zip(
        user_ids,
        state.user_pos_enu_m.tolist(),
        state.user_aoi_slots.tolist(),
        state.user_data_mb.tolist(),
        np.asarray(served).tolist(),
        strict=True,
    )
    return tuple(UserSlot(uid, pos[0], pos[1], aoi, data, hit) for uid, pos, aoi, data, hit in columns)


def _with_fleet(state: WorldState, fleet: FleetState, scenario: Scenario) -> WorldState:
    return replace(
        state,
        uav_pos_enu_m=fleet.pos_enu_m,
        uav_vel_enu_mps=fleet.vel_enu_mps,
        uav_energy_j=np.clip(scenario.battery_j - fleet.energy_used_j, 0.0, None),
        uav_active=fleet.active,
    )
