"""Places of people are kept no longer than they may be, and results stay."""

import math
import time
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from sqlalchemy import text

from gcs.__main__ import main
from gcs.ports import DecisionRecord, Event, SlotRecord, UavSlot, UserSlot
from gcs.store.entries import UploadEntry
from gcs.store.housekeeper import Housekeeper
from gcs.store.privacy import campaigns_to_wipe, wipe_places
from gcs.store.reading import EventFilter
from gcs.store.store import Store, open_store

WAIT_S = 20.0
NAME, EAST = "anna-of-flat-17", 437.15625  # both are looked for in the file
LONG = timedelta(days=3650)


def flown(store: Store, campaign_id: str, state: str = "done") -> None:
    """One slot of one user, a decision that saw her, and a receipt."""
    user = UserSlot(NAME, EAST, 2.0, 3.0, 0.25, True)
    why = {"relations": [[{"user": 0, "weight": 0.5}]], "predicted_user_enu_m": [[EAST, 2.0]], "horizon_slots": 8}
    decision = DecisionRecord(
        0, ((1.0, 2.0),), ((0.0, 0.0),), (9.0,), (True,), (0.5,), (7.0,), 1.0, users=((EAST, 2.0, 0.25, 3.0, True),),
        explanation=why,
    )  # fmt: skip
    journal = store.journal
    journal.record_slot(campaign_id, SlotRecord(0, 1.0, (UavSlot(1, 5.0, 6.0, 7.0, 8.0, 9.0),), (user,), None))
    journal.record_decision(campaign_id, decision)
    journal.put(UploadEntry(campaign_id, NAME, datetime.now(UTC), 0.3))
    journal.record(Event(1.0, "campaign.state", state, campaign_id=campaign_id, data={"state": state}))
    assert journal.flush(WAIT_S)


def check_wiped(store: Store, campaign_id: str) -> None:
    (slot,) = store.slots.of(campaign_id)
    (user,) = slot.users
    assert (user.user_id, user.aoi_slots, user.data_mb, user.served) == ("user 0", 3.0, 0.25, True)
    assert math.isnan(user.east_m)
    assert math.isnan(user.north_m)
    assert slot.uavs == (UavSlot(1, 5.0, 6.0, 7.0, 8.0, 9.0),)
    (decision,) = store.checkpoints.decisions(campaign_id)
    assert all(math.isnan(value) for value in decision.users[0][:2])
    assert decision.users[0][2:] == (0.25, 3.0, True)
    assert decision.explanation is not None
    assert [uav["relations"] for uav in decision.explanation["uavs"]] == [[]]
    assert (decision.explanation["wiped"], decision.explanation["horizon_slots"]) == (True, 8)
    assert store.uploads.of(campaign_id) == []
    record = store.campaigns.get(campaign_id)
    assert record is not None
    assert record.places_wiped_at is not None


def test_what_tells_where_somebody_was_is_gone_and_results_stay(store: Store, campaign_id: str) -> None:
    flown(store, campaign_id)
    wipe_places(store.engine, campaign_id)
    check_wiped(store, campaign_id)
    with store.engine.connect() as connection:
        for table in ("slots", "decisions", "uploads", "events", "checkpoints"):
            for row in connection.execute(text(f"SELECT * FROM {table}")):
                assert NAME not in str(row)
                assert str(EAST) not in str(row)


def test_not_a_trace_is_left_in_the_file(tmp_path: Path, mission) -> None:  # type: ignore[no-untyped-def]
    store = open_store(f"sqlite:///{tmp_path / 'traces.db'}")
    campaign_id = store.campaigns.create(mission, "tester").id
    flown(store, campaign_id)
    wipe_places(store.engine, campaign_id)
    held = b"".join(path.read_bytes() for path in tmp_path.iterdir() if path.is_file())
    store.close()
    assert b"tester" in held
    assert NAME.encode() not in held
    assert str(EAST).encode() not in held


def test_only_campaigns_that_are_over_for_long_enough_are_due(store: Store, mission) -> None:  # type: ignore[no-untyped-def]
    over, flying = (store.campaigns.create(mission, "tester").id for _ in range(2))
    flown(store, over)
    flown(store, flying, "flying")
    now = datetime.now(UTC)
    assert list(campaigns_to_wipe(store.engine, now - LONG)) == []
    assert list(campaigns_to_wipe(store.engine, now + timedelta(minutes=1))) == [over]
    wipe_places(store.engine, over)
    assert list(campaigns_to_wipe(store.engine, now + timedelta(minutes=1))) == [], "once"


def test_the_housekeeper_wipes_by_itself_and_says_so(store: Store, campaign_id: str) -> None:
    flown(store, campaign_id)
    keeper = Housekeeper(store, keep_places_days=0.0, every_s=0.05)
    until_s = time.monotonic() + WAIT_S
    while not store.events.find(EventFilter(kind="privacy.wiped")) and time.monotonic() < until_s:
        time.sleep(0.02)
    keeper.close()
    check_wiped(store, campaign_id)
    assert [event.campaign_id for event in store.events.find(EventFilter(kind="privacy.wiped"))] == [campaign_id]


def test_the_command(store: Store, store_url: str, campaign_id: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["places", "wipe", "--campaign", campaign_id, "--store", store_url]) == 2
    assert "is ready; it needs" in capsys.readouterr().err
    flown(store, campaign_id)
    assert main(["places", "wipe", "--older-than-days", "30", "--store", store_url]) == 0
    assert "of 0 campaigns" in capsys.readouterr().out
    assert main(["places", "wipe", "--campaign", campaign_id, "--store", store_url]) == 0
    check_wiped(store, campaign_id)
    assert main(["places", "wipe", "--campaign", "nobody", "--store", store_url]) == 2
