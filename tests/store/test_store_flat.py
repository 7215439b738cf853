"""What is written field by field holds no dataclass: one inside another would be kept as its text."""

from dataclasses import is_dataclass
from typing import get_args, get_type_hints

import pytest

from gcs.ports import Checkpoint, DroneCheckpoint, SetpointSummary, UavSlot, UserSlot


@pytest.mark.parametrize("record", [Checkpoint, DroneCheckpoint, SetpointSummary, UavSlot, UserSlot])
def test_records_written_by_their_fields_are_flat(record: type) -> None:
    nested = {
        name
        for name, kind in get_type_hints(record).items()
        if any(is_dataclass(one) for one in (kind, *get_args(kind)))
    }
    assert nested == ({"drones"} if record is Checkpoint else set())  # which are written by their own fields
