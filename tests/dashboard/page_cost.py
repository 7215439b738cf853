"""What the page costs the processor, thread by thread: CPU seconds, which other programs beside it do not inflate."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import psutil
from playwright.sync_api import Browser, Page


@dataclass
class Cost:
    """CPU seconds over the watched time; pictures of the moving fleet that the page drew meanwhile."""

    main_s: float = 0.0  # the page's own thread: script, styles, layout, recording of what is to be painted
    browser_s: float = 0.0  # everything that Chromium did, drawing by SwiftShader included
    pictures: int = 0

    @property
    def main_ms_a_picture(self) -> float:
        return 1000.0 * self.main_s / max(1, self.pictures)

    @property
    def browser_ms_a_picture(self) -> float:
        return 1000.0 * self.browser_s / max(1, self.pictures)


@contextmanager
def watching(browser: Browser, page: Page) -> Iterator[Cost]:
    """Filled in at the end."""
    cost = Cost()
    processes = _processes(browser)
    before = {process.pid: _cpu_s(process) for process in processes}
    drawn = pictures(page)
    yield cost
    cost.pictures = pictures(page) - drawn
    spent = {pid: tuple(b - a for a, b in zip(before[pid], _cpu_s(psutil.Process(pid)), strict=True)) for pid in before}
    cost.browser_s = sum(whole for whole, _ in spent.values())
    cost.main_s = max(main for process, (_, main) in zip(processes, spent.values(), strict=True) if _is_page(process))


def pictures(page: Page) -> int:
    """How often the page has drawn the moving fleet so far, by its own count."""
    return int(page.locator(".overlay.drones").get_attribute("data-drawn") or 0)


def _processes(browser: Browser) -> list[psutil.Process]:
    session = browser.new_browser_cdp_session()
    told = session.send("SystemInfo.getProcessInfo")["processInfo"]
    session.detach()
    return [psutil.Process(one["id"]) for one in told]


def _is_page(process: psutil.Process) -> bool:
    return "--type=renderer" in process.cmdline()


def _cpu_s(process: psutil.Process) -> tuple[float, float]:
    """All of the process, and its main thread (whose id is the process's)."""
    times = process.cpu_times()
    main = next((thread for thread in process.threads() if thread.id == process.pid), None)
    return times.user + times.system, 0.0 if main is None else main.user_time + main.system_time
