"""Files of trained networks: where the shipped ones lie, told by digest, and written so that a reader, or a crash,
never sees half of one.
"""

import hashlib
import os
import tempfile
from pathlib import Path

from policy.model.checkpoint_error import CheckpointError

SHIPPED = Path(__file__).resolve().parent.parent / "checkpoints"


def write_atomically(path: Path, content: bytes | memoryview) -> None:
    """Write beside, flush to disk, then rename over; the folder is made if missing."""
    path.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
    beside = Path(name)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        beside.chmod(0o644)
        beside.replace(path)
    finally:
        beside.unlink(missing_ok=True)


def check_digest(path: Path, expected: object) -> None:
    """Raise CheckpointError unless the file is the one that its card was written for."""
    if sha256(path) != expected:
        raise CheckpointError(f"{path}: differs from what its model card says (sha256); copy both again")


def sha256(path: Path) -> str:
    """Hexadecimal digest of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()
