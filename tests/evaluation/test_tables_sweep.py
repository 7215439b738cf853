"""A restart does only what is missing."""

from itertools import islice

import pytest
from tables_jobs import Note, done, jot

from policy.evaluation.files import OutputError
from policy.evaluation.tables.store import CellStore
from policy.evaluation.tables.sweep import lacking, sweep
from policy.evaluation.tables.workers import Failed, Finished, in_processes


def here(jobs):
    """In this process: what is counted is what the sweep asks for."""
    return (Finished(job, jot(job)) for job in jobs)


def silent(_):
    return None


@pytest.fixture
def places(tmp_path):
    notes = tmp_path / "notes"
    notes.mkdir()
    return CellStore.create(tmp_path / "out"), [Note(f"k{n}", notes) for n in range(5)], notes


def test_the_second_run_flies_only_what_the_first_did_not(places):
    store, jobs, notes = places
    first = sweep(jobs[:3], store, here, silent)
    assert (first.done, first.kept, first.failed) == (3, 0, ())
    told = []
    second = sweep(jobs, store, here, told.append)
    assert (second.done, second.kept) == (2, 3)
    assert done(notes) == ["k0", "k1", "k2", "k3", "k4"]
    assert [outcome.job.key for outcome in told] == ["k3", "k4"]
    assert sweep(jobs, store, here, silent).kept == 5
    assert len(done(notes)) == 5


def test_an_interrupted_run_keeps_each_cell_that_it_told_of(places):
    store, jobs, notes = places

    def interrupt_after_two(outcome, seen=[]):  # noqa: B006 - counts across calls
        seen.append(outcome)
        if len(seen) == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sweep(jobs, store, lambda todo: in_processes(todo, jot, 1), interrupt_after_two)
    assert len(list(store.all())) == 2
    rest = [job.key for job in lacking(jobs, store)]
    before = done(notes)
    assert sweep(jobs, store, here, silent).kept == 2
    assert sorted(done(notes)) == sorted([*before, *rest])


def test_a_failure_is_told_and_tried_again_next_time(places):
    store, jobs, _ = places

    def second_fails(todo):
        return [Finished(todo[0], jot(todo[0])), Failed(todo[1], "died")]

    assert [failed.job.key for failed in sweep(jobs[:2], store, second_fails, silent).failed] == ["k1"]
    assert [job.key for job in lacking(jobs[:2], store)] == ["k1"]


@pytest.mark.parametrize("damage", ["", "{", "[]", '{"key": "other"}', "\x00"])
def test_a_damaged_cell_is_flown_again(places, damage):
    store, jobs, _ = places
    sweep(jobs, store, here, silent)
    (store.folder / "k1.json").write_text(damage)
    assert [job.key for job in lacking(jobs, store)] == ["k1"]
    assert "k1" not in {cell["key"] for cell in islice(store.all(), 10)}


def test_a_folder_that_cannot_be_made_is_one_line(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="cannot be made a results folder"):
        CellStore.create(tmp_path / "file")
