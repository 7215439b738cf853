"""Flight modes: the names and custom_mode numbers of the two flavours, and what the vehicle then does."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from sitl_mock.autopilot.constants import BaseMode


class Behaviour(Enum):
    """What a mode makes the vehicle do; both flavours share these."""

    PILOT = "a human's sticks; the scripted pilot hovers"
    HOLD = "stays where it is"
    TAKEOFF = "climbs to the takeoff height, then holds"
    GUIDED = "follows what the ground or a companion sends"
    MISSION = "flies the stored mission"
    RTL = "returns, lands, disarms"
    LAND = "lands here, disarms"


@dataclass(frozen=True, slots=True)
class Mode:
    """One flight mode of one flavour."""

    name: str
    custom_mode: int
    behaviour: Behaviour
    base_mode: BaseMode
    needs_position: bool = True


_STAB = BaseMode.CUSTOM | BaseMode.STABILIZE | BaseMode.MANUAL
_AUTO = BaseMode.CUSTOM | BaseMode.STABILIZE | BaseMode.AUTO | BaseMode.GUIDED
# ArduCopter sets GUIDED for every mode with its own navigation, never the AUTO bit (GCS_Mavlink.cpp).
_ARDU_NAV = BaseMode.CUSTOM | BaseMode.STABILIZE | BaseMode.MANUAL | BaseMode.GUIDED

# Mode::Number, ArduCopter/mode.h
ARDUPILOT_MODES = (
    Mode("STABILIZE", 0, Behaviour.PILOT, _STAB, needs_position=False),
    Mode("ALT_HOLD", 2, Behaviour.PILOT, _STAB, needs_position=False),
    Mode("AUTO", 3, Behaviour.MISSION, _ARDU_NAV),
    Mode("GUIDED", 4, Behaviour.GUIDED, _ARDU_NAV),
    Mode("LOITER", 5, Behaviour.HOLD, _ARDU_NAV),
    Mode("RTL", 6, Behaviour.RTL, _ARDU_NAV),
    Mode("LAND", 9, Behaviour.LAND, _STAB, needs_position=False),
    Mode("POSHOLD", 16, Behaviour.HOLD, _STAB),
    Mode("BRAKE", 17, Behaviour.HOLD, _STAB),
)


def px4_custom_mode(main: int, sub: int = 0) -> int:
    """PX4 packs main mode into byte 2 and sub mode into byte 3 (px4_custom_mode.h)."""
    return main << 16 | sub << 24


PX4_MODES = (
    Mode("MANUAL", px4_custom_mode(1), Behaviour.PILOT, _STAB, needs_position=False),
    Mode("ALTCTL", px4_custom_mode(2), Behaviour.PILOT, _STAB, needs_position=False),
    Mode("AUTO.TAKEOFF", px4_custom_mode(4, 2), Behaviour.TAKEOFF, _AUTO),
    Mode("AUTO.LOITER", px4_custom_mode(4, 3), Behaviour.HOLD, _AUTO),
    Mode("POSCTL", px4_custom_mode(3), Behaviour.HOLD, _STAB),
    Mode("AUTO.MISSION", px4_custom_mode(4, 4), Behaviour.MISSION, _AUTO),
    Mode("AUTO.RTL", px4_custom_mode(4, 5), Behaviour.RTL, _AUTO),
    Mode("AUTO.LAND", px4_custom_mode(4, 6), Behaviour.LAND, _AUTO, needs_position=False),
    Mode("OFFBOARD", px4_custom_mode(6), Behaviour.GUIDED, _AUTO),
    Mode("STABILIZED", px4_custom_mode(7), Behaviour.PILOT, _STAB, needs_position=False),
)


class ModeTable:
    """The modes of one flavour, found by number, name or what they do."""

    def __init__(self, modes: tuple[Mode, ...]) -> None:
        """The first mode with a behaviour is the one that the flavour enters for it."""
        self._by_number = {mode.custom_mode: mode for mode in modes}
        self._by_name = {mode.name: mode for mode in modes}
        self._by_behaviour = {mode.behaviour: mode for mode in reversed(modes)}

    def by_number(self, custom_mode: int) -> Mode | None:
        """The mode of a custom_mode, None if the flavour has no such mode."""
        return self._by_number.get(custom_mode)

    def by_name(self, name: str) -> Mode | None:
        """The mode of a name, None if the flavour has no such mode."""
        return self._by_name.get(name)

    def doing(self, behaviour: Behaviour) -> Mode | None:
        """The mode that this flavour uses for a behaviour."""
        return self._by_behaviour.get(behaviour)

    @property
    def names(self) -> tuple[str, ...]:
        """All names."""
        return tuple(self._by_name)
