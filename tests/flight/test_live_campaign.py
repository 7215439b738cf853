"""A campaign of live users from the phone to the metrics: simulated phones, the real API, a real flight loop."""

import json
import math
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from fake_fleet import FakeFleet, FakeVehicle
from phones import Crowd, Phone, Send
from websockets.sync.client import connect

from gcs.api.app import create_app
from gcs.api.listening import open_listener
from gcs.api.live_users import LiveCampaigns
from gcs.api.server import serving
from gcs.api.settings import ApiSettings
from gcs.bootstrap import make_loop, make_preparer
from gcs.ports import CampaignState, OperatorRequest, RequestKind
from gcs.store.keys import Role
from gcs.store.store import Store, open_store
from policy.mission_file import Mission, parse_mission

SLOTS = 8
SLOT_S = 15.0
MEASURE_S = 3.0
NEAR = (800.0, 700.0)  # the launch point: whoever stands here is in reach at the start


def mission() -> Mission:
    return parse_mission(
        {
            "campaign": {"name": "phones", "slots": SLOTS, "slot_s": SLOT_S},
            "area": {"south_west": [40.42, -86.93], "size_m": [1600.0, 1400.0]},
            "fleet": {"uavs": 1, "altitude_m": 60.0, "max_speed_mps": 15.0, "launch_m": [800.0, 700.0]},
            "users": {"source": "live", "count": 6},
            "policy": {"name": "random"},
        }
    )


def crowd(begun: datetime, slots_from_s: float) -> Crowd:
    """``slots_from_s``: when the first slot begins, about; people come and go in the middle of slots."""
    s = slots_from_s
    phones = [
        Phone("steady", NEAR, (1.0, 0.5)),
        Phone("ahead", (300.0, 200.0), (1.2, 0.0), skew_s=40.0),
        Phone("behind", (900.0, 900.0), (0.0, -1.0), skew_s=-3600.0),
        Phone("teller", (820.0, 650.0), (0.0, 0.0), tells=True),
        Phone("late", (500.0, 700.0), (0.5, 0.5), joins_s=s + 2.4 * SLOT_S),
        Phone("brief", (850.0, 720.0), (0.3, 0.0), leaves_s=s + 4.4 * SLOT_S),
    ]
    return Crowd(phones, mission().scenario.area.frame, begun, seed=4)


class Desk:
    """The server around a virtual flight; ``now`` is the wall clock that the live users are judged by."""

    def __init__(self, store: Store, stack: ExitStack, folder: Path) -> None:
        self.kept, self.begun = store, datetime.now(UTC)
        flown = mission()
        self.fleet = FakeFleet(flown.scenario.area.frame, [FakeVehicle(1, 800.0, 700.0)], is_virtual=True)
        live = LiveCampaigns(timedelta(seconds=90), wall=self.now)
        self.loop = make_loop(self.fleet, self.fleet, store.journal, make_preparer((1,), live=live.enrol))
        settings = ApiSettings(host="0.0.0.0", dashboard=folder, rate_per_s=1e5)
        listener = open_listener("127.0.0.1", 0)
        stack.enter_context(serving(create_app(self.loop, store, settings, live), listener))
        self.base = f"127.0.0.1:{listener.getsockname()[1]}"
        self.key = {"authorization": f"Bearer {store.keys.add('phones', Role.REPORTER)[1]}"}
        self.campaign = store.campaigns.create(flown, "tester").id
        self.request = OperatorRequest(RequestKind.START, "tester", self.campaign, flown)

    def now(self) -> datetime:
        """The server's wall clock."""
        return self.begun + timedelta(seconds=self.fleet.now_s())

    @contextmanager
    def sender(self, transport: str) -> Iterator[Send]:
        """How the phones' reports reach the server."""
        path = f"/api/v1/campaigns/{self.campaign}"
        if transport == "rest":
            with httpx.Client(base_url=f"http://{self.base}", headers=self.key, timeout=60.0, trust_env=False) as http:
                yield lambda kind, reports: http.post(f"{path}/{kind}", json=reports).raise_for_status() and None
            return
        with connect(f"ws://{self.base}{path}/reports", additional_headers=self.key, proxy=None) as socket:
            numbers = iter(range(1_000_000))

            def send(kind: str, reports: list[dict[str, Any]]) -> None:
                number = next(numbers)
                socket.send(json.dumps({"type": kind, "number": number, kind: reports}))
                answer = json.loads(socket.recv(60.0))
                assert (answer["type"], answer["number"]) == ("taken", number), answer

            yield send


@pytest.fixture
def kept(tmp_path: Path) -> Iterator[Store]:
    store = open_store(f"sqlite:///{tmp_path / 'phones.db'}")
    yield store
    store.close()


