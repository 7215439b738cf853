"""Fenced blocks of the project's pages, and the commands in them."""

import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGES = (ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md")))
FENCE = re.compile(r"^```(?P<info>[^\n`]*)\n(?P<body>.*?)^```\s*$", re.MULTILINE | re.DOTALL)
TITLE = re.compile(r'title="([^"]*)"')
PROGRAMS = ("gcs", "policy", "sitl-mock")
OPERATORS = frozenset({"|", "||", "&&", ">", ";"})
OTHERS = ("make", "pip", "pipx", "docker", "curl", "git", "cat", "export", "source", "ls", "sudo")


@dataclass(frozen=True)
class Fence:
    """One block. ``language`` is empty where the page gives none."""

    page: Path
    line: int
    language: str
    title: str
    body: str

    @property
    def place(self) -> str:
        """For messages."""
        return f"{self.page.relative_to(ROOT)}:{self.line}"

    @property
    def keeps_running(self) -> bool:
        """A command that ends only when it is told to."""
        return self.title == "keeps running"


@dataclass(frozen=True)
class Command:
    """One line of a shell, comment left out."""

    place: str
    words: tuple[str, ...]

    @property
    def program(self) -> str:
        """``gcs``, ``policy`` and ``sitl-mock`` also where they are run as modules."""
        if self.words[0].startswith("python") and self.words[1:2] == ("-m",):
            return {"sitl_mock": "sitl-mock"}.get(self.words[2], self.words[2])
        return self.words[0]

    @property
    def arguments(self) -> tuple[str, ...]:
        """After the program."""
        return self.words[3:] if self.words[0].startswith("python") else self.words[1:]


def fences(page: Path) -> list[Fence]:
    """In the page's order."""
    text = page.read_text("utf-8")
    found = []
    for match in FENCE.finditer(text):
        info = match["info"].strip()
        title = TITLE.search(info)
        language = info.split(" ", 1)[0] if info else ""
        line = text.count("\n", 0, match.start()) + 2
        found.append(Fence(page, line, language, title[1] if title else "", match["body"]))
    return found


def commands(fence: Fence) -> Iterator[Command]:
    """The lines of a shell block, or those of a block without a language that begin with a program of ours or known."""
    if fence.language not in ("", "sh", "bash", "console"):
        return
    for offset, line in enumerate(body_lines(fence.body)):
        try:
            words = tuple(shlex.split(line.removeprefix("$ "), comments=True))
        except ValueError:
            continue  # a drawing, or several lines of a here document
        if words and (words[0] in (*PROGRAMS, *OTHERS) or words[:2] == ("python", "-m")):
            end = next((i for i, word in enumerate(words) if word in OPERATORS), len(words))
            yield Command(f"{fence.place}+{offset}", words[:end])


def body_lines(body: str) -> list[str]:
    """Here documents left out, continued lines joined."""
    body = re.sub(r"<<'(\w+)'\n.*?^\1$", "", body, flags=re.MULTILINE | re.DOTALL)
    return body.replace("\\\n", " ").splitlines()
