"""Every block of commands, Python, settings or JSON on a page is run, or stands in a short list with the reason.

Blocks of shell and Python on a page that is followed are run there (``test_pages_followed.py``), others in this file
(:data:`RUN_HERE`). A command of ours that is too long for a test, or wants drones, is run smaller by another test: with
the same subcommand, and each of its options (:data:`RUN_BY`). :data:`NOT_RUN` has the rest.
"""

import re
import tomllib
from collections.abc import Callable
from contextlib import chdir
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fences import PAGES, ROOT, Command, Fence, commands, fences
from inside import lines_of, run_lines
from test_commands import PARSERS, RUN_BY
from test_pages_followed import FOLLOWED, WITH_THE_SAME_SERVER

from gcs.config import check_config
from gcs.ports import CampaignState
from gcs.store.keys import Role
from gcs.store.store import using_store
from policy.agents import registry
from policy.evaluation.rollout import fly
from policy.mission_file import load_mission, open_campaign, vary
from policy.mobility.feed import TraceFeed
from policy.service.app import ActRequest, Desk
from sitl_mock.autopilot import FLAVOURS
from sitl_mock.faults import load as load_faults

BLOCKS = [fence for page in PAGES for fence in fences(page)]
FOLLOWED_PAGES = {*FOLLOWED, *WITH_THE_SAME_SERVER}
TO_BE_READ = ("text",)
ENGINE = "wants a container engine; words, services and files are held by tests/packaging/test_containers.py"
NOT_RUN = {
    (
        "README.md",
        "make demo",
    ): "`make test` is what runs this; the flight of `make demo` is that of `gcs fly`, smaller",
    ("docs/install.md", "make demo"): "the same",
    ("docs/install.md", "make wheel"): "tests/packaging/test_wheel.py builds the wheel and has pipx install it",
    ("docs/install.md", "pipx run"): "tests/packaging/test_wheel.py does, with a shorter flight",
    ("docs/install.md", "docker compose -f compose.demo.yaml up"): ENGINE,
    ("docs/install.md", "docker compose -f compose.drones.yaml build"): ENGINE,
    ("docs/operator-page.md", "uptime; pytest"): "tests/dashboard/test_dashboard_load.py is one of the tests itself",
    ("docs/operator-page.md", "PYTHONPATH"): "an hour in a browser; tests/dashboard/test_dashboard_memory.py: minutes",
}
"""Page and beginning of the block -> why no test runs it."""

Run = Callable[[Fence, Path], Any]


def place(fence: Fence) -> str:
    return str(fence.page.relative_to(ROOT))


def a_method(fence: Fence, folder: Path) -> None:
    """It flies, and where it is told to."""
    names: dict[str, Any] = {}
    exec(fence.body, names)
    scenario, users = open_campaign(vary(load_mission("demo"), slots=2))
    assert fly(scenario, TraceFeed(users).as_places(), names["HoverAgent"]()).metrics is not None


def a_line_of_the_registry(fence: Fence, folder: Path) -> None:
    """Like those that are there: module of the room and name of the class."""
    ((name, (module, kind)),) = eval("{" + fence.body + "}").items()
    assert name not in registry.POLICIES
    assert module.startswith("policy.agents.")
    assert kind.endswith("Agent")


def traces(fence: Fence, folder: Path) -> None:
    rows = [f"{user},{15 * t},{400 + 50 * user},{300 + t}" for user in range(10) for t in range(121)]
    (folder / "purdue_59.csv").write_text("\n".join(["id,timestamp,x_distance,y_distance", *rows]))
    names: dict[str, Any] = {}
    with chdir(folder):
        exec(fence.body, names)
    assert len(names["split"].test.user_ids) == 3


def results(fence: Fence, folder: Path) -> None:
    names: dict[str, Any] = {}
    with chdir(ROOT):
        exec(fence.body, names)
    assert names["rows"][0]["episodic_aoi"]


def a_decision(fence: Fence, folder: Path) -> None:
    names: dict[str, Any] = {}
    exec(fence.body, names)
    assert np.shape(names["decision"].action.heading_rad) == (names["scenario"].num_uavs,)


def a_request(fence: Fence, folder: Path) -> None:
    """As it is; it brings its own users, so that no trace is needed."""
    answer = Desk(None).act(ActRequest.model_validate_json(fence.body))
    assert len(answer["heading_rad"]) == 2


def settings(fence: Fence, folder: Path) -> None:
    """Also those that are commented out, one at a time."""
    files = {"campus.pmtiles", "server.pem", "server-key.pem"}
    for file in files:
        (folder / file).touch()
    lines = fence.body.splitlines()
    with chdir(folder):
        check_config(tomllib.loads(fence.body), "page")
        for number, line in enumerate(lines):
            if not line.startswith("# ") or "key" in line.split(" ")[1] or "certificate" in line.split(" ")[1]:
                continue
            alone = [text for text in lines if not text.startswith("pmtiles")] if "tiles" in line else list(lines)
            alone[alone.index(line)] = line.removeprefix("# ")
            check_config(tomllib.loads("\n".join(alone)), f"page, line {number}")


