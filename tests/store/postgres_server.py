"""A PostgreSQL server of the tests' own, from Debian's programs: a new cluster in a temporary folder."""

import os
import pwd
import shutil
import socket
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

START_S = 60.0


def programs() -> Path | None:
    """Where initdb and postgres are; Debian keeps them out of PATH."""
    found = shutil.which("initdb")
    if found:
        return Path(found).resolve().parent
    versions = sorted(Path("/usr/lib/postgresql").glob("*/bin/initdb"))
    return versions[-1].parent if versions else None


def is_installed() -> bool:
    """PostgreSQL refuses to run as root: root needs the user that Debian's package makes."""
    return programs() is not None and (os.geteuid() != 0 or _service_user() is not None)


@contextmanager
def postgres_server() -> Iterator[str]:
    """The URL of its administrator."""
    where = programs()
    assert where is not None
    with tempfile.TemporaryDirectory(prefix="ucs-postgres-") as folder:
        user = _service_user() if os.geteuid() == 0 else None
        if user is not None:
            os.chown(folder, user.pw_uid, user.pw_gid)
        account = {} if user is None else {"user": user.pw_uid, "group": user.pw_gid, "extra_groups": []}
        data = str(Path(folder) / "data")
        cluster = [str(where / "initdb"), "-D", data, "-U", "postgres", "--auth=trust", "--no-sync", "-E", "UTF8"]
        subprocess.run(cluster, check=True, capture_output=True, cwd=folder, **account)
        port = _free_port()
        options = ["-h", "127.0.0.1", "-p", str(port), "-k", folder, "-c", "fsync=off", "-c", "max_connections=50"]
        command = [str(where / "postgres"), "-D", data, *options]
        with subprocess.Popen(command, cwd=folder, stderr=subprocess.DEVNULL, **account) as process:
            try:
                _wait_for(where, port, process)
                yield f"postgresql+psycopg://postgres@127.0.0.1:{port}/postgres"
            finally:
                process.terminate()


def _service_user() -> pwd.struct_passwd | None:
    try:
        return pwd.getpwnam("postgres")
    except KeyError:
        return None


def _free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as probe:
        return int(probe.getsockname()[1])


def _wait_for(where: Path, port: int, process: "subprocess.Popen[bytes]") -> None:
    ready = [str(where / "pg_isready"), "-q", "-h", "127.0.0.1", "-p", str(port)]
    until_s = time.monotonic() + START_S
    while time.monotonic() < until_s and process.poll() is None:
        if subprocess.run(ready, check=False).returncode == 0:
            return
        time.sleep(0.1)  # another process starts: nothing to wait on but its answer
    raise RuntimeError("PostgreSQL did not start")
