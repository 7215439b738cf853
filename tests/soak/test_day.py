"""Three short campaigns of one server leave no thread, socket or task behind; `make soak` flies a day of them."""

import pytest
from day import spend


@pytest.mark.flight
def test_campaign_after_campaign_leaves_nothing_behind() -> None:
    day = spend(0.0, slots=3, least=3)
    assert day.ends == ["done"] * 3
    assert max(day.left().values()) <= 0, day.samples
    assert day.samples[-1].memory_mb < 1.15 * day.samples[0].memory_mb, day.samples
