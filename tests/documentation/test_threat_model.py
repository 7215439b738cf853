"""Each defence of the threat model names tests, and they exist."""

import re

import pytest
from fences import ROOT

TEXT = (ROOT / "docs" / "threat-model.md").read_text("utf-8")
DEFINED = {
    name
    for path in (ROOT / "tests").rglob("test_*.py")
    for name in re.findall(r"^def (test_\w+)\(", path.read_text("utf-8"), re.MULTILINE)
}


def rows(title: str) -> list[list[str]]:
    """The cells of each row of the table under a heading."""
    section = TEXT.partition(f"## {title}\n")[2].partition("\n## ")[0]
    lines = [line for line in section.splitlines() if line.startswith("|")][2:]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]


@pytest.mark.parametrize(("title", "at_least"), [("From whom", 11), ("What a request may cost", 10)])
def test_every_defence_names_tests_that_exist(title: str, at_least: int) -> None:
    table = rows(title)
    assert len(table) >= at_least
    for row in table:
        named = re.findall(r"`(test_\w+)`", row[-1])
        assert named, f"{row[0]}: no test is named"
        assert set(named) <= DEFINED, f"{row[0]}: {set(named) - DEFINED} do not exist"


def test_every_test_and_file_named_anywhere_on_the_page_exists() -> None:
    for name in re.findall(r"`(test_\w+)`", TEXT):
        assert name in DEFINED, name
    files = re.findall(r"`(tests/[\w/]+\.py)`", TEXT)
    assert files
    for file in files:
        assert (ROOT / file).is_file(), file
