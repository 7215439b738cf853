"""``gcs audit verify`` as an operator sees it."""

from pathlib import Path

import pytest

from gcs.__main__ import main
from gcs.ports import Event
from gcs.store.store import using_store


def test_a_whole_log_a_changed_one_and_one_with_its_end_cut_off(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    url = f"sqlite:///{tmp_path / 'gcs.db'}"
    with using_store(url) as store:
        for i in range(3):
            store.journal.record(Event(float(i), "plan.late", str(i)))
    assert main(["audit", "verify", "--store", url]) == 0
    said = capsys.readouterr().out
    head = said.split()[-1]
    assert said.startswith("3 events are whole")
    with using_store(url) as store, store.engine.begin() as connection:
        connection.exec_driver_sql("DELETE FROM events WHERE id = 3")
    assert main(["audit", "verify", "--store", url]) == 0
    assert main(["audit", "verify", "--store", url, "--head", head]) == 1
    assert "cut off" in capsys.readouterr().err
    with using_store(url) as store, store.engine.begin() as connection:
        connection.exec_driver_sql("UPDATE events SET message = 'x' WHERE id = 1")
    assert main(["audit", "verify", "--store", url]) == 1
    assert capsys.readouterr().err.count("\n") == 1
    assert main(["audit", "verify", "--store", url, "--head", "abc"]) == 2
