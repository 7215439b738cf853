"""Somebody who follows a page from top to bottom: one folder, one shell, servers that stay up until the page ends.

Ports that a page names or means are replaced by free ones, so that pages can be followed side by side. ``python`` and
the programs are those of this environment; short commands and Python run in this very process (``inside.py``). A key
that a page says to paste is read from what the server printed.
"""

import os
import re
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import IO

from fences import Fence, fences
from inside import lines_of, run_lines, run_python

from gcs.cli.mock_fleet import free_udp_ports

BLOCK_TIMEOUT_S = 400.0  # a busy machine compiles and flies slowly
READY_TIMEOUT_S = 400.0
READY = re.compile(r"the page stays up at|^gcs: open |drone 2 ready", re.MULTILINE)
KEY = re.compile(r"operator key\S* (\S+)")
PASTE = "paste-it-here"


class Reader:
    """Runs the blocks of a page. Use :func:`reading`."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.printed: list[str] = []
        self._servers: list[tuple[subprocess.Popen[str], threading.Thread]] = []
        self._heard = threading.Condition()
        self._ports: dict[str, str] = {}
        path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
        left_out = ("PYTHONPATH", "GCS_KEY")
        self._environment = {k: v for k, v in os.environ.items() if k not in left_out} | {"PATH": path}

    def follow(self, page: Path) -> int:
        """Every block of shell and Python; how many there were."""
        blocks = [fence for fence in fences(page) if fence.language in ("sh", "python")]
        for block in blocks:
            self.run(block)
        return len(blocks)

    def run(self, block: Fence) -> None:
        """One block; fails with the page's line and what the block printed."""
        body = self._with_free_ports(block.body)
        if PASTE in body:
            self._environment["GCS_KEY"] = self._key()
            return
        if block.keeps_running:
            self._start(body, block.place)
            return
        code, out, err = self._done(replace(block, body=body))
        self.printed.append(out)
        assert code == 0, f"{block.place}: exit {code}\n{body}\n{out}\n{err}"
        assert "Traceback" not in err, f"{block.place}\n{err}"

    def _done(self, block: Fence) -> tuple[int, str, str]:
        """Exit code, stdout, stderr."""
        if block.language == "python":
            return run_python(block.body, self.folder, self._environment)
        lines = lines_of(block)
        if lines is not None:
            return run_lines(lines, self.folder, self._environment)
        done = subprocess.run(
            ["bash", "-euo", "pipefail"],
            input=self._one_shell(block.body),
            cwd=self.folder,
            env=self._environment,
            capture_output=True,
            text=True,
            timeout=BLOCK_TIMEOUT_S,
            check=False,
        )
        return done.returncode, done.stdout, done.stderr

    def _one_shell(self, body: str) -> str:
        """What one block sets, the next one knows."""
        memory = self.folder.with_name(f"{self.folder.name}.variables")
        known = f"source '{memory}'\n" if memory.exists() else ""
        return f"{known}set -a\n{body}\nset +a\ndeclare -px | grep -v ' -[a-z]*r' > '{memory}'\n"

    def close(self) -> None:
        """Ctrl-C for every server, as a person would."""
        for process, thread in self._servers:
            process.send_signal(signal.SIGINT)
            try:
                process.wait(30.0)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
            thread.join(10.0)
            assert process.stdout is not None
            process.stdout.close()

    def _start(self, body: str, place: str) -> None:
        words = body.split()
        process = subprocess.Popen(
            words, cwd=self.folder, env=self._environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        assert process.stdout is not None
        said: list[str] = []
        thread = threading.Thread(target=self._listen, args=(process.stdout, said), daemon=True)
        thread.start()
        self._servers.append((process, thread))
        with self._heard:
            ready = self._heard.wait_for(
                lambda: READY.search("".join(said)) is not None or process.poll() is not None, READY_TIMEOUT_S
            )
        assert ready, f"{place}: not ready after {READY_TIMEOUT_S} s\n{''.join(said)}"
        assert process.poll() is None, f"{place}: ended with {process.returncode}\n{''.join(said)}"

    def _listen(self, stream: IO[str], said: list[str]) -> None:
        for line in stream:
            with self._heard:
                said.append(line)
                self.printed.append(line)
                self._heard.notify_all()
        with self._heard:
            self._heard.notify_all()

    def _key(self) -> str:
        found = KEY.search("".join(self.printed))
        assert found is not None, self.printed
        return found[1]

    def _with_free_ports(self, body: str) -> str:
        for port in ("8080", "8081", "8900"):
            if re.search(rf"\b{port}\b", body):
                self._ports.setdefault(port, str(_free_tcp_port()))
        if "14550" in body and "14550" not in self._ports:
            first = free_udp_ports(2)
            self._ports |= {"14550": str(first), "14551": str(first + 1)}
        if "gcs doctor" in body:  # it looks at the server's usual port
            body = body.replace("gcs doctor", f"gcs doctor --port {_free_tcp_port()}")
        for theirs, ours in self._ports.items():
            body = re.sub(rf"\b{theirs}\b", ours, body)
        return body


@contextmanager
def reading(folder: Path) -> Iterator[Reader]:
    """A reader whose servers end with the block."""
    reader = Reader(folder)
    try:
        yield reader
    finally:
        reader.close()


def _free_tcp_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as probe:
        return int(probe.getsockname()[1])
