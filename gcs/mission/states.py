"""The campaign's states: one table, and nothing happens that is not in it."""

from enum import StrEnum

from gcs.ports import CampaignState


class Trigger(StrEnum):
    """What moves a campaign on."""

    OPEN = "open"  # mission read and checked
    START = "start"
    LAUNCHED = "launched"  # all drones at their start, under our velocity
    PAUSE = "pause"
    RESUME = "resume"
    LAST_SLOT = "last_slot"
    ABORT = "abort"  # a person wants everyone home
    FAIL = "fail"  # something makes going on impossible
    LANDED = "landed"  # everyone down after the last slot
    LANDED_ABORTED = "landed_aborted"
    LANDED_FAILED = "landed_failed"


class IllegalTransitionError(RuntimeError):
    """A trigger that the present state does not know."""


_S, _T = CampaignState, Trigger

TRANSITIONS: dict[tuple[CampaignState, Trigger], CampaignState] = {
    (_S.DRAFT, _T.OPEN): _S.READY,
    (_S.DRAFT, _T.FAIL): _S.FAILED,
    (_S.READY, _T.START): _S.LAUNCHING,
    (_S.READY, _T.ABORT): _S.ABORTED,
    (_S.LAUNCHING, _T.LAUNCHED): _S.FLYING,
    (_S.LAUNCHING, _T.ABORT): _S.RECOVERING,
    (_S.LAUNCHING, _T.FAIL): _S.RECOVERING,
    (_S.FLYING, _T.PAUSE): _S.PAUSED,
    (_S.FLYING, _T.LAST_SLOT): _S.RECOVERING,
    (_S.FLYING, _T.ABORT): _S.RECOVERING,
    (_S.FLYING, _T.FAIL): _S.RECOVERING,
    (_S.PAUSED, _T.RESUME): _S.FLYING,
    (_S.PAUSED, _T.ABORT): _S.RECOVERING,
    (_S.PAUSED, _T.FAIL): _S.RECOVERING,
    (_S.RECOVERING, _T.LANDED): _S.DONE,
    (_S.RECOVERING, _T.LANDED_ABORTED): _S.ABORTED,
    (_S.RECOVERING, _T.LANDED_FAILED): _S.FAILED,
}

IN_FLIGHT = frozenset({_S.LAUNCHING, _S.FLYING, _S.PAUSED, _S.RECOVERING})
FINAL = frozenset({_S.DONE, _S.ABORTED, _S.FAILED})

ENDINGS: dict[Trigger, Trigger] = {
    _T.LAST_SLOT: _T.LANDED,
    _T.ABORT: _T.LANDED_ABORTED,
    _T.FAIL: _T.LANDED_FAILED,
}
"""Why a recovery began decides how it ends."""


def is_allowed(state: CampaignState, trigger: Trigger) -> bool:
    """The table knows the pair."""
    return (state, trigger) in TRANSITIONS


def next_state(state: CampaignState, trigger: Trigger) -> CampaignState:
    """Look the pair up; an unknown pair is a defect of the caller and raises."""
    try:
        return TRANSITIONS[(state, trigger)]
    except KeyError:
        known = ", ".join(sorted(t for s, t in TRANSITIONS if s is state)) or "nothing"
        raise IllegalTransitionError(f"a campaign that is {state} does not {trigger}; it knows: {known}") from None
