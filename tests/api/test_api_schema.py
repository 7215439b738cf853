"""Every operation of the OpenAPI document, fuzzed by schemathesis with the key of each role and with none.

The real application over ASGI, no network. Answers must be what the document says, none may be a 5xx, and who may not
change anything changes nothing. ``make fuzz`` tries many more values (UCS_FUZZ_EXAMPLES).
"""

import os
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import pytest
import schemathesis
from api_server import LIVE, SMALL
from fake_control import FakeControl
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from schemathesis import checks
from sqlalchemy import inspect, text

from gcs.api.app import create_app
from gcs.api.auth import needed_role
from gcs.api.settings import ApiSettings
from gcs.store.keys import Role
from gcs.store.store import Store, using_store

EXAMPLES = int(os.environ.get("UCS_FUZZ_EXAMPLES", "3"))  # of each operation, for each key

AS_THE_DOCUMENT_SAYS = [
    checks.not_a_server_error,
    checks.status_code_conformance,
    checks.content_type_conformance,
    checks.response_headers_conformance,
    checks.response_schema_conformance,
]
BODIES: dict[str, list[Any]] = {  # the document says "an object" of a mission
    "POST /api/v1/campaigns": [SMALL, {"mission": "demo"}],
    "POST /api/v1/drones/{sysid}/commands": [{"command": "hold"}],
}
FUZZ = settings(
    max_examples=EXAMPLES,
    deadline=None,
    derandomize=True,
    database=None,
    phases=[Phase.generate],
    suppress_health_check=list(HealthCheck),
)


@dataclass(frozen=True)
class Fuzzed:
    """The application with a campaign that flies and one of live users; ``headers`` of each role, None: of nobody."""

    schema: Any
    control: FakeControl
    store: Store
    headers: dict[Role | None, dict[str, str]]
    known: dict[str, list[str]]  # values of path parameters that lead somewhere

    def contents(self) -> dict[str, list[Any]]:
        """Every table but the log."""
        with self.store.engine.connect() as connection:
            names = sorted(set(inspect(connection).get_table_names()) - {"events"})
            return {name: list(connection.execute(text(f"SELECT * FROM {name}"))) for name in names}


@pytest.fixture(scope="module")
def fuzzed(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Fuzzed]:
    folder, control = tmp_path_factory.mktemp("fuzzed"), FakeControl()
    with using_store(f"sqlite:///{folder / 'fuzzed.sqlite3'}") as store:
        keys = {role: store.keys.add(role.value, role)[1] for role in Role}
        headers: dict[Role | None, dict[str, str]] = {role: {"authorization": f"Bearer {keys[role]}"} for role in Role}
        app = create_app(control, store, ApiSettings(host="0.0.0.0", dashboard=folder, rate_per_s=1e6))
        schema = schemathesis.openapi.from_asgi("/openapi.json", app)
        create, start = schema["/api/v1/campaigns"]["POST"], schema["/api/v1/campaigns/{campaign_id}/start"]["POST"]
        made = [create.Case(body=document).call(headers=headers[Role.OPERATOR]) for document in (SMALL, LIVE)]
        flown, live = (answer.json()["id"] for answer in made)
        started = start.Case(path_parameters={"campaign_id": flown}).call(headers=headers[Role.OPERATOR])
        assert started.status_code == 202
        for slot in range(3):
            store.journal.record_slot(flown, control.end_slot(slot))
        assert store.journal.flush(10.0)
        known = {"campaign_id": [flown, live], "name": ["demo"], "sysid": ["1"]}
        yield Fuzzed(schema, control, store, headers | {None: {}}, known)


def fuzz(fuzzed: Fuzzed, role: Role | None) -> dict[str, set[int]]:
    """Throw values at every operation; the statuses of each."""
    operations = [found.ok() for found in fuzzed.schema.get_all_operations()]
    return {operation.label: statuses(fuzzed, role, operation) for operation in operations}


def statuses(fuzzed: Fuzzed, role: Role | None, operation: Any) -> set[int]:
    told: set[int] = set()

    @given(operation.as_strategy(), st.data())
    @FUZZ
    def throw(case: Any, data: st.DataObject) -> None:
        for name in case.path_parameters or {}:
            if name in fuzzed.known and data.draw(st.integers(0, 3)):
                case.path_parameters[name] = data.draw(st.sampled_from(fuzzed.known[name]))
        if operation.label in BODIES and data.draw(st.booleans()):
            case.body = data.draw(st.sampled_from(BODIES[operation.label]))
        answer = case.call(headers=fuzzed.headers[role])
        told.add(answer.status_code)
        case.validate_response(answer, checks=AS_THE_DOCUMENT_SAYS)

    throw()
    return told


@pytest.mark.parametrize("role", [Role.OPERATOR, Role.ADMIN])
def test_who_may_fly_gets_what_the_document_says(fuzzed: Fuzzed, role: Role) -> None:
    told_by = fuzz(fuzzed, role)
    assert len(told_by) >= 35
    reached = [label for label, told in told_by.items() if told & {200, 201, 202, 204}]
    assert len(reached) >= 25, f"too few operations did anything: {told_by}"


@pytest.mark.parametrize("role", [Role.VIEWER, None])
def test_who_may_only_look_or_is_nobody_changes_nothing(fuzzed: Fuzzed, role: Role | None) -> None:
    before, asked = fuzzed.contents(), len(fuzzed.control.requests)
    told_by = fuzz(fuzzed, role)
    for label, told in told_by.items():
        method, _, path = label.partition(" ")
        needed = needed_role({"type": "http", "path": path, "method": method})
        if method != "GET" or (role is None and needed is not None):
            assert told == {401 if role is None else 403}, label
    assert fuzzed.store.journal.flush(10.0)
    assert fuzzed.contents() == before
    assert len(fuzzed.control.requests) == asked


def test_a_reporter_changes_nothing_but_reports(fuzzed: Fuzzed) -> None:
    before, asked = fuzzed.contents(), len(fuzzed.control.requests)
    told_by = fuzz(fuzzed, Role.REPORTER)
    for label, told in told_by.items():
        if not label.endswith(("/fixes", "/uploads", "/departures")) and "/api/" in label:
            assert told == {403}, label
    assert fuzzed.store.journal.flush(10.0)
    after = fuzzed.contents()
    assert {name for name in after if after[name] != before[name]} <= {"uploads"}
    assert len(fuzzed.control.requests) == asked