@pytest.mark.parametrize("transport", ["rest", "websocket"])
def test_what_phones_report_ends_up_in_the_books(
    kept: Store, tmp_path: Path, transport: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    with ExitStack() as stack:
        desk = Desk(kept, stack, tmp_path)
        monkeypatch.setattr("gcs.api.routes.live.datetime", _Clock(desk))
        monkeypatch.setattr("gcs.api.routes.reports_socket.MESSAGES_PER_S", 1e5)  # minutes of flight in a wall second
        send = stack.enter_context(desk.sender(transport))
        people = crowd(desk.begun, slots_from_s=40.0)
        people.measure(0.0)
        people.catch_up(0.0, send)
        desk.loop.run(until=lambda s: s.time_s > 3.0)
        future = desk.loop.submit(desk.request)
        desk.loop.tick()
        assert future.result(0).accepted, future.result(0).reason
        desk.loop.run(until=lambda s: kept.journal.flush(30.0) and s.campaign is not None)
        told_in = fly(desk, people, send)
    assert kept.journal.flush(30.0)
    check(kept, desk, people, told_in)


class _Clock:
    """In place of the class that the route asks for the time: virtual."""

    def __init__(self, desk: Desk) -> None:
        self._desk = desk

    def now(self, _zone: object) -> datetime:
        return self._desk.now()


def fly(desk: Desk, people: Crowd, send: Send) -> set[int]:
    """Phones measure, send now and then, and all of them just before a slot's end; the slots with a receipt."""
    teller = next(phone for phone in people.phones if phone.tells)
    told_in, next_s, started_s = set(), desk.fleet.now_s(), None
    while desk.loop.snapshot().campaign.state not in {CampaignState.RECOVERING, CampaignState.DONE}:
        snapshot = desk.loop.tick()
        now_s, campaign = desk.fleet.now_s(), snapshot.campaign
        if campaign.state is CampaignState.FLYING and started_s is None:
            started_s = now_s
            for phone, (joins, leaves) in {"late": (2.4, math.inf), "brief": (-99.0, 4.4)}.items():
                one = next(p for p in people.phones if p.user == phone)
                one.joins_s = one.joins_s if joins < 0.0 else started_s + joins * SLOT_S
                one.leaves_s = started_s + leaves * SLOT_S
        if now_s < next_s:
            continue
        next_s += MEASURE_S
        people.measure(now_s)
        people.send(now_s, send)
        assert desk.kept.journal.flush(30.0)  # time flies here: the snapshot tells of a slot seconds after its end
        ended = desk.kept.slots.of(desk.campaign)
        if not ended:
            continue
        if ended[-1].slot in {1, 4} - told_in:
            people.receipt(teller, now_s, send)
            told_in.add(ended[-1].slot)
        if ended[-1].time_s + SLOT_S - now_s <= MEASURE_S + 0.2:
            people.catch_up(now_s, send)
    return told_in


def check(kept: Store, desk: Desk, people: Crowd, told_in: set[int]) -> None:
    """Against the phones' own truth."""
    records = kept.slots.of(desk.campaign)
    assert [record.slot for record in records] == list(range(SLOTS + 1))
    assert told_in == {1, 4}
    phones = {phone.user: phone for phone in people.phones}
    for record in records:
        by_user = {user.user_id: user for user in record.users}
        slot_began_s = record.time_s - SLOT_S if record.slot else record.time_s
        for name, phone in phones.items():
            user = by_user.get(name)
            takes_part = phone.joins_s < slot_began_s - 0.2 and phone.leaves_s > slot_began_s + 0.2
            assert (user is not None and user.active) == takes_part, (record.slot, name)
            if record.slot and user is not None and user.active and phone.leaves_s > record.time_s:
                truth_m = phone.place_m(record.time_s)
                walked_m = math.hypot(*phone.speed_mps) * (MEASURE_S + 0.3)
                assert math.dist(truth_m, (user.east_m, user.north_m)) <= walked_m + 0.05, (record.slot, name)
        if record.slot:
            teller = by_user["teller"]
            before = next(u for u in records[record.slot - 1].users if u.user_id == "teller")
            if any(slot < record.slot for slot in told_in):  # he has told: receipts count and nothing else
                served = record.slot - 1 in told_in
                assert teller.served == served, record.slot
                assert teller.aoi_slots == (1.0 if served else before.aoi_slots + 1.0)
    check_metrics(kept, desk)


def check_metrics(kept: Store, desk: Desk) -> None:
    """The metrics of the last record, computed anew from the users of all records."""
    records = kept.slots.of(desk.campaign)[1:]
    took_part = [[user for user in record.users if user.active] for record in records]
    aoi = np.mean([user.aoi_slots for users in took_part for user in users])
    served = np.mean([user.served for users in took_part for user in users])
    metrics = records[-1].metrics
    assert metrics is not None
    assert metrics.episodic_aoi == pytest.approx(aoi)
    assert metrics.user_coverage == pytest.approx(served)
    assert len(kept.uploads.of(desk.campaign)) == 6