def faults(fence: Fence, folder: Path) -> None:
    file = folder / "faults.toml"
    file.write_text(fence.body)
    (fault,) = load_faults(file, vehicles=2, modes=FLAVOURS["px4"].modes.names)
    assert fault.kind == "loss"


def keys(fence: Fence, folder: Path) -> None:
    """ID stands for the one that the list shows."""
    with using_store(f"sqlite:///{folder / 'gcs-data' / 'gcs.db'}") as store:
        known, _ = store.keys.add("old laptop", Role.VIEWER)
    out = by_the_line(fence, folder, known.id)
    assert re.search(r"old laptop.*active", out)
    assert "field laptop" in out


def places(fence: Fence, folder: Path) -> None:
    """Of a campaign that never flew there is nothing to wipe."""
    with using_store(f"sqlite:///{folder / 'gcs-data' / 'gcs.db'}") as store:
        campaign = store.campaigns.create(load_mission("demo"), "operator")
        store.campaigns.set_state(campaign.id, campaign.state, CampaignState.ABORTED, "not flown")
    by_the_line(fence, folder, campaign.id)


def by_the_line(fence: Fence, folder: Path, name: str) -> str:
    """Commands as they are, ID replaced."""
    body = re.sub(r"\bID\b", name, fence.body).replace("python -m gcs", "gcs").replace("python -m policy", "policy")
    lines = lines_of(Fence(fence.page, fence.line, "sh", "", re.sub(r"\s+#.*$", "", body, flags=re.MULTILINE)))
    assert lines
    code, out, err = run_lines(lines, folder, {"UCS_DATA_DIR": str(folder)})
    assert code == 0, f"{fence.place}: {err}"
    return out


RUN_HERE: dict[tuple[str, str], Run] = {
    ("docs/adding-a-method.md", "import numpy"): a_method,
    ("docs/adding-a-method.md", '"hover"'): a_line_of_the_registry,
    ("docs/mobility.md", "from pathlib"): traces,
    ("docs/tables.md", "from policy"): results,
    ("docs/policy-cli.md", "from policy"): a_decision,
    ("docs/policy-cli.md", "{"): a_request,
    ("docs/api.md", "[server]"): settings,
    ("docs/api.md", "python -m gcs keys"): keys,
    ("docs/operator-page.md", "[map]"): settings,
    ("docs/privacy.md", "[users]"): settings,
    ("docs/privacy.md", "python -m gcs places"): places,
    ("docs/mock.md", "[[fault]]"): faults,
}
"""Page and beginning of the block -> what runs it and looks at what came of it."""


def the_block(page: str, beginning: str) -> Fence:
    (found,) = [fence for fence in BLOCKS if place(fence) == page and fence.body.startswith(beginning)]
    return found


@pytest.mark.parametrize(("page", "beginning"), RUN_HERE)
def test_a_block_does_what_it_says(page: str, beginning: str, tmp_path: Path) -> None:
    RUN_HERE[page, beginning](the_block(page, beginning), tmp_path)


def test_every_block_is_run_or_has_its_reason() -> None:
    assert len(BLOCKS) > 60
    alone = [fence.place for fence in BLOCKS if not accounted_for(fence)]
    assert alone == [], "run it: follow its page, or give it a line in RUN_HERE, RUN_BY or, with the reason, NOT_RUN"


def accounted_for(fence: Fence) -> bool:
    name = place(fence)
    if name.removeprefix("docs/") in FOLLOWED_PAGES and fence.language in ("sh", "python"):
        return True
    if any(name == page and fence.body.startswith(start) for page, start in (*RUN_HERE, *NOT_RUN)):
        return True
    if fence.language in TO_BE_READ:
        return not any(commands(Fence(fence.page, fence.line, "", "", fence.body)))
    told = list(commands(fence))
    lines = [line for line in fence.body.splitlines() if line.strip() and not line.startswith((" ", "#"))]
    return bool(told) and len(told) == len(lines) and all(run_smaller(command) for command in told)


def run_smaller(command: Command) -> bool:
    """By a test of the same subcommand, and every option somewhere in the tests of the software."""
    if command.program not in PARSERS:
        return False
    name = command.program if command.program == "sitl-mock" else f"{command.program} {command.arguments[0]}"
    if name not in RUN_BY or name.rpartition(" ")[2].replace("sitl-mock", "sitl_mock") not in text_of(RUN_BY[name]):
        return False
    options = [word.partition("=")[0] for word in command.arguments if word.startswith("--")]
    return all(f'"{option}' in words_of_the_tests() or f"{option} " in words_of_the_tests() for option in options)


def text_of(path: str) -> str:
    return (ROOT / path).read_text("utf-8")


@cache
def words_of_the_tests() -> str:
    """Tests of the software, not those of its pages."""
    files = [f for f in (ROOT / "tests").rglob("*.py") if f.parent.name != "documentation"]
    return "\n".join(file.read_text("utf-8") for file in files)


def test_the_lists_name_blocks_that_are_there() -> None:
    for page, beginning in (*RUN_HERE, *NOT_RUN):
        the_block(page, beginning)
    for reason in NOT_RUN.values():
        for file in re.findall(r"tests/[\w/]+\.py", reason):
            assert (ROOT / file).is_file()
