"""From what a client sent to a checked mission. A client names traces and models, it does not reach into our disk."""

from collections.abc import Mapping
from typing import Any

from pydantic import ValidationError

from gcs.api.bodies import MissionByName
from gcs.api.problems import Problem
from policy.agents.registry import LEARNED
from policy.mission_file import Mission, MissionError, list_missions, load_mission, open_campaign, parse_mission

PATH_KEYS = (("users", "trace"), ("policy", "checkpoint"))


def mission_from(body: Mapping[str, Any]) -> Mission:
    """Checked and opened once, so that a missing trace is told now and not at take-off. 422 with the one line."""
    try:
        mission = _by_name(body) if "mission" in body else _by_document(body)
        open_campaign(mission)
    except MissionError as error:
        raise Problem(422, str(error)) from None
    if mission.checkpoint is not None and mission.policy not in LEARNED:
        raise Problem(422, f'[policy] checkpoint: "{mission.policy}" does not learn and takes none; leave it out')
    return mission


def _by_name(body: Mapping[str, Any]) -> Mission:
    wish = _checked(body)
    known = list_missions()
    if wish.mission not in known:
        raise Problem(422, f"mission: there is none of this name; known: {', '.join(sorted(known)) or 'none'}")
    mission = load_mission(known[wish.mission])
    if wish.policy is None and wish.checkpoint is None:
        return mission
    own = mission.document.get("policy", {})
    policy = {**own, "name": wish.policy or mission.policy}
    if wish.checkpoint is not None:
        policy["checkpoint"] = wish.checkpoint
    elif policy["name"] != mission.policy:
        policy.pop("checkpoint", None)  # it belongs to the mission's own policy
    document = {**mission.document, "policy": policy}
    return parse_mission(document, origin=wish.mission, directory=mission.directory)


def _checked(body: Mapping[str, Any]) -> MissionByName:
    try:
        return MissionByName.model_validate(body)
    except ValidationError as error:
        first = error.errors(include_input=False, include_url=False)[0]
        raise Problem(422, f"/{'/'.join(map(str, first['loc']))[:60]}: {first['msg']}") from None


def _by_document(document: Mapping[str, Any]) -> Mission:
    for section, key in PATH_KEYS:
        value = document.get(section)
        name = value.get(key) if isinstance(value, Mapping) else None
        if isinstance(name, str) and ("/" in name or "\\" in name or name.startswith(".")):
            raise Problem(422, f"[{section}] {key}: is a path; over the API give the bare name of a file at hand")
    return parse_mission(document, origin="document")
