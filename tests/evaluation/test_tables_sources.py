"""A cell's key depends on the sources that its own method is flown by, all of them and no others."""

import json
import shutil
import subprocess
import sys

import pytest

from policy.agents.registry import POLICIES, RIVALS
from policy.evaluation.tables.sources import PACKAGE, UnknownImportError, code_version, deciding, digest_sources

SHELL = ("__init__.py", "frames.py", "files.py", "results.py")
"""Of ``policy/evaluation``, loaded with the rollout but for notebooks only."""
FLY = """
import json, sys
from policy.agents.registry import agent_type, make_agent
from policy.evaluation.rollout import fly, jittered
from policy.mission_file import load_mission, open_campaign, vary
from policy.mobility.feed import TraceFeed
scenario, traces = open_campaign(vary(load_mission("demo"), slots=2))
def told(agent):
    fly(jittered(scenario, 1), TraceFeed(traces).as_places(), agent, 1)
    ours = [module for name, module in sys.modules.items() if name.split(".")[0] == "policy"]
    print(json.dumps([module.__file__ for module in ours if module.__file__]))
told(make_agent("gcrl"))
kind = agent_type("muzero").learner_type
told(agent_type("muzero")(learner=kind(kind.settings_type(hidden=8))))
"""


@pytest.fixture(scope="module")
def copied(tmp_path_factory):
    """The package's sources, copied once."""
    copy = tmp_path_factory.mktemp("sources") / "policy"
    shutil.copytree(PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__", "checkpoints"))
    return copy


@pytest.fixture
def package(copied):
    """The copy; what a test changes in it is put back."""
    before = {source: source.read_bytes() for source in copied.rglob("*.py")}
    yield copied
    for source, text in before.items():
        source.write_bytes(text)


def changed_by(package, *, source):
    """The policies whose digest changes with a line more in ``source``."""

    def digests():
        return {name: digest_sources(deciding(name, package), package) for name in POLICIES}

    before = digests()
    with (package / source).open("a") as file:
        file.write("\nANOTHER = 1\n")
    return {name for name, digest in digests().items() if digest != before[name]}


@pytest.mark.parametrize(
    ("source", "policies"),
    [
        ("agents/acktr.py", {"acktr"}),
        ("agents/rivals/kfac.py", {"acktr"}),
        ("agents/rivals/learner.py", set(RIVALS)),
        ("environments/field.py", set(RIVALS)),
        ("search/planner.py", {"gcrl", "receding-horizon"}),
        ("agents/gcrl_tree.py", {"gcrl"}),
        ("world/motion.py", set(POLICIES)),
        ("world/__init__.py", set(POLICIES)),
        ("mobility/feed.py", set(POLICIES)),
        ("mission_file/opening.py", set(POLICIES)),
        ("evaluation/rollout.py", set(POLICIES)),
        ("evaluation/tables/cells.py", set(POLICIES)),
        ("agents/registry.py", set(POLICIES)),
        ("evaluation/tables/markdown.py", set()),
        ("training/rivals.py", set()),
    ],
)
def test_a_change_flies_anew_whom_it_concerns_and_nobody_else(package, source, policies):
    assert changed_by(package, source=source) == policies


@pytest.mark.parametrize("line", ["from ..search import moves", "def late():\n    import policy.search.moves"])
def test_relative_and_late_imports_count(package, line):
    source = package / "agents" / "uniform.py"
    source.write_text(f"{source.read_text()}\n{line}\n")
    assert package / "search" / "moves.py" in deciding("random", package)


def test_modules_asked_for_by_a_written_out_name_count(package):
    source = package / "agents" / "uniform.py"
    source.write_text(f'{source.read_text()}\nimport importlib\nX = importlib.import_module("policy.search.moves")\n')
    assert package / "search" / "moves.py" in deciding("random", package)


def test_a_computed_name_is_an_error_that_says_where(package):
    source = package / "agents" / "uniform.py"
    source.write_text("import importlib\n\nX = importlib.import_module(NAME)\n")
    with pytest.raises(UnknownImportError, match=r"policy/agents/uniform\.py, line 3: .* write the name out"):
        deciding("random", package)


def test_all_methods_together_have_all_their_sources():
    assert set(deciding()) == {source for name in POLICIES for source in deciding(name)}
    assert len({code_version(), *(code_version(name) for name in POLICIES)}) == len(POLICIES) + 1


def test_whatever_a_flight_really_loads_is_among_them():
    answer = subprocess.run([sys.executable, "-c", FLY], capture_output=True, text=True, check=True)
    first, both = (set(json.loads(line)) for line in answer.stdout.splitlines())
    shell = {str(PACKAGE / "evaluation" / name) for name in SHELL}
    gcrl, muzero = ({str(source) for source in deciding(name)} for name in ("gcrl", "muzero"))
    assert str(PACKAGE / "search" / "planner.py") in first
    assert first - shell <= gcrl
    assert str(PACKAGE / "agents" / "rivals" / "tree.py") in both
    assert both - shell <= gcrl | muzero
