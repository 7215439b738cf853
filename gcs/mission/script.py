"""Scripts: the steps that bring one drone up or down, as tables of small objects; the runner is here."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

if TYPE_CHECKING:
    from gcs.mission.drone import Drone, OrderTaker
    from gcs.mission.order import FlightSettings
    from gcs.ports import UavTrack


@dataclass(frozen=True)
class Failed:
    """A step cannot be done; in the operator's words."""

    reason: str


@dataclass(frozen=True)
class Done:
    """A step is done; ``then`` is put in before what follows."""

    then: tuple[Step, ...] = ()


@dataclass(frozen=True)
class Crew:
    """All drones of a campaign and the link, as one tick's steps see them; ``bystanders``: own drones that are in the
    air without the campaign.
    """

    drones: Sequence[Drone]
    link: OrderTaker
    settings: FlightSettings
    size_m: tuple[float, float]
    bystanders: Sequence[UavTrack] = ()


@dataclass(frozen=True)
class Moment:
    """One step of one drone at one tick; ``after_s`` since the step began."""

    drone: Drone
    crew: Crew
    now_s: float
    after_s: float


class Step:
    """One thing to be done by one drone. Steps hold no state: they stand in tables and serve all drones."""

    what: ClassVar[str] = ""
    follows: ClassVar[bool] = False  # only watches what the vehicle does by itself
    timeout_s: float  # on the flight clock

    def title(self) -> str:
        """For the page and for error messages."""
        return self.what

    def begin(self, at: Moment) -> None:
        """Set up what the step needs."""

    def check(self, at: Moment) -> Done | Failed | None:
        """None while it goes on."""
        raise NotImplementedError


class Script:
    """Steps in order, one after the other."""

    def __init__(self, steps: tuple[Step, ...]) -> None:
        self._steps = list(steps)
        self._since_s: float | None = None

    @property
    def finished(self) -> bool:
        """Nothing is left to do."""
        return not self._steps

    @property
    def follows(self) -> bool:
        """Nothing is sent to the drone: its own return or landing is watched."""
        return bool(self._steps) and self._steps[0].follows

    @property
    def step_name(self) -> str:
        """What is being done, for the page and for error messages."""
        return self._steps[0].title() if self._steps else ""

    def run(self, drone: Drone, crew: Crew, now_s: float) -> Failed | None:
        """Do what can be done now; a failure ends the script."""
        while self._steps:
            step = self._steps[0]
            begins = self._since_s is None
            since_s = now_s if self._since_s is None else self._since_s
            at = Moment(drone, crew, now_s, now_s - since_s)
            if begins:
                self._since_s = now_s
                step.begin(at)
            outcome = step.check(at)
            if outcome is None and at.after_s > step.timeout_s:
                outcome = Failed(
                    f"drone {drone.system_id}: {step.title()} took more than {step.timeout_s:.0f} s{last_words(drone)}"
                )
            if isinstance(outcome, Failed):
                self._steps.clear()
                return outcome
            if outcome is None:
                return None
            self._steps[:1] = outcome.then
            self._since_s = None
        return None


def last_words(drone: Drone) -> str:
    """The vehicle's own newest words: 'takeoff denied' without a reason helps nobody."""
    texts = drone.status.texts if drone.status is not None else ()
    return f"; it last said: {texts[-1]!r}" if texts else ""
