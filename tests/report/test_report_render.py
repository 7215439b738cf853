import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import pytest

from gcs.ports import Event, Severity
from gcs.report import ReportData, render_page, render_report

VOID = {"meta", "link", "br", "hr", "img", "input"}
FETCHING = {"script", "link", "iframe", "img", "object", "embed", "audio", "video", "use", "image"}


class Checker(HTMLParser):
    """Collects text and fetched things, and fails on tags that are not closed in order."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.text: list[str] = []
        self.fetching: list[str] = []

    def handle_starttag(self, tag, attrs):
        if tag in FETCHING or any(name in ("src", "href", "xlink:href") for name, _ in attrs):
            self.fetching.append(tag)
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.handle_starttag(tag, attrs)
        if tag not in VOID:
            self.open.pop()

    def handle_endtag(self, tag):
        assert self.open
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)


def check(page: str) -> Checker:
    checker = Checker()
    checker.feed(page)
    assert checker.open == []
    return checker


def test_the_page_is_well_formed_and_fetches_nothing(report: ReportData):
    page = render_page(report)
    assert check(page).fetching == []
    addresses = set(re.findall(r"https?://[^\s\"'<>)]+", page))
    assert addresses <= {"http://www.w3.org/2000/svg", "http://www.w3.org/1999/xlink"}
    assert "url(" not in page.replace("url(#", "")
    assert "@import" not in page


def test_words_from_outside_are_text_and_never_markup(report: ReportData):
    page = render_page(report)
    text = "".join(check(page).text)
    assert "demo & <test>" in text
    assert "no heartbeat from <UAV 1> for 5 s" in text
    assert "tower <b>" in text
    assert "<test>" not in page
    assert "<b>, 140" not in page


def test_the_page_shows_the_metrics_beside_the_others(report: ReportData):
    text = " ".join(check(render_page(report)).text)
    assert report.metrics is not None
    assert f"{report.metrics.episodic_aoi:.2f}" in text
    assert f"{report.comparison[0].metrics.episodic_aoi:.2f}" in text
    assert "ideal motion" in text
    assert report.provenance.command in text


def test_warnings_come_before_cautions_and_notes(report: ReportData):
    text = " ".join(check(render_page(report)).text)
    places = [text.index(word) for word in ("link.lost", "gate.slowed", "campaign.state")]
    assert places == sorted(places)


def test_the_same_campaign_gives_the_same_page(report: ReportData):
    assert render_page(report) == render_page(report)


def test_all_files_are_written_and_no_halves_are_left(report: ReportData, tmp_path: Path):
    index = render_report(report, tmp_path / "new" / "folder")
    assert index.name == "index.html"
    written = {path.name for path in index.parent.iterdir()}
    assert written == {"index.html", "mission.toml", "report.json", "tracks.geojson", "tracks.kml", "trajectory.csv"}
    assert all(name in index.read_text() for name in written - {"index.html"})


def test_the_json_is_the_contracts_result_object_with_curves_beside_it(report: ReportData, tmp_path: Path):
    document = json.loads((render_report(report, tmp_path).parent / "report.json").read_text())
    metrics = report.metrics
    assert metrics is not None
    assert document["mission"] == "demo & <test>"
    assert (document["policy"], document["uavs"], document["slots"]) == ("receding-horizon", 2, report.scenario.slots)
    assert document["episodic_aoi"] == metrics.episodic_aoi
    assert document["final_aoi"] == metrics.final_aoi
    assert document["decision_ms"] == {"p50": 3.5, "p99": 3.5}
    assert document["violations"] == {"geofence": 0, "separation": 0, "obstacle": 1, "battery": 0}
    assert document["series"]["aoi_so_far"][-1] == metrics.episodic_aoi
    assert len(document["events"]) == 3


def test_a_campaign_that_ended_before_its_first_slot_says_so(report: ReportData, tmp_path: Path):
    early = replace(report, records=report.records[:1], state="failed", reason="UAV 1: Arm: check <GPS>")
    index = render_report(early, tmp_path)
    text = " ".join(check(index.read_text()).text)
    assert "Ended as failed." in text
    assert "UAV 1: Arm: check <GPS>" in text
    assert "no slot was finished" in text
    assert json.loads((tmp_path / "report.json").read_text())["episodic_aoi"] is None


def test_a_campaign_in_the_air_is_not_said_to_have_ended(report: ReportData):
    text = " ".join(check(render_page(replace(report, state="flying"))).text)
    assert "Not over yet (flying)" in text
    assert "Ended as" not in text


def test_a_flood_of_events_keeps_the_warnings(report: ReportData):
    chatter = tuple(Event(float(t), "plan.made", f"slot {t}") for t in range(2000))
    warning = Event(9999.0, "link.lost", "the one that matters", Severity.WARNING)
    text = " ".join(check(render_page(replace(report, events=(*chatter, warning)))).text)
    assert "the one that matters" in text
    assert "1601 more in report.json" in text


def test_records_out_of_order_are_refused(report: ReportData):
    with pytest.raises(ValueError, match="rising order"):
        replace(report, records=report.records[::-1])
    with pytest.raises(ValueError, match="slot 0"):
        replace(report, records=())
