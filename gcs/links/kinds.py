"""What the MAVLink definitions say of a message, as pymavlink's dialect has it, prepared for many frames a second."""

import inspect
from collections import namedtuple
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from itertools import accumulate
from struct import Struct
from typing import Any, Final

from pymavlink.dialects.v20 import ardupilotmega as mavlink


class Kind:
    """One message kind. ``is_plain``: each field is one number, so that all can be packed in one call; ``has_text``:
    some are characters, which are not unpacked here.
    """

    def __init__(self, kind: Any) -> None:
        self.kind = kind
        self.number: int = kind.id
        self.name: str = kind.msgname
        self.check = bytes((kind.crc_extra,))
        """Goes into a frame's checksum after its bytes (https://mavlink.io/en/guide/serialization.html)."""
        self.fields: tuple[str, ...] = tuple(kind.ordered_fieldnames)
        """In the order of the wire."""
        self.names = frozenset(self.fields)
        self.struct: Struct = kind.unpacker
        self.size: int = kind.unpacker.size
        self.has_text = any(code in kind.unpacker.format for code in "sc")
        self.is_plain = all(length == 1 for length in kind.lengths) and not self.has_text
        self._lengths = tuple(kind.lengths)
        self.is_read = kind.id not in _UNREAD

    @cached_property
    def body(self) -> Callable[[tuple[Any, ...]], Any]:
        """Makes unpacked values a message with the fields as attributes, several numbers of one field as a list."""
        made: Any = namedtuple(self.name, self.fields)  # type: ignore[misc]  # the dialect names the fields
        make: Callable[[Sequence[Any]], Any] = made._make
        if self.is_plain:
            return make
        ends = tuple(accumulate(self._lengths))
        spans = tuple((end - length, end) for end, length in zip(ends, self._lengths, strict=True))

        def gathered(values: tuple[Any, ...]) -> Any:
            return make([values[at] if end - at == 1 else list(values[at:end]) for at, end in spans])

        return gathered

    @cached_property
    def defaults(self) -> Mapping[str, Any]:
        """Of the fields that a sender may leave out: the extensions of MAVLink 2."""
        parameters = inspect.signature(self.kind.__init__).parameters.values()
        return {one.name: one.default for one in parameters if one.default is not inspect.Parameter.empty}


_UNREAD: Final = frozenset(  # numerous in a usual set of streams, and nothing here asks what they say
    kind.id
    for kind in (
        mavlink.MAVLink_gps_raw_int_message,
        mavlink.MAVLink_scaled_imu_message,
        mavlink.MAVLink_raw_imu_message,
        mavlink.MAVLink_scaled_pressure_message,
        mavlink.MAVLink_attitude_quaternion_message,
        mavlink.MAVLink_local_position_ned_message,
        mavlink.MAVLink_servo_output_raw_message,
        mavlink.MAVLink_nav_controller_output_message,
        mavlink.MAVLink_rc_channels_message,
        mavlink.MAVLink_vfr_hud_message,
        mavlink.MAVLink_attitude_target_message,
        mavlink.MAVLink_position_target_local_ned_message,
        mavlink.MAVLink_position_target_global_int_message,
        mavlink.MAVLink_highres_imu_message,
        mavlink.MAVLink_scaled_imu2_message,
        mavlink.MAVLink_altitude_message,
        mavlink.MAVLink_vibration_message,
        mavlink.MAVLink_ahrs2_message,
    )
)

BY_NUMBER: Final[dict[int, Kind]] = {number: Kind(kind) for number, kind in mavlink.mavlink_map.items()}
BY_NAME: Final[dict[str, Kind]] = {kind.name: kind for kind in BY_NUMBER.values()}
