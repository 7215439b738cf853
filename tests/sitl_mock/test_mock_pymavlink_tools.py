"""pymavlink's own tools: its parameter fetcher, its waypoint loader, its log reader and its mission script."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, Any

import pytest
from mock_process import connect, free_port, running
from pymavlink import mavparm, mavutil, mavwp
from pymavlink.dialects.v20 import ardupilotmega as mav

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path


def _until(mock: Any, link: Any, kind: str, now_s: list[float], limit_s: float = 20.0) -> Any:
    """The next message of a kind; time goes on while there is none."""
    end_s = now_s[0] + limit_s
    while now_s[0] < end_s:
        message = link.recv_match(type=kind, blocking=False)
        if message is not None:
            return message
        now_s[0] = mock.advance_to(round(now_s[0] + 0.02, 3))
    raise AssertionError(f"no {kind} within {limit_s} s")


def _px4_waypoints() -> mavwp.MAVWPLoader:
    loader = mavwp.MAVWPLoader(target_system=1, target_component=1)
    for seq, (command, north) in enumerate(((22, 0.0), (16, 0.001), (16, 0.002), (20, 0.0))):
        loader.add(mav.MAVLink_mission_item_message(
            1, 1, seq, 3, command, 0, 1, 0, 0, 0, 0, 40.4258 + north, -86.9197, 20.0
        ))  # fmt: skip
    return loader


@pytest.mark.parametrize("flavour", ["ardupilot", "px4"])
def test_parameters_are_saved_changed_and_loaded(flavour: str, tmp_path: Path) -> None:
    port = free_port()
    with running("--first-port", str(port), "--flavour", flavour) as mock:
        link, now_s, table = connect(port), [0.0], mavparm.MAVParmDict()
        link.mav.heartbeat_send(6, 8, 0, 0, 0)
        link.param_fetch_all()
        count = 1
        while len(table) < count:
            value = _until(mock, link, "PARAM_VALUE", now_s)
            table[value.param_id], count = value.param_value, value.param_count
        table.save(str(tmp_path / "all.parm"))
        again = mavparm.MAVParmDict()
        assert again.load(str(tmp_path / "all.parm"), check=False)
        assert len(again) == count > 40
        link.param_set_send("RTL_ALT" if flavour == "ardupilot" else "RTL_RETURN_ALT", 33.0, 9)
        assert _until(mock, link, "PARAM_VALUE", now_s).param_value == 33.0
        link.close()


@pytest.mark.parametrize("flavour", ["ardupilot", "px4"])
def test_waypoints_are_loaded_and_read_back(flavour: str, tmp_path: Path) -> None:
    port, loader = free_port(), _px4_waypoints()
    with running("--first-port", str(port), "--flavour", flavour) as mock:
        link, now_s = connect(port), [0.0]
        link.mav.heartbeat_send(6, 8, 0, 0, 0)
        link.mav.mission_count_send(1, 1, loader.count())
        for _ in range(loader.count()):
            asked = _until(mock, link, "MISSION_REQUEST_INT", now_s)
            link.mav.send(loader.wp(asked.seq))
        assert _until(mock, link, "MISSION_ACK", now_s).type == 0
        link.mav.mission_request_list_send(1, 1)
        back = mavwp.MAVWPLoader(target_system=1, target_component=1)
        for seq in range(_until(mock, link, "MISSION_COUNT", now_s).count):
            link.mav.mission_request_send(1, 1, seq)
            back.add(_until(mock, link, "MISSION_ITEM", now_s))
        link.close()
    back.save(str(tmp_path / "way.txt"))
    assert mavwp.MAVWPLoader().load(str(tmp_path / "way.txt")) == 4
    for ours, theirs in zip(back.wpoints, loader.wpoints, strict=True):
        assert (ours.command, ours.frame, ours.z) == (theirs.command, theirs.frame, theirs.z)
        assert (ours.x, ours.y) == pytest.approx((theirs.x, theirs.y), abs=1e-5)


def test_a_recorded_link_is_a_log_that_pymavlink_reads(tmp_path: Path) -> None:
    """A tlog is each frame behind its time in microseconds; the reader finds every message, none bad."""
    port, log = free_port(), tmp_path / "flight.tlog"
    with running("--first-port", str(port)) as mock:
        link = connect(port)
        link.mav.heartbeat_send(6, 8, 0, 0, 0)
        heard = 0
        with log.open("wb") as file:
            for tenth in range(300):
                mock.advance_to(tenth / 10)
                while (message := link.recv_msg()) is not None:
                    file.write(struct.pack(">Q", 10**15 + tenth * 10**5) + message.get_msgbuf())
                    heard += 1
        link.close()
    reader = mavutil.mavlink_connection(str(log))
    kinds: list[str] = []
    take: Callable[[], Any] = reader.recv_match
    while (message := take()) is not None:
        kinds.append(message.get_type())
    reader.close()
    assert len(kinds) == heard > 500
    assert "BAD_DATA" not in kinds
