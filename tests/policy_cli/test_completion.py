"""The completion scripts in a real bash: what Tab would offer."""

import shutil
import subprocess
from collections.abc import Callable

import pytest

from gcs.__main__ import main as gcs
from policy.__main__ import main as policy
from sitl_mock.__main__ import main as sitl_mock

Main = Callable[[list[str]], int]
PROGRAMS: dict[str, Main] = {"gcs": gcs, "policy": policy, "sitl-mock": sitl_mock}


def script(name: str, shell: str, capsys: pytest.CaptureFixture[str]) -> str:
    with pytest.raises(SystemExit) as ended:
        PROGRAMS[name](["--print-completion", shell])
    assert ended.value.code == 0
    return capsys.readouterr().out


@pytest.mark.parametrize(
    ("typed", "offered"),
    [
        ("gcs fl", {"fly"}),
        ("gcs fly --fl", {"--fleet", "--flavour"}),
        ("gcs fly --flavour a", {"ardupilot"}),
        ("gcs keys ", {"add", "list", "revoke"}),
        ("gcs doctor --js", {"--json"}),
        ("policy ev", {"evaluate"}),
        ("policy evaluate --tra", {"--trajectory"}),
        ("sitl-mock --flavour p", {"px4"}),
    ],
)
def test_bash_offers(typed: str, offered: set[str], capsys: pytest.CaptureFixture[str]) -> None:
    *words, last = typed.split(" ")
    text = script(words[0], "bash", capsys)
    quoted = " ".join(f"'{word}'" for word in (*words, last))
    ask = f"""
COMP_WORDS=({quoted}); COMP_CWORD={len(words)}
function=$(complete -p {words[0]} | sed 's/.*-F \\([^ ]*\\).*/\\1/')
$function {words[0]} '{last}' '{words[-1]}'
printf '%s\\n' "${{COMPREPLY[@]}}"
"""
    bash = shutil.which("bash")
    assert bash is not None
    done = subprocess.run([bash, "--norc"], input=text + ask, capture_output=True, text=True, check=False, timeout=60)
    assert offered <= set(done.stdout.split()), done


@pytest.mark.parametrize("name", PROGRAMS)
@pytest.mark.parametrize("shell", ["zsh", "tcsh"])
def test_other_shells_have_scripts_too(name: str, shell: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert name in script(name, shell, capsys)
