"""Pages followed from top to bottom, as their readers do."""

from pathlib import Path

import pytest
from fences import PAGES, ROOT, fences
from reader import reading

DOCS = ROOT / "docs"
FOLLOWED = {
    "install.md": "fit to fly from",
    "tutorials/operator.md": "tracks.kml",
    "tutorials/researcher.md": "Metrics(",
    "faq.md": "nothing heard",
    "flying-px4-and-ardupilot.md": "drone 2 ",
    "mock.md": "gps_glitch",
}
"""Page -> something that its reader must have seen."""
WITH_THE_SAME_SERVER = ("tutorials/api-client.md", "client.md")


@pytest.mark.flight
@pytest.mark.timeout(1200)
@pytest.mark.parametrize("name", FOLLOWED)
def test_a_page_does_what_it_says(name: str, tmp_path: Path) -> None:
    with reading(tmp_path) as reader:
        assert reader.follow(DOCS / name) > 0
        assert FOLLOWED[name] in "".join(reader.printed)


@pytest.mark.flight
@pytest.mark.timeout(1200)
def test_programs_fly_campaigns_and_watch(tmp_path: Path) -> None:
    with reading(tmp_path) as reader:
        for name in WITH_THE_SAME_SERVER:
            assert reader.follow(DOCS / name) > 0
        printed = "".join(reader.printed)
    assert "done episodic_aoi=" in printed, "flown by the Python client"
    assert "409 " in printed, "and refused a second time"
    assert '"status": 409' in printed, "curl was refused too"
    assert (tmp_path / "report.html").read_text().startswith("<!doctype html>")
    assert "gx:Track" in (tmp_path / "tracks.kml").read_text()


def test_every_page_with_shell_blocks_is_followed() -> None:
    with_shell = {
        str(page.relative_to(DOCS))
        for page in PAGES
        if page.is_relative_to(DOCS) and any(fence.language == "sh" for fence in fences(page))
    }
    assert with_shell == {*FOLLOWED, "tutorials/api-client.md"}
