"""docs/adding-a-method.md is true: its toy, added from outside, flies wherever a method flies."""

import re
import sys
from pathlib import Path
from types import MappingProxyType, ModuleType

import pytest

from policy.agents import registry
from policy.evaluation.evaluate import evaluate
from policy.evaluation.tables import methods
from policy.evaluation.tables.campuses import find_campus
from policy.evaluation.tables.cells import Point, fly_task, make_task
from policy.mission_file import load_mission

GUIDE = Path(__file__).parents[2] / "docs" / "adding-a-method.md"


@pytest.fixture
def hover(monkeypatch):
    """The guide's first two code blocks, put where they say."""
    code, line = re.findall(r"```python\n(.*?)```", GUIDE.read_text(), flags=re.DOTALL)[:2]
    module = ModuleType("policy.agents.hover")
    exec(compile(code, str(GUIDE), "exec"), module.__dict__)
    monkeypatch.setitem(sys.modules, "policy.agents.hover", module)
    entry = eval("{" + line + "}")
    known = MappingProxyType({**registry.POLICIES, **entry})
    for place in (registry, methods):
        monkeypatch.setattr(place, "POLICIES", known)


def test_the_guides_toy_is_evaluated_and_has_a_row_and_a_cell(hover, tiny):
    registry.check_name("hover")
    result = evaluate(load_mission(tiny), registry.PolicyChoice("hover"), seeds=2).result
    assert result.policy == "hover"
    assert result.metrics[0].energy_ratio == pytest.approx(
        0.843 * result.slots / 120, abs=2e-3
    )  # hovering all the time
    row = next(row for row in methods.registered(()) if row.name == "hover")
    campus = find_campus(str(tiny), None)
    cell = fly_task(make_task(campus, Point(campus.name, row.on(campus.name), 2, 117.0), 0))
    assert cell["metrics"]["episodic_aoi"] == result.metrics[0].episodic_aoi
    assert cell["policy"] == "hover"
