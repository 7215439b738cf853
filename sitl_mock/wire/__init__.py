"""The mock's own MAVLink 2 codec (version 1 is read too). It shares nothing with the ground station's."""

from sitl_mock.wire.frame import Frame, encode
from sitl_mock.wire.parser import Parser

__all__ = ["Frame", "Parser", "encode"]
