import csv
import io

import numpy as np
import pytest

from gcs.report import ReportData
from gcs.report.trajectory import COLUMNS, trajectory_csv


def test_the_header_is_the_contracts():
    assert ",".join(COLUMNS) == "slot,kind,id,east_m,north_m,heading_deg,speed_mps,energy_j,aoi,data_mb,served"


def test_the_four_metrics_follow_from_the_file_alone(report: ReportData):
    rows = list(csv.DictReader(io.StringIO(trajectory_csv(report.records))))
    users = [row for row in rows if row["kind"] == "user" and row["slot"] != "0"]
    last = str(report.records[-1].slot)
    produced_mb = 0.02 * 15.0 * report.scenario.slots * report.scenario.num_users
    waiting_mb = sum(float(row["data_mb"]) for row in users if row["slot"] == last)
    energy_j = [float(row["energy_j"]) for row in rows if row["kind"] == "uav" and row["slot"] == last]
    metrics = report.metrics
    assert metrics is not None
    assert np.mean([float(row["aoi"]) for row in users]) == pytest.approx(metrics.episodic_aoi, rel=1e-12)
    assert 1.0 - waiting_mb / produced_mb == pytest.approx(metrics.data_collection_ratio, rel=1e-12)
    assert np.mean([row["served"] == "1" for row in users]) == pytest.approx(metrics.user_coverage, rel=1e-12)
    assert np.mean(energy_j) / 359_640.0 == pytest.approx(metrics.energy_ratio, rel=1e-12)


def test_there_is_one_row_a_uav_and_a_user_for_every_slot_from_0(report: ReportData):
    rows = list(csv.DictReader(io.StringIO(trajectory_csv(report.records))))
    scenario = report.scenario
    assert len(rows) == (scenario.slots + 1) * (scenario.num_uavs + scenario.num_users)
    assert {int(row["slot"]) for row in rows} == set(range(scenario.slots + 1))
