"""``gcs replay``: what it opens, what it refuses, and that it writes to no record."""

import hashlib
import json
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import httpx
import pytest
from fleet_at_work import fleet_snapshot

from gcs.__main__ import main
from gcs.cli.flight_results import FlownCampaign, write_report
from gcs.cli.recordings import copy_recording
from gcs.ports import CampaignState, DecisionRecord, Event, SlotRecord, TelemetrySample, UavSlot
from gcs.store.decision_documents import decision_document
from gcs.store.store import using_store
from policy.agents.registry import PolicyChoice
from policy.mission_file import load_mission

ROOT = Path(__file__).parents[2]
WAIT_S = 60.0
SLOTS = 4


def record(slot: int) -> SlotRecord:
    campaign = fleet_snapshot(75 * slot, users=3).campaign
    assert campaign is not None
    latest = campaign.latest
    assert latest is not None
    uavs = (UavSlot(1, 100.0 * slot, 50.0, 90.0, 17.0, 1500.0 * slot), UavSlot(2, 7.0, 9.0, 0.0, 0.0, 10.0 * slot))
    metrics = latest.metrics if slot else None
    return SlotRecord(slot, 20.0 + 15.0 * slot, uavs, latest.users, metrics, 2.5 if slot else None)


def decision(slot: int) -> DecisionRecord:
    two = ((1.0, 2.0), (3.0, 4.0))
    told = {"uavs": [{"uav": 0, "path_enu_m": [[slot, 2]]}], "relations": [[{"user": 2, "weight": 0.5}]]}
    return DecisionRecord(
        slot,
        two,
        two,
        (9.0, 9.0),
        (True, True),
        (0.5, 1.5),
        (7.0, 8.0),
        2.5,
        time_s=20.1 + 15.0 * slot,
        explanation=told,
    )


def events(campaign_id: str | None) -> tuple[Event, ...]:
    flying = Event(20.0, "campaign.state", "launching -> flying", campaign_id=campaign_id, data={"state": "flying"})
    done = Event(80.0, "campaign.state", "recovering -> done", campaign_id=campaign_id, data={"state": "done"})
    return (flying, Event(42.5, "plan.late", "the plan was late", campaign_id=campaign_id), done)


TELEMETRY = tuple(
    TelemetrySample(time_s, fleet_snapshot(int(5 * time_s), vehicles=2, users=0).vehicles)
    for time_s in (12.0, 20.0, 65.0)
)


@pytest.fixture
def store_file(tmp_path: Path) -> tuple[Path, str]:
    path = tmp_path / "gcs.db"
    with using_store(f"sqlite:///{path}") as store:
        campaign = store.campaigns.create(load_mission("demo"), "ann")
        for slot in range(SLOTS):
            store.journal.record_slot(campaign.id, record(slot))
        for one in events(campaign.id):
            store.journal.record(one)
        for sample in TELEMETRY:
            store.journal.record_telemetry(campaign.id, sample)
        store.journal.record_decision(campaign.id, decision(1))
        assert store.journal.flush(WAIT_S)
        store.journal.record(Event(9e6, "safety.stop", "somebody else's flight, later"))
    return path, campaign.id


@contextmanager
def replaying(log: Path, *words: str) -> Iterator[tuple[httpx.Client, str]]:
    """The command as a process: a client of it, and the campaign in the address that it printed."""
    command = [sys.executable, "-m", "gcs", "replay", str(log), "--port", "0", *words]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=ROOT)
    try:
        assert process.stdout is not None
        said = process.stdout.readline() + process.stdout.readline()
        found = re.search(r"open (\S+/)#replay=(\w+)", said)
        assert found, (said, process.communicate(timeout=WAIT_S))
        with httpx.Client(base_url=found[1], timeout=WAIT_S, trust_env=False) as client:
            yield client, found[2]
        process.send_signal(signal.SIGTERM)
        assert process.wait(WAIT_S) == 0
    finally:
        process.kill()
        process.communicate()


def test_a_store_is_shown_and_nothing_of_it_is_written_or_may_be_changed(store_file: tuple[Path, str]) -> None:
    path, campaign_id = store_file
    before = hashlib.sha256(path.read_bytes()).hexdigest()
    with replaying(path) as (client, shown):
        assert shown == campaign_id
        (why,) = client.get(f"/api/v1/campaigns/{shown}/recording/explanations").json()["decisions"]
        assert (why["slot"], why["at_s"]) == (1, pytest.approx(23.1))
        told = client.get(f"/api/v1/campaigns/{shown}/recording").json()
        slots = client.get(f"/api/v1/campaigns/{shown}/recording/slots").json()["slots"]
        telemetry = client.get(f"/api/v1/campaigns/{shown}/recording/telemetry").json()["samples"]
        refused = client.post(f"/api/v1/campaigns/{shown}/start")
    assert (told["first_slot"], told["last_slot"], told["state"]) == (0, SLOTS - 1, "done")
    assert [one["at_slot"] for one in told["events"]] == [0.0, 1.5, 3.0]
    assert [one["at_s"] for one in told["events"]] == [8.0, 30.5, 53.0]
    assert [one["at_s"] for one in telemetry] == [0.0, 8.0, 53.0]
    assert [slot["uavs"][0]["east_m"] for slot in slots] == [0.0, 100.0, 200.0, 300.0]
    assert refused.status_code == 401
    assert hashlib.sha256(path.read_bytes()).hexdigest() == before


