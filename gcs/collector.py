"""Python's garbage collector beside a flight: a full collection stops every thread, and with all that a server has
loaded (200,000 objects) it takes 0.1 to 0.2 s, which is more than a setpoint period.
"""

import gc
from typing import Final

THRESHOLDS: Final = (10_000, 20, 20)
"""A tick of a hundred vehicles makes thousands of short-lived objects; Python's own 700 would look at all of them."""


def leave_what_is_loaded() -> None:
    """Look no more at what exists now: modules, compiled rules, tables, routes. To be called when they are loaded.

    They are never freed while the server runs. Cycles made from now on are collected as ever, in a small heap.
    """
    gc.freeze()
    gc.set_threshold(*THRESHOLDS)
