"""The typed client against a real server; and its two halves and types against their sources."""

import ast
import asyncio
import subprocess
import sys
import time
from datetime import UTC, datetime
from importlib import import_module
from pathlib import Path

import httpx
import pytest
from api_server import LIVE, SMALL, Server, serving

from gcs.api.settings import ApiSettings, MapTiles
from gcs.cli.openapi import openapi_document
from gcs.client import ApiError, AsyncClient, Client, ClientError, UnreachableError, aio, calls, models, sync
from gcs.store.keys import Role
from gcs.store.store import Store

HERE = Path(aio.__file__).parent
write_models = import_module("gcs.client.write_models")
unasync = import_module("gcs.client.unasync")


@pytest.fixture
def client(keyed: Server) -> Client:
    return Client(keyed.url, keyed.keys[Role.ADMIN])


def test_a_campaign_from_its_making_to_its_report(keyed: Server, client: Client) -> None:
    with client:
        assert client.me().role == "admin"
        made = client.create(SMALL)
        assert (made.name, made.state, made.static.size_m) == ("small", "ready", (1667.0, 1222.0))
        assert isinstance(made.created_at, datetime)
        assert client.start(made.id, override=True).accepted
        assert client.pause(made.id).state == "paused"
        assert client.resume(made.id).state == "flying"
        for slot in range(2):
            keyed.store.journal.record_slot(made.id, keyed.control.end_slot(slot))
        assert keyed.store.journal.flush(10.0)
        assert [point.slot for point in client.series(made.id)] == [1]
        assert client.recording(made.id).last_slot == 1
        page = client.recorded_slots(made.id, first=1, limit=5)
        assert ([slot.slot for slot in page.slots], page.next_first) == ([1], None)
        assert client.report(made.id, places=False)["slots"][0]["users"][0]["east_m"] is None
        assert client.report_file(made.id, "html").startswith(b"<!doctype html>")
        assert b"FeatureCollection" in client.report_file(made.id, "geojson", places=False)
        assert client.abort(made.id).state in {"recovering", "aborted"}
        assert [brief.id for brief in client.campaigns(limit=5)] == [made.id]


def test_drones_obey_and_refuse_in_their_own_words(client: Client) -> None:
    with client:
        assert [drone.system_id for drone in client.drones()] == [1, 2]
        assert client.drone(2).autopilot == "px4"
        verdict = client.command(1, "takeoff", altitude_m=20.0)
        assert (verdict.system_id, verdict.command) == (1, "takeoff")
        assert client.emergency_stop().accepted
        assert client.reset_emergency_stop().accepted
        assert client.emergency_stop_one(2).accepted
        assert client.first(models.SnapshotMessage).stopped_ids == [2]
        assert client.reset_emergency_stop_one(2).accepted


def test_what_is_at_hand_and_the_log_and_keys(client: Client) -> None:
    with client:
        assert "demo" in {mission.name for mission in client.missions()}
        assert client.mission("demo")["campaign"]["name"] == "demo"
        assert "random" in {policy.name for policy in client.policies()}
        key = client.add_key("field laptop", "viewer")
        assert key.key.startswith("ucs_")
        client.revoke_key(key.id)
        known = client.keys()
        assert {one.revoked_at is None for one in known if one.id == key.id} == {False}
        page = client.events(kind="keys.added", since=datetime(2020, 1, 1, tzinfo=UTC))
        assert [event.actor for event in page.events] == ["admin"]
        assert client.readiness().ready
        assert client.liveness().alive
        assert client.map_background().kind == "none"


def test_live_users(client: Client) -> None:
    with client:
        made = client.create(LIVE)
        fix = {"user": "u1", "lat_deg": 40.4253, "lon_deg": -86.92, "time": datetime.now(UTC), "pending_mb": None}
        assert client.send_fixes(made.id, [fix]).accepted == 1
        assert client.send_uploads(made.id, [{"user": "u1", "time": datetime.now(UTC).timestamp()}]).accepted == 1
        assert client.send_departures(made.id, [{"user": "u1", "time": datetime.now(UTC)}]).accepted == 1


def test_a_dry_run_can_be_ended(client: Client) -> None:
    with client:
        made = client.create("demo", "random")
        with pytest.raises(ApiError, match="404"):
            client.forecast(made.id)
        run = client.begin_dry_run({"campaign": made.id})
        assert client.dry_run(run.id).id == run.id
        assert [one.id for one in client.dry_runs()] == [run.id]
        assert client.cancel_dry_run(run.id).state in {"cancelled", "done"}


def test_a_finished_dry_run_foretells_its_campaign(client: Client) -> None:
    with client:
        made = client.create(SMALL)
        run = client.begin_dry_run({"campaign": made.id})
        while client.dry_run(run.id).state == "running":
            time.sleep(0.02)
        foretold = client.forecast(made.id)
        assert (foretold.id, foretold.state) == (run.id, "done")


def test_the_stream_is_typed(client: Client) -> None:
    with client:
        hello = client.first(models.HelloMessage)
        assert hello.role == "admin"
        snapshot = client.first(models.SnapshotMessage, rate_hz=20.0)
        assert [vehicle.system_id for vehicle in snapshot.vehicles] == [1, 2]


