"""What a MAVLink library has to do for a fleet link: frames to messages, messages to frames. Two do it here."""

from collections.abc import Mapping, Sequence
from typing import Any, Final, NamedTuple, Protocol

OWN_SYSTEM_ID: Final = 245  # not 255: another ground station there would keep ArduPilot's failsafe quiet for us
OWN_COMPONENT_ID: Final = 190  # MAV_COMP_ID_MISSIONPLANNER
AUTOPILOT_COMPONENT: Final = 1  # MAV_COMP_ID_AUTOPILOT1

Fields = Mapping[str, Any]
"""A message's fields by their names in the MAVLink definitions."""


class Path(NamedTuple):
    """One way to a vehicle: our address, and who was heard there (host, port)."""

    address: str
    peer: tuple[str, int]


class Heard(NamedTuple):
    """A decoded message: ``body`` has the fields as attributes, or is None where only the header was read.

    ``sequence`` is None where the library hides it.
    """

    path: Path
    name: str
    system_id: int
    component_id: int
    sequence: int | None
    body: Any


class Wire(Protocol):
    """Never blocks; called by the flight thread only."""

    def read(self, now_s: float) -> Sequence[Heard]:
        """Everything that has arrived."""

    def write(self, name: str, fields: Fields, paths: Sequence[Path], now_s: float) -> None:
        """Send the message ``name`` (such as ``COMMAND_LONG``) over each path; no paths: to everyone."""

    def skipped(self) -> Mapping[str, int]:
        """Datagrams thrown away unread so far, by address."""

    def troubles(self) -> Sequence[str]:
        """What could not be sent, read or logged since the last call, a sentence for each address with trouble."""

    def close(self) -> None:
        """Release sockets."""
