"""An hour of the stream, as quickly as the page takes it: does its memory stay flat? Also a program of its own.

PYTHONPATH=tests/api python tests/dashboard/hour.py --messages 18000 --vehicles 100 --users 2000
"""

import argparse
import json
import shutil
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import Future
from dataclasses import asdict, dataclass

from fleet_at_work import RATE_HZ, fleet_snapshot
from operator_desk import Desk
from playwright.sync_api import Page, sync_playwright

from gcs.api.auth import Actor
from gcs.api.catalog import Catalog
from gcs.api.schemas import Subscribe
from gcs.api.stream_session import StreamSession
from gcs.api.stream_source import SnapshotSource
from gcs.ports import Event, FlightSnapshot, OperatorRequest, RequestOutcome, Severity
from gcs.store.event_tail import EventTail
from gcs.store.keys import Role
from gcs.store.store import Store, open_store
from policy.mission_file import load_mission

CHUNK = 100
AN_EVENT_EVERY = 10  # messages: far more than a flight has
HAND_FED = """
window.WebSocket = class {
    constructor() { window.handFed = this; setTimeout(() => this.onopen()); }
    send() {}
    close() {}
};
"""
FEED = """async texts => {
    for (const data of texts) {
        window.handFed.onmessage({ data });
        await new Promise(done => setTimeout(done, 0));
    }
    await new Promise(done => requestAnimationFrame(() => setTimeout(done, 0)));
}"""
"""Message by message, each with time for the page to show it."""
FLAGS = ("--no-sandbox", "--enable-unsafe-swiftshader")


@dataclass(frozen=True)
class Used:
    """After a collection of garbage: the page's heap, and what hangs in its document."""

    messages: int
    heap_mb: float
    nodes: int
    listeners: int


class Ticking:
    """ports.FlightControl that is where it is told to be."""

    def __init__(self, campaign_id: str, vehicles: int, users: int) -> None:
        self._campaign_id, self._vehicles, self._users = campaign_id, vehicles, users
        self.made = self._at(1)

    def _at(self, tick: int) -> FlightSnapshot:
        return fleet_snapshot(tick, vehicles=self._vehicles, users=self._users, campaign_id=self._campaign_id)

    def advance(self) -> None:
        self.made = self._at(self.made.tick + 1)

    def healthy(self) -> bool:
        return True

    def snapshot(self) -> FlightSnapshot:
        return self.made

    def submit(self, request: OperatorRequest) -> Future[RequestOutcome]:
        raise AssertionError(f"nobody asks for anything here: {request}")


def watch(page: Page, store: Store, *, messages: int, vehicles: int, users: int, looks: int) -> Iterator[Used]:
    """The page gets ``messages`` of a stream made by the server's own session; ``looks`` times its memory is taken."""
    record = store.campaigns.create(load_mission("demo"), "ann")
    control, tail = Ticking(record.id, vehicles, users), EventTail()
    desk = Desk(store, control)
    page.add_init_script(HAND_FED)
    desk.start()
    try:
        page.goto(desk.url)
        page.wait_for_function("() => window.handFed !== undefined && document.querySelector('.overlay') !== null")
        statics = Catalog(store.campaigns)
        wish = Subscribe(type="subscribe", deltas=True)
        source = SnapshotSource(control, tail, statics)
        session = StreamSession(Actor("ann", Role.OPERATOR), "1", source, tail, statics, wish)
        page.evaluate(FEED, [session.hello()])
        told = 0
        for look in range(looks):
            while told < messages * (look + 1) // looks:
                told += _tell(page, session, control, tail, told)
            yield _used(page, told)
    finally:
        page.goto("about:blank")
        desk.stop()


def _tell(page: Page, session: StreamSession, control: Ticking, tail: EventTail, told: int) -> int:
    texts: list[str] = []
    for k in range(CHUNK):
        control.advance()
        if (told + k) % AN_EVENT_EVERY == 0:
            tail.append(Event(control.made.time_s, "test.line", f"something {told + k}", Severity.INFO))
        texts += session.step()
    page.evaluate(FEED, texts)
    return CHUNK


def _used(page: Page, told: int) -> Used:
    cdp = page.context.new_cdp_session(page)
    cdp.send("HeapProfiler.enable")
    for _ in range(2):
        cdp.send("HeapProfiler.collectGarbage")
    heap = cdp.send("Runtime.getHeapUsage")["usedSize"]
    counters = cdp.send("Memory.getDOMCounters")
    cdp.detach()
    return Used(told, round(heap / 1e6, 1), counters["nodes"], counters["jsEventListeners"])


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--messages", type=int, default=int(3600 * RATE_HZ))
    parser.add_argument("--vehicles", type=int, default=100)
    parser.add_argument("--users", type=int, default=2000)
    parser.add_argument("--looks", type=int, default=6)
    args = parser.parse_args()
    program = shutil.which("chromium") or shutil.which("google-chrome")
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=list(FLAGS))
        store = open_store(f"sqlite:///{folder}/hour.sqlite3")
        for used in watch(browser.new_page(), store, **vars(args)):
            print(json.dumps(asdict(used)), flush=True)
        store.close()
        browser.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
