"""Result files: the folder is checked before hours of work, and a reader never sees half a file."""

import os
import tempfile
from pathlib import Path


class OutputError(ValueError):
    """A result cannot be written there: one line."""


def check_destination(path: Path) -> None:
    """Raise :class:`OutputError` unless a file can be written at ``path``."""
    try:
        is_folder, has_folder = path.is_dir(), path.parent.is_dir()
    except OSError as error:  # a name too long, or a folder on the way that may not be searched
        raise OutputError(f"{str(path)!a}: is no usable file name: {error.strerror}") from error
    if "\0" in str(path):
        raise OutputError(f"{str(path)!a}: is no usable file name: it holds NUL")
    if is_folder:
        raise OutputError(f"{path}: is a folder; name a file")
    if not has_folder:
        raise OutputError(f"{path}: there is no folder {path.parent}; create it first")
    if not os.access(path.parent, os.W_OK):
        raise OutputError(f"{path}: the folder {path.parent} may not be written to")


def write_text(path: Path, text: str) -> None:
    """Write ``path`` at once: a temporary file beside it takes its place when it is complete.

    Devices and pipes such as /dev/stdout are written to, never replaced; a link's target is, not the link.
    Raises :class:`OutputError`.
    """
    try:
        target = path.resolve() if path.is_symlink() else path
        if path.exists() and not target.is_file():
            with path.open("w", encoding="utf-8") as device:
                device.write(text)
        else:
            _replace(target, text)
    except OSError as error:
        raise OutputError(f"{path}: cannot be written: {error.strerror or error}") from error


def _replace(path: Path, text: str) -> None:
    handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name[:100]}.", suffix=".part")
    part = Path(name)
    try:
        with os.fdopen(handle, "w", encoding="utf-8", newline="") as file:
            file.write(text)
        part.chmod(0o644)
        part.replace(path)
    except OSError:
        part.unlink(missing_ok=True)
        raise
