"""What breaks, when, for how long and on which vehicle (docs/mock.md)."""

from sitl_mock.faults.fault import Effects, Fault, FaultError
from sitl_mock.faults.kinds import KINDS
from sitl_mock.faults.reader import FaultFileError, load, parse
from sitl_mock.faults.script import Script

__all__ = ["KINDS", "Effects", "Fault", "FaultError", "FaultFileError", "Script", "load", "parse"]
