"""The page's memory stays flat: minutes of the stream here, an hour by ``hour.py`` (docs/operator-page.md)."""

from pathlib import Path

import pytest
from hour import watch
from playwright.sync_api import BrowserContext

from gcs.store.store import using_store

pytestmark = pytest.mark.browser
MESSAGES = 1200  # four minutes; trails are full after a quarter of them
GROWTH_MB = 2.0  # a list that keeps every message of 10 drones would grow by 6


def test_the_heap_and_the_document_do_not_grow(built_page: Path, context: BrowserContext, tmp_path: Path):
    page = context.new_page()
    with using_store(f"sqlite:///{tmp_path / 'memory.sqlite3'}") as store:
        used = list(watch(page, store, messages=MESSAGES, vehicles=10, users=100, looks=3))
    _, middle, last = used
    assert last.heap_mb - middle.heap_mb < GROWTH_MB, used
    assert last.listeners == middle.listeners, used
    assert last.nodes < middle.nodes + 400, used  # 40 more lines in the log
