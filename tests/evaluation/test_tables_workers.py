"""Workers that die, and work with a defect."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from tables_jobs import Note, done, jot, stumble

from policy.evaluation.tables.workers import THREAD_VARIABLES, Failed, Finished, in_processes


def test_every_job_is_done_once_in_another_process_on_one_thread(tmp_path):
    before = {name: os.environ.get(name) for name in THREAD_VARIABLES}
    outcomes = list(in_processes([Note(f"k{n}", tmp_path) for n in range(6)], jot, workers=2))
    assert sorted(outcome.job.key for outcome in outcomes) == done(tmp_path) == [f"k{n}" for n in range(6)]
    assert all(isinstance(outcome, Finished) for outcome in outcomes)
    cells = [outcome.cell for outcome in outcomes if isinstance(outcome, Finished)]
    assert {cell["threads"] for cell in cells} == {"1"}
    assert os.getpid() not in {cell["pid"] for cell in cells}
    assert {name: os.environ.get(name) for name in THREAD_VARIABLES} == before


def test_a_worker_killed_in_the_middle_loses_no_job(tmp_path):
    jobs = [Note("a", tmp_path), Note("b", tmp_path, deaths=1), *(Note(f"k{n}", tmp_path) for n in range(4))]
    outcomes = list(in_processes(jobs, jot, workers=2))
    assert all(isinstance(outcome, Finished) for outcome in outcomes)
    assert sorted(outcome.job.key for outcome in outcomes) == sorted(job.key for job in jobs)
    assert done(tmp_path).count("b") == 2


def test_only_the_job_that_kills_its_workers_is_given_up(tmp_path):
    jobs = [Note("a", tmp_path), Note("bad", tmp_path, deaths=99), Note("c", tmp_path), Note("d", tmp_path)]
    outcomes = {outcome.job.key: outcome for outcome in in_processes(jobs, jot, workers=2)}
    assert {key for key, outcome in outcomes.items() if isinstance(outcome, Failed)} == {"bad"}
    assert set(outcomes) == {"a", "bad", "c", "d"}


def test_a_defect_is_raised(tmp_path):
    with pytest.raises(ZeroDivisionError):
        list(in_processes([Note("a", tmp_path)], stumble, workers=1))


HANGS = """
import sys
from pathlib import Path
from tables_jobs import Note, hang
from policy.evaluation.tables.workers import in_processes
if __name__ == "__main__":
    list(in_processes([Note("a", Path(sys.argv[1]))], hang, 1))
"""


@pytest.mark.parametrize("end", [signal.SIGKILL, signal.SIGTERM])
def test_workers_end_with_the_command(tmp_path, end):
    pipe, script = tmp_path / "pipe", tmp_path / "hangs.py"
    os.mkfifo(pipe)
    script.write_text(HANGS)
    here = str(Path(__file__).parent)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([here, *sys.path])}
    with subprocess.Popen([sys.executable, str(script), str(pipe)], env=environment) as command:
        with pipe.open() as reader:
            assert reader.readline() == "begun\n"
            command.send_signal(end)
            assert reader.read() == ""  # the worker is gone: nobody else holds the pipe
        command.wait()