def test_the_other_client_does_the_same(keyed: Server) -> None:
    async def talk() -> None:
        async with AsyncClient(keyed.url, keyed.keys[Role.OPERATOR]) as client:
            made, drones = await asyncio.gather(client.create(SMALL), client.drones())
            assert (made.state, len(drones)) == ("ready", 2)
            assert (await client.abort(made.id)).state == "aborted"
            assert (await client.wait(made.id)).state == "aborted"
            assert (await client.first(models.SnapshotMessage)).tick > 0
            with pytest.raises(ApiError) as refused:
                await client.keys()
            assert refused.value.status == 403

    asyncio.run(talk())


def test_refusals_carry_the_problem_document(keyed: Server, client: Client) -> None:
    with client:
        made = client.create(SMALL)
        client.abort(made.id)
        with pytest.raises(ApiError, match="409") as refused:
            client.start(made.id, override=True)
        assert refused.value.state == "aborted"
        with pytest.raises(ApiError) as refused:
            client.command(1, "loop")
        assert refused.value.errors[0]["where"] == "/command"
    with Client(keyed.url) as nobody, pytest.raises(ClientError, match="401"):
        nobody.drones()
    with Client(keyed.url) as nobody, pytest.raises(UnreachableError):
        nobody.first(models.HelloMessage)


def test_nobody_there_is_told_after_three_tries(monkeypatch: pytest.MonkeyPatch) -> None:
    waited: list[float] = []
    monkeypatch.setattr(sync.time, "sleep", waited.append)
    with Client("http://127.0.0.1:1") as client, pytest.raises(UnreachableError):
        client.drones()
    assert waited == [0.5, 1.0]


def test_a_repeated_change_keeps_its_key_and_a_busy_server_is_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    waited: list[float] = []
    monkeypatch.setattr(sync.time, "sleep", waited.append)
    keys: list[str] = []

    def answer(request: httpx.Request) -> httpx.Response:
        keys.append(request.headers["idempotency-key"])
        match len(keys):
            case 1:
                raise httpx.ReadTimeout("late", request=request)
            case 2:
                return httpx.Response(429, headers={"retry-after": "3"})
            case _:
                return httpx.Response(202, json={"detail": "all vehicles stop"})

    with Client("http://test", transport=httpx.MockTransport(answer)) as client:
        assert client.emergency_stop().detail == "all vehicles stop"
        client.reset_emergency_stop()
    assert waited == [0.5, 3.0]
    assert keys[0] == keys[1] == keys[2] != keys[3]


@pytest.mark.parametrize("body", [b"<html>proxy</html>", b"[1]", b""])
def test_a_proxys_own_words_are_no_traceback(body: bytes) -> None:
    transport = httpx.MockTransport(lambda request: httpx.Response(502, content=body))
    with Client("http://test", transport=transport) as client, pytest.raises(ApiError, match="502: Bad Gateway"):
        client.me()


def test_map_tiles_are_read_in_parts(server_store: Store, tmp_path: Path) -> None:
    file = tmp_path / "campus.pmtiles"
    file.write_bytes(bytes(range(200)))
    settings = ApiSettings(one_time_key="k", dashboard=tmp_path / "none", map_tiles=MapTiles(pmtiles=file))
    with serving(server_store, settings) as server, Client(server.url) as client:
        assert client.map_background().url == "map/tiles.pmtiles"
        assert client.map_tiles(offset=10, length=5) == bytes(range(10, 15))
        assert client.map_tiles() == file.read_bytes()


def test_messages_and_fields_of_a_newer_server_are_passed_over() -> None:
    assert calls.message('{"type": "weather", "wind_mps": 3}') is None
    assert models.Taken.model_validate({"detail": "yes", "mood": "good"}).detail == "yes"


def test_every_type_is_the_servers_own() -> None:
    wanted = write_models.models(openapi_document())
    known = {
        node.name: {
            line.target.id: ast.unparse(line).partition(": ")[2]
            for line in node.body
            if isinstance(line, ast.AnnAssign) and isinstance(line.target, ast.Name)
        }
        for node in ast.parse((HERE / "models.py").read_text("utf-8")).body
        if isinstance(node, ast.ClassDef) and node.name != "Answer"
    }
    theirs = {
        name: {field: ast.unparse(ast.parse(f"_: {text}")).partition(": ")[2] for field, text in fields.items()}
        for name, fields in wanted.items()
    }
    assert len(known) > 30
    assert known == theirs, "run make client"


def test_the_waiting_client_is_written_from_the_awaiting_one(tmp_path: Path) -> None:
    fresh = tmp_path / "sync.py"
    fresh.write_text(unasync.synchronous((HERE / "aio.py").read_text("utf-8")), encoding="utf-8")
    config = ["--config", str(Path(__file__).parents[2] / "pyproject.toml")]
    for words in (["check", "--quiet", "--fix"], ["format", "--quiet"]):
        subprocess.run([sys.executable, "-m", "ruff", *words, *config, str(fresh)], check=True)
    assert fresh.read_text("utf-8") == (HERE / "sync.py").read_text("utf-8"), "run make client"


def test_importing_the_client_loads_nothing_of_the_server() -> None:
    script = (
        "import gcs.client, sys; print(*[m for m in sys.modules if m.split('.')[0] in ('numpy', 'fastapi', 'policy')])"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ""
