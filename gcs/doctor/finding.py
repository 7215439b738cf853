"""What one check found."""

from dataclasses import dataclass
from enum import StrEnum


class Grade(StrEnum):
    """Only red keeps a server or a flight from beginning."""

    OK = "ok"
    CAUTION = "caution"
    RED = "red"


@dataclass(frozen=True)
class Finding:
    """``found`` says what is; ``remedy`` what to do, empty when nothing is to be done."""

    check: str
    grade: Grade
    found: str
    remedy: str = ""

    def __post_init__(self) -> None:
        if (self.grade is Grade.OK) != (self.remedy == ""):
            raise ValueError(f"{self.check}: what is not ok needs a remedy, and what is ok needs none")


def ok(check: str, found: str) -> Finding:
    """Nothing to do."""
    return Finding(check, Grade.OK, found)


def caution(check: str, found: str, remedy: str) -> Finding:
    """It flies, worse than it could."""
    return Finding(check, Grade.CAUTION, found, remedy)


def red(check: str, found: str, remedy: str) -> Finding:
    """It does not fly like this."""
    return Finding(check, Grade.RED, found, remedy)
