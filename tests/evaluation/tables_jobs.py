"""Jobs that leave a line for each time that they are done, for workers in other processes."""

import os
import signal
import threading
from dataclasses import dataclass
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Note:
    """``deaths``: so many times its worker is killed in the middle of it."""

    key: str
    folder: Path
    deaths: int = 0


def done(folder: Path) -> list[str]:
    """Keys of the jobs begun, one entry a time, in no order."""
    return sorted(path.name.partition(".")[0] for path in folder.glob("*.begun"))


def jot(note: Note) -> dict[str, Any]:
    """The work. What it leaves behind is written before the worker dies."""
    times = sum(key == note.key for key in done(note.folder))
    (note.folder / f"{note.key}.{times}.begun").touch()
    if times < note.deaths:
        os.kill(os.getpid(), signal.SIGKILL)
    return {"key": note.key, "pid": os.getpid(), "threads": os.environ.get("OMP_NUM_THREADS")}


def stumble(note: Note) -> dict[str, Any]:
    """Work with a defect."""
    raise ZeroDivisionError(note.key)


def hang(note: Note) -> dict[str, Any]:
    """Work without end. Whoever reads the pipe ``folder`` sees its end when the worker does."""
    with note.folder.open("w") as pipe:
        pipe.write("begun\n")
        pipe.flush()
        threading.Event().wait()
    return {}
