"""Dockerfile and compose files, as far as they can be held to something without a container engine.

``compose_spec.json`` is the Compose Specification's schema (Apache-2.0), as Docker Compose 1.29 ships it.
"""

import json
import re
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

import jsonschema
import pytest
import yaml

import gcs.__main__
import policy.__main__
import sitl_mock.__main__

sys.path.append(str(Path(__file__).parents[1] / "api"))
from api_server import serving

from gcs.api.settings import ApiSettings
from gcs.cli.openapi import openapi_document
from gcs.store.store import using_store
from policy.service.app import create_app as create_policy_app
from sitl_mock.control import answer
from sitl_mock.simulation import Setup, Simulation

ROOT = Path(__file__).resolve().parents[2]
SCHEMA = json.loads((Path(__file__).parent / "compose_spec.json").read_text())
FILES = sorted(ROOT.glob("compose.*.yaml"))
DOCKERFILE = (ROOT / "Dockerfile").read_text()
PARSERS = {"gcs": gcs.__main__.parser, "policy": policy.__main__.parser, "sitl-mock": sitl_mock.__main__.parser}
ENVIRONMENT = {"POSTGRES_PASSWORD": "abc123"}  # pragma: allowlist secret


def interpolated(text: str) -> str:
    """``${NAME:-default}``, ``${NAME:?words}``, ``${NAME}`` and ``$$`` as compose reads them."""

    def value(match: re.Match[str]) -> str:
        if match[0] == "$$":
            return "$"
        return ENVIRONMENT.get(match["name"], match["default"] or "")

    return re.sub(r"\$\$|\$\{(?P<name>\w+)(?::-(?P<default>[^}]*)|:\?[^}]*)?\}", value, text)


def load(file: Path) -> dict[str, Any]:
    document: dict[str, Any] = yaml.safe_load(interpolated(file.read_text()))
    return document


def stages() -> dict[str, list[str]]:
    """Stage -> its instructions, continued lines joined."""
    found: dict[str, list[str]] = {}
    for line in re.sub(r"\\\n\s*", " ", DOCKERFILE).splitlines():
        if match := re.match(r"FROM \S+ AS (\S+)", line):
            found[match[1]] = [line]
        elif line and not line.startswith("#"):
            found[list(found)[-1]].append(line)
    return found


def our_commands(service: dict[str, Any]) -> list[list[str]]:
    """The words with which a service starts one of our programs."""
    entry = service.get("entrypoint", ["gcs"])
    if entry[:2] != ["sh", "-c"]:
        return [[*entry, *service.get("command", [])]] if entry[0] in PARSERS else []
    lines = re.sub(r"\\\n\s*", " ", service["command"][0]).splitlines()
    parts = [part for line in lines for part in re.split(r"\|\|?", line)]
    words = [shlex.split(part.strip().removeprefix("exec ")) for part in parts]
    return [one for one in words if one and one[0] in PARSERS]


def test_there_is_a_file_for_each_purpose() -> None:
    assert [file.name.split(".")[1] for file in FILES] == ["demo", "drones", "policy", "postgres"]


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.name)
def test_a_compose_file_is_what_the_specification_says(file: Path) -> None:
    jsonschema.Draft201909Validator(SCHEMA).validate(load(file))


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.name)
def test_every_command_in_it_is_understood(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    services = {n: s for n, s in load(file)["services"].items() if s["image"] == "uav-crowdsensing"}
    count = 0
    for service in services.values():
        for program, *words in our_commands(service):
            code: object = 0
            try:
                PARSERS[program]().parse_args(words)
            except SystemExit as ended:
                code = ended.code
            assert code == 0, capsys.readouterr().err
            count += 1
    assert count >= len(services)


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.name)
def test_ours_have_no_rights_and_dependencies_are_there(file: Path) -> None:
    services = load(file)["services"]
    for name, service in services.items():
        if service["image"] != "uav-crowdsensing":
            continue
        for other, condition in service.get("depends_on", {}).items():
            assert condition == {"condition": "service_healthy"}
            assert "healthcheck" in services[other]
        if name != "key":
            assert (service["read_only"], service["cap_drop"]) == (True, ["ALL"])
    volumes = load(file).get("volumes", {})
    used = {v.split(":")[0] for s in services.values() for v in s.get("volumes", [])}
    assert used == set(volumes)


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.name)
def test_health_checks_ask_what_their_service_answers(file: Path) -> None:
    """On a port that the service's own command opens, at a path that its program has."""
    for service in load(file)["services"].values():
        check = service.get("healthcheck", {"test": ["CMD-SHELL"]})["test"]
        if check[0] == "CMD-SHELL":  # PostgreSQL's own
            continue
        assert check[1:3] == ["python", "-c"]
        compile(check[3], "healthcheck", "exec")
        address = re.search(r"http://127\.0\.0\.1:(?P<port>\d+)(?P<path>/\w+)", check[3])
        assert address is not None
        (words,) = our_commands(service)
        options = PARSERS[words[0]]().parse_args(words[1:])
        opened = {"sitl-mock": "control", "policy": "port", "gcs": "port"}[words[0]]
        assert getattr(options, opened) == int(address["port"])
        assert answers(words[0], address["path"])


