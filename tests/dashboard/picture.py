"""The README's picture: a real flight of the demo campaign by mock drones, as an operator sees it.

python tests/dashboard/picture.py docs/images/operator-page.png
"""

import argparse
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

from playwright.sync_api import Page, expect, sync_playwright

ROOT = Path(__file__).resolve().parents[2]
FLY = ("fly", "missions/demo.toml", "--fleet", "mock", "--speedup", "15", "--serve", "127.0.0.1:0")
FLAGS = ("--no-sandbox", "--enable-unsafe-swiftshader")
PATIENCE_MS = 300_000


def take(page: Page, path: Path) -> None:
    """In the middle of the campaign, with a drone chosen that says why."""
    expect(page.get_by_test_id("slot-clock")).to_contain_text(re.compile(r"slot 3\d of 60"), timeout=PATIENCE_MS)
    page.get_by_test_id("drone-1").get_by_role("button", name=re.compile("UAV 1")).first.click()
    expect(page.get_by_test_id("why-1")).to_be_visible(timeout=PATIENCE_MS)
    page.mouse.move(5, 500)
    page.evaluate("document.activeElement.blur()")
    page.screenshot(path=path)


def main() -> int:
    """Fly, look, end the flight."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("path", type=Path)
    parser.add_argument("--dark", action="store_true")
    args = parser.parse_args()
    program = shutil.which("chromium") or shutil.which("google-chrome")
    command = [sys.executable, "-m", "gcs", *FLY]
    with subprocess.Popen(command, cwd=ROOT, stderr=subprocess.STDOUT, stdout=subprocess.PIPE, text=True) as flight:
        assert flight.stdout is not None
        told = ""
        while (found := re.search(r"(http://\S+?/?)[\s,;].*?operator key (\S+)", told, re.DOTALL)) is None:
            line = flight.stdout.readline()
            assert line, told
            told += line + " "
        try:
            with sync_playwright() as playwright:
                browser = playwright.chromium.launch(executable_path=program, args=list(FLAGS))
                scheme = "dark" if args.dark else "light"
                context = browser.new_context(viewport={"width": 1440, "height": 900}, color_scheme=scheme)
                page = context.new_page()
                page.goto(found[1])
                page.get_by_label("Key").fill(found[2])
                page.get_by_role("button", name="Sign in").click()
                take(page, args.path)
                browser.close()
        finally:
            flight.terminate()
            time.sleep(0.1)
    return 0


if __name__ == "__main__":
    sys.exit(main())
