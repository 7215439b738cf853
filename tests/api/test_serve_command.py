"""``gcs serve`` and ``gcs keys`` as processes: what an operator sees."""

import re
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import httpx
import pytest
from api_server import SMALL

from gcs.__main__ import main
from gcs.store.reading import EventFilter
from gcs.store.store import using_store

GCS = (sys.executable, "-m", "gcs")
WAIT_S = 60.0
ROOT = Path(__file__).parents[2]
KEY = re.compile(r"^ucs_[0-9a-f]{8}_[\w-]{43}$")


@dataclass(frozen=True)
class Ended:
    """How a command ended."""

    code: int
    out: str
    err: str


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Callable[..., Ended]:
    """Run a command that ends by itself, in an empty folder."""

    def command(*words: str) -> Ended:
        monkeypatch.chdir(tmp_path)
        try:
            code = main(words)
        except SystemExit as ended:
            code = int(ended.code or 0)
        out, err = capsys.readouterr()
        return Ended(code, out, err)

    return command


def url_of(tmp_path: Path) -> str:
    return f"sqlite:///{tmp_path / 'gcs.db'}"


@contextmanager
def running(*words: str) -> Iterator[tuple[subprocess.Popen[str], str, str]]:
    """The process, its address and its one-time key (empty when none was printed)."""
    process = subprocess.Popen(
        [*GCS, "serve", "--port", "0", *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=ROOT
    )
    try:
        assert process.stdout is not None
        lines = [process.stdout.readline() for _ in range(2)]
        address = re.search(r"open (\S+)/", "".join(lines))
        assert address, (lines, process.poll())
        key = process.stdout.readline().strip() if "127.0.0.1" in address[1] and "--host" not in words else ""
        yield process, address[1], key.rpartition(" ")[2]
    finally:
        process.kill()
        process.communicate()


def test_a_server_flies_nothing_without_drones_keeps_its_records_and_ends_cleanly(tmp_path: Path) -> None:
    with running("--store", url_of(tmp_path)) as (process, address, key):
        headers = {"authorization": f"Bearer {key}"}
        with httpx.Client(base_url=address, headers=headers, timeout=WAIT_S, trust_env=False) as client:
            made = client.post("/api/v1/campaigns", json=SMALL)
            assert made.status_code == 201
            started = client.post(f"/api/v1/campaigns/{made.json()['id']}/start")
            assert (started.status_code, "no drones" in started.json()["detail"]) == (409, True)
        process.send_signal(signal.SIGTERM)
        assert process.wait(WAIT_S) == 0
        assert process.stderr is not None
        assert process.stderr.read() == ""
    with using_store(url_of(tmp_path)) as store:
        assert [event.kind for event in store.events.find(EventFilter())] == ["campaign.created", "api.start"]


def test_the_flight_does_not_wait_for_the_web_side_to_load() -> None:
    """After a crash drones hang in the air: what only the web side needs is loaded beside the flight."""
    heavy = ("fastapi", "starlette", "uvicorn", "alembic", "jinja2", "pygal", "httpx", "torch")
    code = f"import sys, gcs.cli.serve; print([n for n in {heavy} if n in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert done.stdout.strip() == "[]"


def test_a_port_in_use_is_one_line(run: Callable[..., Ended], tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        ended = run("serve", "--port", str(port), "--store", url_of(tmp_path))
    assert ended.code == 2
    assert ended.err == (
        f"gcs serve: port {port} on 127.0.0.1 is in use: end who has it, or choose another with --port\n"
    )


def test_off_loopback_the_server_wants_keys_and_then_starts(run: Callable[..., Ended], tmp_path: Path) -> None:
    store = ("--store", url_of(tmp_path))
    refused = run("serve", "--host", "0.0.0.0", "--port", "0", *store)
    assert refused.code == 2
    assert "keys add" in refused.err
    assert refused.err.count("\n") == 1
    made = run("keys", "add", "--role", "viewer", "--name", "wall display", *store)
    assert made.code == 0
    assert KEY.match(made.out.strip())
    with running("--host", "0.0.0.0", *store) as (_, address, _key):
        headers = {"authorization": f"Bearer {made.out.strip()}"}
        assert httpx.get(f"{address}/api/v1/me", headers=headers, trust_env=False).json()["actor"] == "wall display"
        assert httpx.get(f"{address}/api/v1/me", trust_env=False).status_code == 401


def test_keys_are_listed_and_revoked(run: Callable[..., Ended], tmp_path: Path) -> None:
    store = ("--store", url_of(tmp_path))
    key_id = run("keys", "add", "--role", "admin", "--name", "ann", *store).out.split("_")[1]
    assert run("keys", "list", *store).out.startswith(f"{key_id}  admin     ann  made ")
    assert run("keys", "revoke", key_id, *store).code == 0
    assert "revoked" in run("keys", "list", *store).out
    again = run("keys", "revoke", key_id, *store)
    assert (again.code, again.err.count("\n")) == (2, 1)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("serve", "--port", "99999"), "[server] port"),
        (("serve", "--port", "many"), "--port"),
        (("serve", "--drone", "one"), "SYSID=ADDRESS"),
        (("serve", "--drone", "300=udpout:127.0.0.1:1"), "[drones]"),
        (("serve", "--store", "nonsense"), "store url"),
        (("serve", "--config", "missing.toml"), "missing.toml"),
        (("keys", "add", "--role", "king", "--name", "x"), "--role"),
        (("keys", "add", "--role", "viewer", "--name", "a\nb"), "--name"),
    ],
)
def test_mistakes_are_one_line(run: Callable[..., Ended], words: tuple[str, ...], said: str) -> None:
    ended = run(*words)
    assert ended.code == 2
    assert said in ended.err
    assert ended.err.count("\n") == 1


@pytest.mark.parametrize("words", [("serve",), ("keys",), ("keys", "add"), ("keys", "list"), ("keys", "revoke")])
def test_help(run: Callable[..., Ended], words: tuple[str, ...]) -> None:
    ended = run(*words, "--help")
    assert (ended.code, ended.err) == (0, "")
    assert "usage: gcs" in ended.out