def exported(path: Path, campaign_id: str, folder: Path) -> Path:
    """The JSON report that a server would give."""
    with replaying(path) as (client, _):
        report = client.get(f"/api/v1/campaigns/{campaign_id}/report?format=json").json()
    file = folder / "export.json"
    file.write_text(json.dumps(report))
    return file


def test_an_export_holds_the_same_recording_as_its_store(store_file: tuple[Path, str], tmp_path: Path) -> None:
    path, campaign_id = store_file
    file = exported(path, campaign_id, tmp_path)
    folder = tmp_path / "copy"
    folder.mkdir()
    with using_store(copy_recording(file, folder)) as store, using_store(f"sqlite:///{path}") as own:
        assert store.slots.of(campaign_id) == own.slots.of(campaign_id)
        assert store.checkpoints.decision_documents(campaign_id) == own.checkpoints.decision_documents(campaign_id)
        assert list(store.telemetry.rows(campaign_id)) == list(own.telemetry.rows(campaign_id))
        (copied,) = store.campaigns.newest()
        known = own.campaigns.get(campaign_id)
        assert known is not None
        assert (copied.name, copied.policy, copied.state, copied.document) == (
            known.name, known.policy, known.state, known.document,
        )  # fmt: skip


def test_a_report_folder_is_a_recording_too(tmp_path: Path) -> None:
    mission = load_mission("demo")
    records = tuple(record(slot) for slot in range(SLOTS))
    flown = FlownCampaign(
        mission, PolicyChoice("gcrl"), mission.scenario, 0, CampaignState.DONE, "", records, events(None), {}, 9.0,
        "2026-11-01T12:00:00+00:00", TELEMETRY,
    )  # fmt: skip
    write_report(replace(flown, decisions=(decision(1), decision(2))), (), tmp_path / "report")
    with using_store(copy_recording(tmp_path / "report", tmp_path)) as store:
        (campaign,) = store.campaigns.newest()
        assert (campaign.policy, campaign.slots) == ("gcrl", mission.scenario.slots)
        found = store.slots.of(campaign.id)
        assert [one.uavs for one in found] == [one.uavs for one in records]
        assert [one.users for one in found] == [one.users for one in records]
        assert [one.time_s for one in found] == [one.time_s for one in records]
        kept = [sample for _, sample in store.telemetry.part(campaign.id, 0, 10)]
        assert [one.time_s for one in kept] == [one.time_s for one in TELEMETRY]
        decisions = store.checkpoints.decisions_part(campaign.id, 0, 10)
        assert [one.decision.slot for one in decisions] == [1, 2]
        assert decisions[0].decision.explanation == decision_document(decision(1))["explanation"]
        assert kept[0].vehicles[1].mode_name == TELEMETRY[0].vehicles[1].mode_name
        kappa = [one.metrics and one.metrics.episodic_aoi for one in found]
        assert kappa == [one.metrics and one.metrics.episodic_aoi for one in records]


@pytest.mark.parametrize(
    ("content", "words"),
    [(None, "cannot be read"), ("{}", "none of the recordings"), ("rubbish", "no complete recording"),
     ('{"campaign": {}}', "no complete recording"), ("[1]", "none of the recordings"),
     ('{"provenance": {}, "mission": "demo"}', "trajectory.csv"), ("SQLite format 3\x00 not really", "no store")],
)  # fmt: skip
def test_what_cannot_be_shown_is_one_line(
    content: str | None, words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log = tmp_path / "log"
    if content is not None:
        log.write_text(content)
    assert main(["replay", str(log), "--port", "0"]) == 2
    said = capsys.readouterr().err
    assert said.startswith("gcs replay: ")
    assert (said.count("\n"), words in said) == (1, True), said


def test_a_campaign_that_is_not_there_and_a_foreign_address_are_refused(
    store_file: tuple[Path, str], capsys: pytest.CaptureFixture[str]
) -> None:
    path, campaign_id = store_file
    assert main(["replay", str(path), "--port", "0", "--campaign", "nobody"]) == 2
    assert campaign_id in capsys.readouterr().err
    assert main(["replay", str(path), "--port", "0", "--host", "0.0.0.0"]) == 2
    assert "this machine only" in capsys.readouterr().err


def test_a_mission_whose_trace_is_elsewhere_is_shown_all_the_same(tmp_path: Path) -> None:
    document: dict[str, Any] = dict(load_mission("demo").document)
    document["users"] = {"source": "trace", "trace": "not-on-this-machine.csv"}
    file = tmp_path / "export.json"
    slots = [{"slot": 0, "time_s": 1.0, "uavs": [], "users": [], "metrics": None, "decision_ms": None}]
    told = {"id": "abc", "name": "demo", "policy": "gcrl", "document": document}
    file.write_text(json.dumps({"campaign": told, "state": "failed", "reason": "gone", "slots": slots, "events": []}))
    with replaying(file) as (client, shown):
        seen = client.get(f"/api/v1/campaigns/{shown}/recording").json()
    assert (shown, seen["state"], seen["campaign"]["user_source"]) == ("abc", "failed", "trace")
