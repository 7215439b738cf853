"""The machine: disk, store, ports, receive buffer, clock, load."""

import ctypes
import errno
import shutil
import socket
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path

from sqlalchemy.engine import make_url
from sqlalchemy.exc import SQLAlchemyError

from gcs.config import ServerConfig
from gcs.doctor.finding import Finding, caution, ok, red
from gcs.links.transport import RECEIVE_BUFFER_BYTES
from gcs.store.engine import StoreError, open_engine

RED_FREE_BYTES, CAUTION_FREE_BYTES = 200 * 2**20, 2 * 2**30
TICK_S = 0.01
LATE_S = 0.05  # half of a setpoint period
SOFTWARE_IS_YOUNGER_THAN = datetime(2026, 1, 1, tzinfo=UTC)
STA_UNSYNC, TIMEX_BYTES, STATUS_OFFSET = 0x0040, 512, 40  # struct timex of adjtimex(2) on 64-bit Linux


def check_disk(folder: Path) -> Finding:
    """Room for records where the store lies."""
    free = shutil.disk_usage(_existing(folder)).free
    found = f"{free / 2**30:.1f} GiB free for {folder}"
    if free < RED_FREE_BYTES:
        return red("disk", found, "make room: a full disk loses records, and the flight goes on without them")
    if free < CAUTION_FREE_BYTES:
        return caution("disk", found, "make room, or put the store elsewhere with [store] url")
    return ok("disk", found)


def check_store(url: str) -> Finding:
    """It opens; a SQLite file that is not there yet is not made."""
    try:
        parsed = make_url(url)
        if parsed.get_backend_name() == "sqlite" and parsed.database and not Path(parsed.database).exists():
            return _future_file(Path(parsed.database))
        engine = open_engine(url)
    except (SQLAlchemyError, StoreError) as error:
        return red("store", " ".join(str(error).split()), "mend [store] url, or --store")
    shown = parsed.render_as_string(hide_password=True)
    try:
        with engine.connect() as connection:
            connection.exec_driver_sql("SELECT 1")
    except SQLAlchemyError as error:
        words = str(error.__cause__ or error).strip().splitlines()[0]
        return red("store", f"{shown}: {words}", "start the database, check user, password and file permissions")
    finally:
        engine.dispose()
    return ok("store", shown)


def check_port(host: str, port: int) -> Finding:
    """The server's own port can be taken."""
    try:
        socket.create_server((host, port), family=socket.AF_INET6 if ":" in host else socket.AF_INET).close()
    except (OSError, OverflowError) as error:
        code = getattr(error, "errno", None)
        words = getattr(error, "strerror", None) or str(error)
        remedies = {
            errno.EADDRINUSE: "a server runs there already, or another program: end it, or choose another with --port",
            errno.EACCES: "ports below 1024 need rights: choose one above, and let a proxy listen below",
        }
        remedy = remedies.get(code or 0, "choose an address of this machine with --host")
        return red("port", f"{host}:{port}: {words}", remedy)
    return ok("port", f"{host}:{port} is free")


def check_receive_buffer(most: int | None) -> Finding:
    """``most`` as in net.core.rmem_max; None where the system does not say."""
    if most is None or most >= RECEIVE_BUFFER_BYTES:
        return ok("receive buffer", "as large as wanted" if most else "this system does not say")
    remedy = f"sudo sysctl -w net.core.rmem_max={RECEIVE_BUFFER_BYTES} (with tens of drones; a few need no more)"
    return caution("receive buffer", f"{most // 1024} KiB at most: bursts of many drones overrun it", remedy)


def check_calendar(now: datetime) -> Finding:
    """Records and live users' fixes carry the wall clock."""
    if now < SOFTWARE_IS_YOUNGER_THAN:
        return red("date", f"{now:%Y-%m-%d}", "set the clock: timedatectl set-ntp true, or date --set")
    return ok("date", f"{now:%Y-%m-%d %H:%M} UTC")


def check_synchronised(unsynchronised: bool | None) -> Finding:
    """Fixes more than 60 s ahead of this clock are not taken."""
    if unsynchronised is None:
        return ok("clock", "this system does not say whether it is synchronised")
    if unsynchronised:
        remedy = "timedatectl set-ntp true, or run chrony; flights themselves use the monotonic clock"
        return caution("clock", "not synchronised: live users' fixes may count as early or stale", remedy)
    return ok("clock", "synchronised")


def check_ticks(late_s: Sequence[float]) -> Finding:
    """How late short sleeps end: the setpoint stream lives on them."""
    worst_s = max(late_s)
    found = f"sleeps of {1000 * TICK_S:.0f} ms end at most {1000 * worst_s:.1f} ms late"
    if worst_s > LATE_S:
        return caution("ticks", found, "end what keeps the cores busy; setpoints are due every 100 ms")
    return ok("ticks", found)


def check_keys(host_is_loopback: bool, any_keys: bool) -> Finding:
    """Strangers get nothing: off loopback there must be keys."""
    if any_keys:
        return ok("keys", "there are some")
    if host_is_loopback:
        return ok("keys", "none: the server prints an operator key for each run")
    return red(
        "keys", "none, and other machines can reach the server", "python -m gcs keys add --role admin --name NAME"
    )


def machine(config: ServerConfig) -> Iterator[Finding]:
    """All of the above for this machine."""
    yield check_disk(_store_folder(config.store.url))
    yield check_store(config.store.url)
    yield check_port(config.server.host, config.server.port)
    yield check_receive_buffer(_rmem_max())
    yield check_calendar(datetime.now(UTC))
    yield check_synchronised(_unsynchronised())
    yield check_ticks([_late_s() for _ in range(40)])


def _future_file(file: Path) -> Finding:
    folder = _existing(file.parent)
    try:
        with tempfile.TemporaryFile(dir=folder):
            return ok("store", f"{file} will be made")
    except OSError as error:
        return red("store", f"{file} cannot be made: {error.strerror}", f"make {folder} writable, or give --store")


def _store_folder(url: str) -> Path:
    try:
        parsed = make_url(url)
    except SQLAlchemyError:
        return Path()
    local = parsed.get_backend_name() == "sqlite" and parsed.database
    return Path(parsed.database or "").parent if local else Path()


def _existing(folder: Path) -> Path:
    """The folder, or the nearest one above it that is there."""
    absolute = folder.absolute()
    return next(place for place in (absolute, *absolute.parents) if place.is_dir())


def _rmem_max() -> int | None:
    try:
        return int(Path("/proc/sys/net/core/rmem_max").read_text(encoding="ascii"))
    except (OSError, ValueError):
        return None


def _unsynchronised() -> bool | None:
    """adjtimex(2) with nothing to set; None where there is no such call or it is not allowed."""
    if not sys.platform.startswith("linux") or ctypes.sizeof(ctypes.c_long) != 8:
        return None
    buffer = ctypes.create_string_buffer(TIMEX_BYTES)
    try:
        state = ctypes.CDLL(None, use_errno=True).adjtimex(buffer)
    except (OSError, AttributeError):
        return None
    if state < 0:
        return None
    return bool(ctypes.c_int.from_buffer(buffer, STATUS_OFFSET).value & STA_UNSYNC)


def _late_s() -> float:
    begun_s = time.monotonic()
    time.sleep(TICK_S)
    return time.monotonic() - begun_s - TICK_S
