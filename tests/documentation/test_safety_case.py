"""The safety case's evidence is there."""

import re

from fences import ROOT

TEXT = (ROOT / "docs" / "safety-case.md").read_text("utf-8")
ROWS = re.findall(r"^\| (H\d+) \|(.*)\|$", TEXT, re.MULTILINE)


def test_every_hazard_has_evidence_that_exists() -> None:
    assert [name for name, _ in ROWS] == [f"H{number}" for number in range(1, len(ROWS) + 1)]
    assert len(ROWS) >= 14
    for name, row in ROWS:
        files = re.findall(r"`(tests/[\w/]+\.py)`", row)
        assert files, name
        for file in files:
            text = (ROOT / file).read_text("utf-8")
            assert "def test_" in text, f"{name}: {file} tests nothing"
