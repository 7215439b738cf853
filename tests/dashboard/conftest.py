"""A real server with the built page and a small real flight, and a real browser that looks at it."""

import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from operator_desk import PAGE, Desk
from playwright.sync_api import Browser, BrowserContext, Page, expect, sync_playwright

from gcs.store.store import open_store

ROOT = Path(__file__).resolve().parents[2]
sys.path.append(str(ROOT / "tests" / "api"))  # the large fleet is theirs
sys.path.append(str(ROOT / "tests" / "flight"))  # the small vehicles in one object
SHOTS = ROOT / "artifacts"
FLAGS = (
    "--no-sandbox",
    "--enable-unsafe-swiftshader",  # WebGL without a graphics card
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)


@pytest.fixture(scope="session")
def built_page() -> Path:
    """Built now when a source is newer; a page that cannot be built is a failure, not a reason to look away."""
    done = subprocess.run([sys.executable, str(PAGE / "build.py")], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return PAGE / "dist"


@pytest.fixture(scope="module")  # while it runs, so does an event loop in this thread, which other tests cannot bear
def browser() -> Iterator[Browser]:
    program = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if program is None:
        pytest.fail(
            "the browser tests need Chromium on PATH: install the package 'chromium' (apt-get install chromium)"
        )
    expect.set_options(timeout=20_000)  # a loaded machine draws few pictures a second without a graphics card
    with sync_playwright() as playwright:
        opened = playwright.chromium.launch(executable_path=program, args=list(FLAGS))
        yield opened
        opened.close()


@pytest.fixture
def desk(built_page: Path, tmp_path: Path) -> Iterator[Desk]:
    store = open_store(f"sqlite:///{tmp_path / 'page.sqlite3'}")
    running = Desk(store)
    running.start()
    yield running
    running.stop()
    store.close()


@pytest.fixture
def context(browser: Browser) -> Iterator[BrowserContext]:
    opened = browser.new_context(viewport={"width": 1280, "height": 800}, reduced_motion="reduce")
    opened.set_default_timeout(20_000)
    yield opened
    opened.close()


@pytest.fixture
def page(desk: Desk, context: BrowserContext) -> Iterator[Page]:
    """The page, opened; in the end it must not have met a defect of its own, nor asked anybody but our server."""
    opened = context.new_page()
    defects: list[str] = []
    strangers: list[str] = []
    opened.on("pageerror", lambda error: defects.append(str(error)))
    opened.on("request", lambda request: strangers.append(request.url) if is_strange(request.url, desk.url) else None)
    opened.goto(desk.url)
    yield opened
    assert defects == []
    assert strangers == []


def is_strange(url: str, own: str) -> bool:
    return not url.startswith((own, own.replace("http", "ws"), "data:", "blob:"))


@pytest.fixture(scope="session")
def shot() -> Callable[[Page, str], None]:
    """Keeps a picture for people to look at."""
    SHOTS.mkdir(exist_ok=True)

    def take(page: Page, name: str) -> None:
        page.screenshot(path=SHOTS / f"{name}.png")

    return take
