"""The four metrics again, from the trajectory file and the trace alone, with formulas written anew."""

import csv
import json
import math

import numpy as np
import pytest

from policy.__main__ import main

BATTERY_J = 4.5 * 3600.0 * 22.2
SLOTS, SLOT_S, RATE_MBPS, ALTITUDE_M = 12, 15.0, 0.03, 120.0


def loss_db(ground_m: float, mcl_altitude_m: float = ALTITUDE_M) -> float:
    """Paper Eq. 1-3 with the constants of Section VII-A."""
    slant_m = math.hypot(ground_m, mcl_altitude_m)
    clear = math.exp(-0.005 * 0.5 * ground_m * (1.7 - 1.3) / (mcl_altitude_m - 1.3))
    los = 84.64 + 15.5 * math.log10(slant_m)
    nlos = 113.63 + 11.6 * math.log10(slant_m)
    return clear * los + (1.0 - clear) * nlos - 5.0


def power_w(speed: float) -> float:
    """Paper, Section III, propulsion energy a second."""
    blade = 79.8563 * (1.0 + 3.0 * speed**2 / 120.0**2)
    induced = 88.6279 * math.sqrt(math.sqrt(1.0 + speed**4 / (4.0 * 4.03**4)) - speed**2 / (2.0 * 4.03**2))
    return blade + induced + 0.5 * 0.0185 * speed**3


def read(path):
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    uavs = {(int(r["slot"]), r["id"]): r for r in rows if r["kind"] == "uav"}
    users = {(int(r["slot"]), r["id"]): r for r in rows if r["kind"] == "user"}
    return rows, uavs, users


@pytest.mark.parametrize("policy", ["random", "receding-horizon"])
@pytest.mark.parametrize("mcl_db", [117.0, 120.0])
def test_metrics_follow_from_the_files(tiny, tmp_path, policy, mcl_db):
    out, track = tmp_path / "r.json", tmp_path / "t.csv"
    arguments = ["evaluate", str(tiny), "--policy", policy, "--mcl-db", str(mcl_db)]
    assert main([*arguments, "--json", str(out), "--trajectory", str(track)]) == 0
    result = json.loads(out.read_text())
    rows, uavs, users = read(track)
    uav_ids = sorted({key[1] for key in uavs})
    user_ids = sorted({key[1] for key in users})
    assert len(rows) == (SLOTS + 1) * (len(uav_ids) + len(user_ids))
    trace = {}
    with (tiny.parent / "tiny.csv").open(newline="") as file:
        for row in csv.DictReader(file):
            sample = round((float(row["timestamp"]) - 1000.0) / SLOT_S)
            trace[sample, row["id"]] = (float(row["x_distance"]), float(row["y_distance"]))

    aoi = dict.fromkeys(user_ids, 1.0)
    data = dict.fromkeys(user_ids, 0.0)
    spent_j = dict.fromkeys(uav_ids, 0.0)
    aoi_sum = served_sum = 0.0
    for slot in range(1, SLOTS + 1):
        for uav in uav_ids:
            now, before = uavs[slot, uav], uavs[slot - 1, uav]
            heading, speed = math.radians(float(now["heading_deg"])), float(now["speed_mps"])
            assert float(now["east_m"]) == pytest.approx(
                float(before["east_m"]) + SLOT_S * speed * math.sin(heading), abs=1e-3
            )
            assert float(now["north_m"]) == pytest.approx(
                float(before["north_m"]) + SLOT_S * speed * math.cos(heading), abs=1e-3
            )
            spent_j[uav] += SLOT_S * power_w(speed)
            assert float(now["energy_j"]) == pytest.approx(spent_j[uav], rel=1e-6)
        for user in user_ids:
            row = users[slot, user]
            place = trace[slot, user]
            assert (float(row["east_m"]), float(row["north_m"])) == pytest.approx(place, abs=1e-5)
            nearest_m = min(
                math.dist(place, (float(uavs[slot, u]["east_m"]), float(uavs[slot, u]["north_m"]))) for u in uav_ids
            )
            served = loss_db(nearest_m) <= mcl_db
            assert row["served"] == str(int(served))
            aoi[user] = 1.0 if served else aoi[user] + 1.0
            data[user] = 0.0 if served else data[user] + RATE_MBPS * SLOT_S
            assert float(row["aoi"]) == aoi[user]
            assert float(row["data_mb"]) == pytest.approx(data[user], abs=1e-6)
            aoi_sum += aoi[user]
            served_sum += served
    count = SLOTS * len(user_ids)
    collected_mb = len(user_ids) * SLOTS * RATE_MBPS * SLOT_S
    assert result["episodic_aoi"] == pytest.approx(aoi_sum / count)
    assert result["user_coverage"] == pytest.approx(served_sum / count)
    assert result["data_collection_ratio"] == pytest.approx(1.0 - sum(data.values()) / collected_mb)
    assert result["energy_ratio"] == pytest.approx(sum(spent_j.values()) / len(uav_ids) / BATTERY_J)
    assert result["final_aoi"] == pytest.approx(np.mean(list(aoi.values())))
    assert (result["uavs"], result["mcl_db"], result["slots"], result["seeds"]) == (2, mcl_db, SLOTS, 1)
    assert sum(result["violations"].values()) == 0
