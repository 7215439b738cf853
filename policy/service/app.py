"""The HTTP service: POST /v1/act with all that a decision needs, GET /healthz.

Every request is complete in itself: a service that was restarted, or that made room for other campaigns, takes a
flying campaign up again, only without the plan it had. Agents live on between requests with one campaign id.
"""

import hashlib
import json
import threading
import time
from http import HTTPStatus
from typing import Annotated, Any

from fastapi import FastAPI
from pydantic import BaseModel, ConfigDict, Field

from policy.agents.registry import PolicyChoice, UnknownPolicyError, policy_names
from policy.mission_file import MissionError, load_mission, parse_mission
from policy.mission_file.checks import check_scenario
from policy.mission_file.mission import Source
from policy.mission_file.shelf import list_missions
from policy.model.checkpoint_error import CheckpointError
from policy.service.body_limit import BodyLimit
from policy.service.inprocess import PolicyFaultError, PolicyService, UnknownCampaignError
from policy.service.problems import ProblemError, install
from policy.service.validity import StateError
from policy.service.wire import DecisionWire, ScenarioWire, StateWire, decision_document, scenario_from, state_from
from policy.world.scenario import Scenario

DEFAULT_POLICY = "receding-horizon"
TRIES = 3
"""A campaign may make room for others between begin and act; more than this often is overload."""


class ActRequest(BaseModel):
    """A decision's whole input. Give the campaign as ``mission`` (name or document) or as ``scenario``."""

    model_config = ConfigDict(strict=True, extra="forbid")

    campaign_id: Annotated[str, Field(min_length=1, max_length=200)]
    mission: Annotated[str, Field(max_length=100)] | dict[str, Any] | None = None
    scenario: ScenarioWire | None = None
    policy: Annotated[str, Field(max_length=100)] | None = None
    seed: Annotated[int, Field(ge=0, le=2**31 - 1)] = 0
    state: StateWire


class Desk:
    """Turns requests into decisions; keeps which campaign each id stands for."""

    def __init__(self, default: PolicyChoice | None, service: PolicyService | None = None) -> None:
        """``default`` is flown where a request names no policy; its checkpoint serves its policy only."""
        self._default = default
        self._service = service or PolicyService()
        self._lock = threading.Lock()
        self._begun: dict[str, str] = {}

    def act(self, request: ActRequest) -> dict[str, Any]:
        """The answer. Raises ProblemError for anything wrong with the request."""
        begun_s = time.perf_counter()
        scenario, policy = self._campaign(request)
        state = state_from(request.state)
        for _ in range(TRIES):
            self._ensure(request, scenario, policy)
            try:
                decision = self._service.act(request.campaign_id, state)
            except UnknownCampaignError:
                continue
            except StateError as error:
                raise ProblemError(HTTPStatus.UNPROCESSABLE_ENTITY, str(error)) from error
            except PolicyFaultError as error:
                raise ProblemError(HTTPStatus.INTERNAL_SERVER_ERROR, str(error)) from error
            spent_ms = 1e3 * (time.perf_counter() - begun_s)
            return decision_document(request.campaign_id, state.slot, policy.name, decision, spent_ms)
        raise ProblemError(HTTPStatus.SERVICE_UNAVAILABLE, "too many campaigns at once; try again")

    def _ensure(self, request: ActRequest, scenario: Scenario, policy: PolicyChoice) -> None:
        """Begin the campaign unless this very one is under way."""
        fingerprint = _fingerprint(request, policy)
        with self._lock:
            under_way = self._begun.get(request.campaign_id) == fingerprint
        if under_way and self._service.knows(request.campaign_id):
            return
        try:
            self._service.begin(request.campaign_id, scenario, policy, request.seed)
        except (UnknownPolicyError, CheckpointError) as error:
            raise ProblemError(HTTPStatus.UNPROCESSABLE_ENTITY, str(error)) from error
        with self._lock:
            self._begun = {key: mark for key, mark in self._begun.items() if self._service.knows(key)}
            self._begun[request.campaign_id] = fingerprint

    def _campaign(self, request: ActRequest) -> tuple[Scenario, PolicyChoice]:
        if (request.mission is None) == (request.scenario is None):
            raise ProblemError(HTTPStatus.UNPROCESSABLE_ENTITY, "give either mission or scenario")
        try:
            if request.scenario is not None:
                return _scenario(request.scenario), self._choice(request.policy, None)
            mission = _mission(request.mission)
        except MissionError as error:
            raise ProblemError(HTTPStatus.UNPROCESSABLE_ENTITY, str(error)) from error
        own = PolicyChoice(mission.policy, mission.checkpoint)
        num_users = len(request.state.user_pos_enu_m)
        scenario = mission.scenario
        if len(scenario.collect_mbps) == 1:
            scenario = scenario.with_users(num_users)
        return scenario, self._choice(request.policy, own)

    def _choice(self, asked: str | None, own: PolicyChoice | None) -> PolicyChoice:
        """What the request names, else the service's own default, else the mission's."""
        for known in (self._default, own):
            if known is not None and asked in (None, known.name):
                return known
        return PolicyChoice(asked or DEFAULT_POLICY)


def create_app(default: PolicyChoice | None = None) -> FastAPI:
    """The application."""
    desk = Desk(default)
    app = FastAPI(title="UAV crowdsensing policy service", version="1", docs_url="/docs", redoc_url=None)
    app.add_middleware(BodyLimit)
    install(app)

    @app.post("/v1/act", response_model=DecisionWire, summary="Decide for one slot")
    def act(request: ActRequest) -> dict[str, Any]:
        return desk.act(request)

    @app.get("/v1/policies", summary="Methods that can be asked for")
    def policies() -> dict[str, list[str]]:
        return {"policies": list(policy_names())}

    @app.get("/healthz", summary="Alive")
    def healthz() -> dict[str, str]:
        return {"status": "ok"}

    return app


def _mission(reference: str | dict[str, Any] | None) -> Any:
    """A shipped mission by name (never by path), or a document without files of this machine."""
    if isinstance(reference, str):
        known = list_missions()
        if reference not in known:
            raise MissionError(
                f"mission: there is no {reference!a} here; by name there are: {', '.join(sorted(known))}"
            )
        return load_mission(known[reference])
    document = reference or {}
    policy = document.get("policy")
    if isinstance(policy, dict) and "checkpoint" in policy:
        raise MissionError("[policy] checkpoint: give the service its weights with `policy serve --checkpoint`")
    return parse_mission(document)


def _scenario(wire: ScenarioWire) -> Scenario:
    scenario = scenario_from(wire)
    check_scenario(scenario, Source("scenario"))
    return scenario


def _fingerprint(request: ActRequest, policy: PolicyChoice) -> str:
    scenario = request.scenario.model_dump() if request.scenario is not None else None
    parts = [request.mission, scenario, policy.name, policy.checkpoint, request.seed]
    return hashlib.sha256(json.dumps(parts, sort_keys=True, default=str).encode()).hexdigest()
