"""Each check with a machine that is fine and one that is not; the remedy is part of the answer."""

import socket
from datetime import UTC, datetime
from pathlib import Path

import httpx
import pytest

from gcs.config import ServerConfig
from gcs.doctor import Finding, Grade
from gcs.doctor import machine as machine_checks
from gcs.doctor.fleet import check_fleet, check_policy_service, judge
from gcs.doctor.software import check_cache, check_model, check_packages, check_page, check_python
from gcs.ports import VehicleStatus

READY = VehicleStatus(system_id=1, autopilot="px4", mode_name="AUTO.LOITER", heartbeat_s=1.0, position_ready=True)


def test_a_finding_has_a_remedy_exactly_when_something_is_to_be_done():
    with pytest.raises(ValueError, match="needs a remedy"):
        Finding("disk", Grade.RED, "full")
    with pytest.raises(ValueError, match="needs none"):
        Finding("disk", Grade.OK, "fine", "do this")


@pytest.mark.parametrize(("running", "grade"), [("3.11.7", Grade.OK), ("3.10.1", Grade.RED), ("3.15.0", Grade.RED)])
def test_python(running: str, grade: Grade):
    assert check_python(running, "<3.15,>=3.11").grade is grade


def test_packages_that_are_missing_or_old_are_named():
    found = check_packages(["numpy>=999", "no-such-package-here>=1", "pytest>=1; extra == 'dev'"])
    assert found.grade is Grade.RED
    assert "no-such-package-here is missing" in found.found
    assert "is not >=999" in found.found
    assert check_packages(["numpy>=1"]).found.startswith("1 of")


def test_page(tmp_path: Path):
    assert check_page(tmp_path).grade is Grade.CAUTION
    (tmp_path / "index.html").touch()
    assert check_page(tmp_path).grade is Grade.OK


def test_a_cache_that_cannot_be_written(tmp_path: Path):
    blocked = tmp_path / "file"
    blocked.touch()
    assert check_cache(str(blocked / "below")).grade is Grade.CAUTION
    assert check_cache(str(tmp_path / "new")).grade is Grade.OK


def test_the_shipped_model_loads():
    assert check_model().grade is Grade.OK


def test_a_full_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    def free(amount: int) -> Grade:
        usage = type("Usage", (), {"free": amount})
        monkeypatch.setattr(machine_checks.shutil, "disk_usage", lambda _folder: usage)
        return machine_checks.check_disk(tmp_path / "not" / "there" / "yet").grade

    assert [free(size) for size in (10 * 2**20, 2**30, 10 * 2**30)] == [Grade.RED, Grade.CAUTION, Grade.OK]


def test_stores(tmp_path: Path):
    future = tmp_path / "data" / "gcs.db"
    assert machine_checks.check_store(f"sqlite:///{future}").grade is Grade.OK
    assert not future.parent.exists(), "looking makes nothing"
    broken = tmp_path / "broken.db"
    broken.write_bytes(b"this is no database, whatever its name says" * 40)
    assert machine_checks.check_store(f"sqlite:///{broken}").grade is Grade.RED
    assert machine_checks.check_store("nonsense").grade is Grade.RED
    gone = machine_checks.check_store("postgresql://ann:secret@127.0.0.1:1/none?connect_timeout=2")
    assert gone.grade is Grade.RED
    assert "secret" not in gone.found


def test_a_port_in_use_and_one_that_is_not():
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        found = machine_checks.check_port("127.0.0.1", port)
    assert (found.grade, "in use" in found.found) == (Grade.RED, True)
    assert machine_checks.check_port("127.0.0.1", 0).grade is Grade.OK
    assert machine_checks.check_port("192.0.2.1", 8080).grade is Grade.RED


@pytest.mark.parametrize(("most", "grade"), [(212_992, Grade.CAUTION), (4 << 20, Grade.OK), (None, Grade.OK)])
def test_receive_buffer(most: int | None, grade: Grade):
    assert machine_checks.check_receive_buffer(most).grade is grade


def test_clocks():
    assert machine_checks.check_calendar(datetime(1970, 1, 1, tzinfo=UTC)).grade is Grade.RED
    assert machine_checks.check_calendar(datetime(2030, 1, 1, tzinfo=UTC)).grade is Grade.OK
    grades = [machine_checks.check_synchronised(answer).grade for answer in (True, False, None)]
    assert grades == [Grade.CAUTION, Grade.OK, Grade.OK]
    assert machine_checks.check_ticks([0.001, 0.2]).grade is Grade.CAUTION
    assert machine_checks.check_ticks([0.001, 0.002]).grade is Grade.OK


def test_keys_are_needed_where_strangers_can_come():
    assert machine_checks.check_keys(host_is_loopback=False, any_keys=False).grade is Grade.RED
    assert machine_checks.check_keys(host_is_loopback=True, any_keys=False).grade is Grade.OK
    assert machine_checks.check_keys(host_is_loopback=False, any_keys=True).grade is Grade.OK


def test_every_check_of_the_machine_says_something(tmp_path: Path):
    config = ServerConfig.model_validate({"store": {"url": f"sqlite:///{tmp_path / 'x.db'}"}, "server": {"port": 0}})
    found = {finding.check for finding in machine_checks.machine(config)}
    assert found == {"disk", "store", "port", "receive buffer", "date", "clock", "ticks"}


@pytest.mark.parametrize(
    ("vehicle", "grade", "words"),
    [
        (None, Grade.RED, "nothing heard"),
        (VehicleStatus(1), Grade.RED, "nothing heard"),
        (VehicleStatus(1, heartbeat_s=1.0), Grade.RED, "unknown"),
        (READY, Grade.OK, "ready"),
        (VehicleStatus(1, "px4", heartbeat_s=1.0, conflict="two drones are 1"), Grade.RED, "two drones"),
        (VehicleStatus(1, "px4", heartbeat_s=1.0, armed=True), Grade.CAUTION, "armed"),
        (VehicleStatus(1, "px4", heartbeat_s=1.0, loss_ratio=0.3), Grade.CAUTION, "30 %"),
        (VehicleStatus(1, "px4", heartbeat_s=1.0), Grade.CAUTION, "not ready"),
    ],
)
def test_a_drone(vehicle: VehicleStatus | None, grade: Grade, words: str):
    found = judge(1, "udpout:127.0.0.1:14550", vehicle, 6.0)
    assert found.grade is grade
    assert words in found.found


def test_a_fleet_port_that_somebody_has():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        (found,) = check_fleet({1: f"udpin:127.0.0.1:{taken.getsockname()[1]}"}, 0.1)
    assert (found.grade, "cannot listen" in found.found) == (Grade.RED, True)
    assert next(iter(check_fleet({}))).grade is Grade.CAUTION


def test_a_policy_service():
    def answer(status: int):
        return lambda url, timeout: httpx.Response(status, request=httpx.Request("GET", url))

    assert list(check_policy_service(None)) == []
    assert next(check_policy_service("http://a", answer(200))).grade is Grade.OK
    assert next(check_policy_service("http://a", answer(503))).grade is Grade.RED
    assert next(check_policy_service("http://127.0.0.1:1")).grade is Grade.RED
