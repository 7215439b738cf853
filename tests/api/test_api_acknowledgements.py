"""Alerts acknowledged by name."""

import httpx
from api_server import Server

from gcs.ports import Event, Severity
from gcs.store.keys import Role

URL = "/api/v1/acknowledgements"


def told(server: Server, severity: Severity) -> dict[str, float]:
    server.store.journal.record(Event(3.25, "link.lost", "UAV 2 is silent", severity, "c1", 2))
    assert server.store.journal.settle(10.0)  # an event is told when it is in the store
    return {"sequence": server.store.tail.last_sequence, "time_s": 3.25}


def test_the_first_name_stands_and_every_page_is_told(keyed: Server, operator: httpx.Client) -> None:
    alert = told(keyed, Severity.WARNING)
    assert operator.post(URL, json=alert).json() == {"sequence": alert["sequence"], "by": "operator"}
    with keyed.client(Role.ADMIN) as admin:
        assert admin.post(URL, json=alert).json()["by"] == "operator"
    (heard,) = keyed.store.tail.since(int(alert["sequence"]))
    assert (heard.event.kind, heard.event.actor, heard.event.system_id) == ("alert.acknowledged", "operator", 2)
    assert heard.event.data == {"sequence": alert["sequence"]}
    assert heard.event.message == '"UAV 2 is silent" acknowledged'


def test_only_alerts_that_this_server_told_can_be_acknowledged(keyed: Server, operator: httpx.Client) -> None:
    alert = told(keyed, Severity.CAUTION)
    assert operator.post(URL, json=alert | {"time_s": 9.0}).status_code == 404
    assert operator.post(URL, json=alert | {"sequence": 10**6}).status_code == 404
    assert operator.post(URL, json=told(keyed, Severity.INFO)).status_code == 409
    with keyed.client(Role.VIEWER) as viewer:
        assert viewer.post(URL, json=alert).status_code == 403
