"""Failsafes with the real parameters, and the fault script that provokes them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mock_station import ARM, MODE, Station, fly, mav, station

from sitl_mock.autopilot import ARDUPILOT
from sitl_mock.faults import KINDS, Effects, Fault, FaultFileError, load
from sitl_mock.link import Link

if TYPE_CHECKING:
    from pathlib import Path


def heartbeat(ground: Station, system: int = 255) -> None:
    ground.mav.srcSystem = system
    ground.send(mav.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3))


def test_ground_station_loss_is_off_by_default_and_counts_sysid_mygcs_only() -> None:
    ground = station("ardupilot")
    fly(ground)
    ground.run(3.0, every_s=1.0, do=lambda: heartbeat(ground))
    ground.run(20.0)
    assert ground.vehicle.mode.name == "GUIDED"
    ground.vehicle.params.set("FS_GCS_ENABLE", 1)
    ground.run(3.0, every_s=1.0, do=lambda: heartbeat(ground))
    ground.run(4.5, every_s=1.0, do=lambda: heartbeat(ground, 245))  # not the one that counts
    assert ground.vehicle.mode.name == "RTL"
    assert "GCS Failsafe" in ground.texts()
    ground.run(3.0, every_s=1.0, do=lambda: heartbeat(ground))
    assert ground.vehicle.mode.name == "RTL"  # stays when the link is back
    assert ground.command(MODE, 1, 4) == 0


def test_px4_data_link_loss() -> None:
    ground = station("px4")
    ground.vehicle.params.set("NAV_DLL_ACT", 2)
    fly(ground)
    ground.run(2.0, every_s=1.0, do=lambda: heartbeat(ground, 245))
    ground.run(8.5)
    assert ground.vehicle.mode.name == "AUTO.LOITER"
    ground.run(2.0)
    assert ground.vehicle.mode.name == "AUTO.RTL"


def test_low_battery_warns_after_10_s_returns_if_told_and_latches() -> None:
    ground = station("ardupilot", faults=[Fault("battery_drop", at_s=30.0, value=0.9)])
    ground.vehicle.params.set("BATT_LOW_MAH", 1000)
    ground.vehicle.params.set("BATT_FS_LOW_ACT", 2)
    fly(ground)
    ground.run(39.0 - ground.now_s)
    assert "Battery Failsafe" not in ground.texts()
    ground.run(2.0)
    assert "Battery Failsafe" in ground.texts()
    assert ground.vehicle.mode.name == "RTL"
    ground.run_until(lambda: not ground.vehicle.armed, 120.0)
    ground.command(MODE, 1, 4)
    assert ground.command(ARM, 1) == 4
    assert ground.command(42651, 1, 100) == 0
    assert ground.command(ARM, 1) == 0


def test_default_battery_failsafe_only_warns() -> None:
    ground = station("ardupilot", faults=[Fault("battery_drop", at_s=20.0, value=0.9)])
    ground.vehicle.params.set("BATT_LOW_MAH", 1000)
    fly(ground)
    ground.run(25.0)
    assert "Battery Failsafe" in ground.texts()
    assert ground.vehicle.mode.name == "GUIDED"


def test_px4_returns_when_critical() -> None:
    ground = station("px4", faults=[Fault("battery_drop", at_s=30.0, value=0.93)])
    ground.vehicle.params.set("COM_LOW_BAT_ACT", 3)
    fly(ground)
    ground.run(32.0 - ground.now_s)
    assert ground.vehicle.mode.name == "AUTO.RTL"


def test_empty_battery_falls() -> None:
    ground = station("ardupilot", faults=[Fault("battery_drop", at_s=25.0, value=1.0)])
    fly(ground)
    ground.run(31.0 - ground.now_s)
    assert not ground.vehicle.armed
    assert ground.vehicle.body.on_ground


def test_gps_loss_lands_8_s_later_and_stays_landing() -> None:
    ground = station("ardupilot", faults=[Fault("gps_loss", at_s=25.0, for_s=12.0)])
    fly(ground)
    ground.run(32.5 - ground.now_s)
    assert ground.vehicle.mode.name == "GUIDED"
    ground.run(1.0)
    assert ground.vehicle.mode.name == "LAND"
    ground.run(10.0)
    assert ground.vehicle.mode.name == "LAND"
    assert any("EKF Failsafe" in text for text in ground.texts())


def test_denied_arming_says_why() -> None:
    ground = station("ardupilot", faults=[Fault("deny_arming", for_s=5.0, text="Arm: Compass not healthy")])
    ground.run(2.5)
    ground.command(MODE, 1, 4)
    assert ground.command(ARM, 1) == 4
    assert "Arm: Compass not healthy" in ground.texts()
    ground.run(3.0)
    assert ground.command(ARM, 1) == 0


def test_pilot_takes_over_and_gives_back() -> None:
    ground = station("ardupilot", faults=[Fault("pilot", at_s=20.0, for_s=10.0, text="LOITER")])
    fly(ground)
    ground.run(21.0 - ground.now_s)
    assert ground.vehicle.mode.name == "LOITER"
    assert ground.command(MODE, 1, 4) == 4
    ground.run(10.0)
    assert ground.command(MODE, 1, 4) == 0


def test_cut_link_carries_nothing_one_way() -> None:
    ground = station("ardupilot", faults=[Fault("cut", at_s=3.0, for_s=5.0, direction="down")])
    ground.run(3.1)
    assert ground.run(4.0) == []
    assert ground.command(MODE, 1, 4) is None  # obeyed, but nobody hears so
    assert ground.vehicle.mode.name == "GUIDED"
    ground.run(1.0)
    assert ground.run(2.0) != []


def test_delay_is_kept_and_loss_is_counted() -> None:
    link = Link(np.random.default_rng(3))
    link.quality.delay_s = 0.2
    link.put(1, b"a", 1.0)
    assert link.take(1.19) == []
    assert link.take(1.2) == [(1, b"a")]
    link.quality.delay_s, link.quality.loss = 0.0, 0.3
    for _ in range(2000):
        link.put(None, b"x", 2.0)
    assert len(link.take(2.0)) == pytest.approx(1400, abs=80)
    link.quality.loss, link.quality.duplicate = 0.0, 1.0
    link.put(None, b"y", 3.0)
    assert len(link.take(3.0)) == 2


def test_same_seed_same_bytes() -> None:
    def run() -> list[bytes]:
        faults = [Fault("loss", value=0.3), Fault("jitter", value=0.2)]
        ground = station("px4", faults=faults, seed=5)
        return [datagram.data for datagram in ground.simulation.advance_to(20.0)]

    assert run() == run()


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("fault = 3", "[[fault]]"),
        ("x = 1", "unknown key x"),
        ("not toml", "is no TOML"),
        ("[[fault]]\nkind = 'meteor'", "'meteor' is unknown"),
        ("[[fault]]\nkind = 'loss'\nvalue = 1.5", "value = 1.5"),
        ("[[fault]]\nkind = 'loss'\nvalue = nan", "no number"),
        ("[[fault]]\nkind = 'cut'\nvehicle = 9", "vehicle = 9"),
        ("[[fault]]\nkind = 'cut'\ndirection = 'left'", "'left'"),
        ("[[fault]]\nkind = 'pilot'\ntext = 'NAP'", "'NAP'"),
        ("[[fault]]\nkind = 'cut'\nwhen = 3", "unknown key 'when'"),
        ("[[fault]]\nkind = 'cut'\nat_s = -1", "at_s = -1"),
        ("[[fault]]\nkind = 'cut'\nfor_s = 0", "for_s = 0"),
    ],
)
def test_bad_fault_files_say_what_and_where(tmp_path: Path, text: str, says: str) -> None:
    path = tmp_path / "faults.toml"
    path.write_text(text)
    with pytest.raises(FaultFileError, match=r"faults\.toml") as error:
        load(path, vehicles=2, modes=ARDUPILOT.modes.names)
    assert says in str(error.value)
    assert "\n" not in str(error.value)


def test_good_fault_file_is_read(tmp_path: Path) -> None:
    path = tmp_path / "faults.toml"
    path.write_text("[[fault]]\nkind = 'loss'\nvehicle = 2\nat_s = 30\nfor_s = 10.0\nvalue = 0.3\ndirection = 'up'\n")
    assert load(path, vehicles=2, modes=()) == [Fault("loss", 2, 30, 10.0, 0.3, "up")]


@settings(max_examples=40, deadline=None)
@given(st.sampled_from(sorted(KINDS)), st.floats(0, 5), st.floats(0.01, 5))
def test_every_fault_leaves_nothing_behind(kind: str, at_s: float, for_s: float) -> None:
    """After its end a fault has restored what it changed (a drained battery excepted)."""
    fault = Fault(
        kind, 0, at_s, for_s, 0.0 if kind == "battery_drop" else 1.0 if KINDS[kind].whole else 0.5, text="LOITER"
    )
    ground = station("ardupilot", faults=[fault])
    ground.run(10.2)
    assert ground.simulation._up[0].quality.perfect
    assert ground.simulation._down[0].quality.perfect
    assert ground.vehicle.faults == Effects()
    assert ground.vehicle.body.yaw_rad == pytest.approx(0.0)
    assert ground.simulation.script.faults == {}
