"""Writes ``sync.py`` from ``aio.py``, so that the two clients cannot differ: ``python gcs/client/unasync.py``."""

import re
from pathlib import Path

HERE = Path(__file__).parent
HEAD = '"""The client that waits. Written from ``aio.py`` by ``gcs/client/unasync.py``; change those."""'
CHANGES = (
    (r"\A\"\"\".*?\"\"\"", HEAD),
    (r"  # noqa: ASYNC.*$", ""),
    (r"\basync (def|with|for)\b", r"\1"),
    (r"\bawait ", ""),
    (r"\b__a(enter|exit)__\b", r"__\1__"),
    (r"\baclosing\b", "closing"),
    (r"\baclose\b", "close"),
    (r"an ``with``", "a ``with``"),
    (r"\bAsync(BaseTransport|Client|Generator)\b", r"\1"),
    (r"\basyncio\.sleep\b", "time.sleep"),
    (r"^import asyncio$", "import time"),
    (r"\bwebsockets\.asyncio\.client\b", "websockets.sync.client"),
)


def synchronous(source: str) -> str:
    """``aio.py``'s text as that of ``sync.py``, before ruff puts it in order."""
    for pattern, replacement in CHANGES:
        source = re.sub(pattern, replacement, source, flags=re.MULTILINE)
    return source.replace("an ``async with``", "a ``with``")


if __name__ == "__main__":
    (HERE / "sync.py").write_text(synchronous((HERE / "aio.py").read_text("utf-8")), encoding="utf-8")
