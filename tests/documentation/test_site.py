"""The documentation site: built strictly and offline, and whole."""

import os
import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path

import pytest
import yaml
from fences import ROOT

FETCHED = {"script": "src", "img": "src", "link": "href", "iframe": "src", "source": "src"}


class Fetched(HTMLParser):
    """What a browser asks for by itself when it shows a page."""

    def __init__(self) -> None:
        super().__init__()
        self.addresses: list[str] = []

    def handle_starttag(self, tag, attrs):
        wanted = FETCHED.get(tag)
        facts = dict(attrs)
        if wanted and facts.get(wanted) and facts.get("rel") not in ("canonical", "prev", "next"):
            self.addresses.append(str(facts[wanted]))


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Built as ``make site`` does; a cell of the notebook that fails, or any warning, fails the build."""
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(folder)]
    environment = os.environ | {"NO_MKDOCS_2_WARNING": "1", "http_proxy": "http://127.0.0.1:1"}
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False, timeout=170)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    assert list(ROOT.glob("kernel-ipc*")) == [], "the notebook's kernel left sockets"
    return folder


@pytest.mark.timeout(240)
def test_pages_fetch_nothing_from_elsewhere(site: Path) -> None:
    pages = list(site.rglob("*.html"))
    assert len(pages) > 25
    for page in pages:
        reader = Fetched()
        reader.feed(page.read_text("utf-8"))
        assert [a for a in reader.addresses if re.match(r"https?:|//", a)] == [], page
        for address in reader.addresses:
            if not address.startswith("data:"):
                path = address.partition("?")[0].partition("#")[0]
                base = site if path.startswith("/") else page.parent  # 404.html is shown at any depth
                assert (base / path.lstrip("/")).resolve().exists(), (page, address)


def test_every_user_has_a_way_in(site: Path) -> None:
    start = (site / "index.html").read_text("utf-8")
    for page in ("tutorials/operator.html", "tutorials/api-client.html", "tutorials/researcher.html"):
        assert f'href="{page}"' in start
        assert (site / page).is_file()


def test_made_pages_say_what_the_software_says(site: Path) -> None:
    calls = (site / "reference" / "rest.html").read_text("utf-8")
    assert "POST /api/v1/campaigns/{campaign_id}/start" in calls
    assert 'href="#campaignfull"' in calls
    assert 'id="campaignfull"' in calls
    assert "--speedup" in (site / "reference" / "commands.html").read_text("utf-8")
    notebook = (site / "notebooks" / "results.html").read_text("utf-8")
    assert "GCRL" not in notebook or "episodic_aoi" in notebook
    assert len(re.findall(r"purdue", notebook)) >= 2, "the notebook was run"


def test_every_page_is_in_the_navigation() -> None:
    text = (ROOT / "mkdocs.yml").read_text("utf-8")
    pages = {str(page.relative_to(ROOT / "docs")) for page in (ROOT / "docs").rglob("*.md")}
    named = set(re.findall(r": ([\w/-]+\.md)$", yaml.dump(yaml.safe_load(text)["nav"]), re.MULTILINE))
    assert pages - named == set()