def answers(program: str, path: str) -> bool:
    """Whether the program has ``GET path`` without a key."""
    if program == "sitl-mock":
        return answer(Simulation(Setup(count=1)), "GET", path, b"").status == 200
    document = create_policy_app().openapi() if program == "policy" else openapi_document()
    return "get" in document["paths"][path]


def test_scripts_in_compose_files_are_shell() -> None:
    scripts = [
        service["command"][0]
        for file in FILES
        for service in load(file)["services"].values()
        if service.get("entrypoint", [])[:2] == ["sh", "-c"]
    ]
    assert len(scripts) == 2
    for script in scripts:
        done = subprocess.run(["sh", "-n"], input=script, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr


def test_what_listens_to_others_has_published_ports_that_it_listens_on() -> None:
    for file in FILES:
        ports = load(file)["services"]["gcs"]["ports"]
        assert any(port.split(":")[-1] == "8080" for port in ports)
        text = json.dumps(load(file)["services"]["gcs"]["command"])
        for udp in re.findall(r"udpin:0\.0\.0\.0:(\d+)", text):
            assert f"{udp}:{udp}/udp" in ports


def test_the_small_stage_carries_no_tools_and_runs_without_rights() -> None:
    serve = stages()["serve"]
    assert not [line for line in serve if line.startswith("RUN") and ("pip" in line or "npm" in line or "apt" in line)]
    assert [line for line in serve if line.startswith("COPY")] == ["COPY --from=install /opt/ucs /opt/ucs"]
    (user,) = [line for line in serve if line.startswith("USER")]
    assert user == "USER 10001"
    entry = next(line for line in serve if line.startswith("ENTRYPOINT"))
    command = next(line for line in serve if line.startswith("CMD"))
    words = json.loads(entry.partition(" ")[2]) + json.loads(command.partition(" ")[2])
    PARSERS[words[0]]().parse_args(words[1:])
    assert stages()["train"][-2:] == ['ENTRYPOINT ["policy"]', 'CMD ["--help"]']


def test_everything_that_is_copied_is_there_and_not_left_out() -> None:
    ignored = [line for line in (ROOT / ".dockerignore").read_text().splitlines() if line]
    for lines in stages().values():
        for line in (line for line in lines if line.startswith("COPY") and "--from" not in line):
            for source in shlex.split(line)[1:-1]:
                assert (ROOT / source).exists(), line
                assert source.rstrip("/") not in ignored
        for line in (line for line in lines if "--from=" in line):
            stage = re.search(r"--from=(\S+)", line)
            assert stage is not None
            assert stage[1] in stages()


def test_what_the_wheel_is_built_from_is_copied() -> None:
    copied = {word for line in stages()["wheel"] if line.startswith("COPY") for word in shlex.split(line)}
    assert {"pyproject.toml", "README.md", "LICENSE", "gcs", "policy", "sitl_mock", "missions"} <= copied


def test_the_health_check_tells_a_server_that_answers_from_none(tmp_path: Path) -> None:
    check = next(line for line in stages()["serve"] if line.startswith("HEALTHCHECK"))
    words = json.loads(check.partition("CMD ")[2])
    assert words[0] == "python"

    def ask(port: int) -> int:
        script = words[2].replace("8080", str(port)).replace("timeout=2", "timeout=60")  # the machine may be busy
        return subprocess.run([sys.executable, "-c", script], capture_output=True, check=False, timeout=60).returncode

    settings = ApiSettings(host="0.0.0.0", dashboard=tmp_path)
    with using_store(f"sqlite:///{tmp_path / 'x.db'}") as store, serving(store, settings) as server:
        assert ask(int(server.url.rpartition(":")[2])) == 0
    assert ask(1) != 0
