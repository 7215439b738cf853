"""Where mission files lie: by path, or by name in the current, the repository's or the installed folder."""

import difflib
from pathlib import Path

from policy.mission_file.mission import MissionError

_ROOT = Path(__file__).resolve().parents[2]


def folders() -> tuple[Path, ...]:
    """Folders searched for a name: ``./missions``, the checkout's, the one inside an installed wheel."""
    return (Path("missions"), _ROOT / "missions", _ROOT / "gcs" / "missions")


def list_missions() -> dict[str, Path]:
    """Shipped and own missions by name; the first folder that has a name wins."""
    found: dict[str, Path] = {}
    for folder in folders():
        for path in sorted(folder.glob("*.toml")):
            found.setdefault(path.stem, path)
    return found


def find_mission(path_or_name: str | Path) -> Path:
    """The file meant. Raises :class:`MissionError` naming what there is."""
    shown = ascii(str(path_or_name)[:200])
    try:
        path = Path(path_or_name)
        if path.is_file():
            return path
        is_folder = path.is_dir()
    except (OSError, ValueError) as error:  # too long a name, or a NUL in it
        raise MissionError(f"{shown}: no such mission file: {error}") from error
    known = list_missions()
    if str(path_or_name) in known:
        return known[str(path_or_name)]
    if is_folder:
        raise MissionError(f"{shown}: is a folder; name the mission file in it")
    near = difflib.get_close_matches(path.stem, known, n=1)
    hint = f'did you mean "{known[near[0]]}"?' if near else f"by name there are: {', '.join(sorted(known)) or 'none'}"
    raise MissionError(f"{shown}: no such mission file; {hint}")
