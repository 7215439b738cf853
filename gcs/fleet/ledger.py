"""A campaign's books: data and AoI of every user, energy of every UAV, slot by slot (Eq. 3-7).

The same functions as in evaluation (``policy.world.transition.serve``), fed with where the vehicles really are.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gcs.ports import LivePlaces, SlotRecord, UavSlot, UserPlaces, UserSlot
from policy.world.arrays import Array, BoolArray, FloatArray
from policy.world.freshness import INITIAL_AOI_SLOTS, next_aoi_slots, next_data_mb
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
        self._live = places if isinstance(places, LivePlaces) else None
        self._last_m = np.tile(0.5 * np.asarray(scenario.area.size_m), (scenario.num_users, 1))
        self._joined = len(user_ids)
        self._state = self._with_joined(_with_fleet(initial_state(scenario, self._places_at(0)), fleet, scenario))
        self._present: list[BoolArray] = []
        self._aoi: list[FloatArray] = []
        self._data_mb: list[FloatArray] = []
        self._served: list[BoolArray] = []

    def reopen(self, records: Sequence[SlotRecord]) -> None:
        """Take the books over from ``records`` (slots 0, 1, 2 ... without a gap), in place of the opening state."""
        if [record.slot for record in records] != list(range(len(records))) or not records:
            raise ValueError(f"the records hold slots {[record.slot for record in records]}, not 0, 1, 2 ...")
        places_m, state = self._state.user_pos_enu_m, self._state
        for record in records:
            places_m = self._places_at(record.slot)  # a trace reveals one sample after the other
            state = self._recorded(state, record)
            if record.slot > 0:
                self._aoi.append(state.user_aoi_slots)
                self._data_mb.append(state.user_data_mb)
                self._present.append(state.user_active)
                self._served.append(self._column([user.served for user in record.users], False, np.bool_))
        known = [(user.east_m, user.north_m) for user in records[-1].users]
        known_m = np.reshape(known, (-1, 2))
        places_m[: len(known)] = np.where(np.isnan(known_m), places_m[: len(known)], known_m)
        self._joined = len(known) if self._live is not None else self._joined
        self._state = replace(state, user_pos_enu_m=places_m)

    def _recorded(self, state: WorldState, record: SlotRecord) -> WorldState:
        return replace(
            state,
            slot=record.slot,
            user_data_mb=self._column([user.data_mb for user in record.users], 0.0, np.float64),
            user_aoi_slots=self._column([user.aoi_slots for user in record.users], INITIAL_AOI_SLOTS, np.float64),
            user_active=self._column([user.active for user in record.users], False, np.bool_),
        )

    def _column(self, values: Sequence[float], rest: float, dtype: type) -> Any:
        """[M]: rows of a record, and ``rest`` for who had not joined."""
        return np.array([*values, *[rest] * (self.scenario.num_users - len(values))], dtype=dtype)

    def _places_at(self, sample: int) -> FloatArray:
        """[M, 2]; who left stays where he was last, and rows that nobody has taken lie in the middle: no part taken."""
        pos_m = np.array(self._places.positions(sample), dtype=np.float64)
        if self._live is not None:
            unknown = np.isnan(pos_m).any(axis=-1)
            pos_m[unknown] = self._last_m[unknown]
            self._last_m = pos_m.copy()
        return pos_m

    def _with_joined(self, state: WorldState) -> WorldState:
        """Live users take part from the slot that begins after their first fix, with AoI 1 and no data.

        Who left takes no part from the slot that begins after it: his AoI and data stand still until he comes back.
        """
        if self._live is None:
            return state
        present, self._joined = self._live.present(), len(self._live.user_ids())
        came = present & ~np.asarray(state.user_active)
        pos_m = np.where(came[:, None], self._places_at(state.slot), state.user_pos_enu_m)
        return replace(state, user_active=present, user_pos_enu_m=pos_m)

    @property
    def slots_closed(self) -> int:
        """How many slots are in the books."""
        return len(self._aoi)

    def state(self, fleet: FleetState) -> WorldState:
        """What the policy may know at the start of the present slot: users up to the present sample only."""
        self._state = self._with_joined(_with_fleet(self._state, fleet, self.scenario))
        return self._state

    def close_slot(self, fleet: FleetState) -> BoolArray:
        """The end of a slot: users at sample t+1, UAVs where they are now. Returns who was served, [M]."""
        before = self._state
        next_pos_m = self._places_at(before.slot + 1)
        (data_mb, aoi), served = serve(self.scenario, before, fleet.pos_enu_m, fleet.active, next_pos_m)
        if self._live is not None:
            data_mb, aoi, served = self._by_receipts(before, served)
        moved = replace(
            before, slot=before.slot + 1, user_pos_enu_m=next_pos_m, user_data_mb=data_mb, user_aoi_slots=aoi
        )
        self._state = _with_fleet(moved, fleet, self.scenario)
        self._aoi.append(aoi)
        self._present.append(before.user_active)
        self._data_mb.append(data_mb)
        self._served.append(served)
        return np.asarray(served, dtype=np.bool_)

    def _by_receipts(self, before: WorldState, served: BoolArray) -> tuple[FloatArray, FloatArray, BoolArray]:
        """Data, AoI and success: told by receipts for who sends them, by the channel model (Eq. 1-3) for the rest."""
        assert self._live is not None
        uploaded, tells = self._live.take_receipts()
        happened = np.where(tells, uploaded, served) & before.user_active
        data_mb: FloatArray = next_data_mb(
            before.user_data_mb, happened, np.asarray(self.scenario.collect_mbps), self.scenario.slot_s
        )
        aoi: FloatArray = next_aoi_slots(before.user_aoi_slots, happened)
        keep: BoolArray = np.asarray(before.user_active, dtype=np.bool_)
        return np.where(keep, data_mb, before.user_data_mb), np.where(keep, aoi, before.user_aoi_slots), happened

    def metrics(self, energy_used_j: FloatArray) -> Metrics | None:
        """Eq. 5-7 over the slots closed so far; None before the first."""
        if not self._aoi:
            return None
        if not np.all(self._present):
            return self._joined_metrics(energy_used_j)
        return campaign_metrics(
            self.scenario, np.stack(self._aoi), np.stack(self._data_mb), np.stack(self._served), energy_used_j
        )

    def _joined_metrics(self, energy_used_j: FloatArray) -> Metrics | None:
        """Eq. 5-7 over the slots in which each user took part; None while nobody does."""
        present = np.stack(self._present)
        if not present.any():
            return None
        aoi, served = np.stack(self._aoi), np.stack(self._served)
        offered_mb = self.scenario.slot_s * float(np.sum(present * np.asarray(self.scenario.collect_mbps)))
        left_mb = float(np.sum(self._data_mb[-1][present.any(axis=0)]))  # of who left, too
        return Metrics(
            episodic_aoi=float(np.mean(aoi[present])),
            data_collection_ratio=1.0 - left_mb / offered_mb,
            user_coverage=float(np.mean(served[present])),
            energy_ratio=float(np.mean(energy_used_j)) / self.scenario.battery_j,
            final_aoi=float(np.mean(aoi[-1][present[-1]])) if present[-1].any() else math.nan,
        )

    def record(self, time_s: float, fleet: FleetState, decision_ms: float | None) -> SlotRecord:
        """The books after the newest slot, for store, page and trajectory file."""
        served = self._served[-1] if self._served else np.zeros(len(self._user_ids), dtype=np.bool_)
        return SlotRecord(
            slot=self._state.slot,
            time_s=time_s,
            uavs=tuple(self._uav_slot(i, fleet) for i in range(len(self._system_ids))),
            users=_user_slots(self._ids(), self._state, served),
            metrics=self.metrics(fleet.energy_used_j),
            decision_ms=decision_ms,
        )

    def _ids(self) -> tuple[str, ...]:
        """Of the rows that take part."""
        if self._live is None:
            return self._user_ids
        return self._live.user_ids()[: self._joined]

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
    active = np.asarray(state.user_active)
    columns = zip(
        user_ids,
        np.where(active[:, None], state.user_pos_enu_m, math.nan).tolist(),
        state.user_aoi_slots.tolist(),
        state.user_data_mb.tolist(),
        np.asarray(served).tolist(),
        active.tolist(),
        strict=False,  # live users: one id for each row that is taken
    )
    return tuple(UserSlot(uid, pos[0], pos[1], aoi, data, hit, here) for uid, pos, aoi, data, hit, here in columns)


def _with_fleet(state: WorldState, fleet: FleetState, scenario: Scenario) -> WorldState:
    return replace(
        state,
        uav_pos_enu_m=fleet.pos_enu_m,
        uav_vel_enu_mps=fleet.vel_enu_mps,
        uav_energy_j=np.clip(scenario.battery_j - fleet.energy_used_j, 0.0, None),
        uav_active=fleet.active,
    )
