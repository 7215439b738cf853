"""What is at hand: missions, policies with their models and where those came from."""

import json
from pathlib import Path
from typing import Any

from fastapi import APIRouter

from gcs.api.bodies import CheckpointView, MissionView, PolicyView
from gcs.store.jsonable import jsonable
from policy.agents.registry import LEARNED, policy_names
from policy.mission_file import Mission, MissionError, list_missions, load_mission

router = APIRouter(tags=["shelf"])
MODELS = Path(__file__).resolve().parents[3] / "policy" / "checkpoints"
MAX_CARD_BYTES = 1_000_000


@router.get("/missions")
def missions() -> list[MissionView]:
    """Mission files; one that cannot be flown says why."""
    return [_mission_view(name, path) for name, path in sorted(list_missions().items())]


@router.get("/policies")
def policies() -> list[PolicyView]:
    """Policies, and for those that learn the checkpoints with their provenance cards."""
    return [
        PolicyView(name=name, learned=name in LEARNED, checkpoints=checkpoints(MODELS, name) if name in LEARNED else [])
        for name in policy_names()
    ]


def checkpoints(folder: Path, policy: str) -> list[CheckpointView]:
    """Files of a policy: its name, then anything."""
    files = sorted(folder.glob(f"{policy}*.safetensors"))
    return [CheckpointView(file=file.name, provenance=_card(file.with_suffix(".json"))) for file in files]


def _card(path: Path) -> dict[str, Any] | None:
    """The card beside the model; a card that cannot be read counts as none."""
    try:
        if path.stat().st_size > MAX_CARD_BYTES:
            return None
        card = jsonable(json.loads(path.read_text("utf-8")))
    except (OSError, ValueError, RecursionError):
        return None
    return card if isinstance(card, dict) else None


def _mission_view(name: str, path: Path) -> MissionView:
    try:
        return _flyable(name, load_mission(path))
    except MissionError as error:
        return MissionView(name=name, error=str(error).replace(f"{path}", path.name))


def _flyable(name: str, mission: Mission) -> MissionView:
    return MissionView(
        name=name,
        title=mission.name,
        policy=mission.policy,
        uavs=mission.scenario.num_uavs,
        slots=mission.scenario.slots,
        slot_s=mission.scenario.slot_s,
        user_source=mission.users.kind,
        warnings=list(mission.warnings),
    )
