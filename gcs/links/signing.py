"""MAVLink 2 signing on our side (https://mavlink.io/en/guide/message_signing.html), done by pymavlink.

The key comes from a file that only its owner may read, never from the command line or the environment, where other
programs see it, and it is in no log: telemetry logs are written without signatures, and a key does not print itself.
"""

import re
import stat
from pathlib import Path
from typing import Any, Final

from gcs.links.transport import LinkError

KEY_BYTES: Final = 32
EPOCH_2015_S: Final = 1_420_070_400
UNITS_A_S: Final = 100_000  # 10 us


class SigningKey:
    """One key for the fleet. Everything sent is signed, and only what is signed with it is believed."""

    def __init__(self, key: bytes) -> None:
        if len(key) != KEY_BYTES:
            raise LinkError(f"a signing key has {KEY_BYTES} bytes, not {len(key)}")
        self._key = key

    def __repr__(self) -> str:
        return "SigningKey(...)"

    __str__ = __repr__

    def __reduce__(self) -> str:
        raise TypeError("a signing key is not to be copied out of this process")

    def sign_with(self, codec: Any, link_id: int, unix_s: float) -> None:
        """Let a sender sign; each link counts its own time stamps."""
        codec.signing.secret_key, codec.signing.link_id = self._key, link_id
        codec.signing.timestamp, codec.signing.sign_outgoing = timestamp_units(unix_s), True

    def check_with(self, codec: Any, unix_s: float) -> None:
        """Let a receiver drop everything that is not signed with the key, late or repeated."""
        codec.signing.secret_key, codec.signing.timestamp = self._key, timestamp_units(unix_s)

    def tell_time(self, codec: Any, unix_s: float) -> None:
        """A time stamp is the clock's where it has gone on; it never goes back, whatever the clock does."""
        codec.signing.timestamp = max(codec.signing.timestamp, timestamp_units(unix_s))


def timestamp_units(unix_s: float) -> int:
    """A time as signatures count it: 10 us since 2015."""
    return round((unix_s - EPOCH_2015_S) * UNITS_A_S)


def read_key(path: Path) -> SigningKey:
    """Read 64 hexadecimal digits; LinkError when they are not, or when others may read the file."""
    try:
        mode, text = path.stat().st_mode, path.read_text("ascii").strip()
    except (OSError, UnicodeDecodeError) as error:
        raise LinkError(f"signing key '{path}' cannot be read: {getattr(error, 'strerror', None) or error}") from error
    if mode & (stat.S_IRWXG | stat.S_IRWXO):
        raise LinkError(f"signing key '{path}' may be read by others; chmod 600 it")
    if re.fullmatch(r"[0-9a-fA-F]{64}", text) is None:
        raise LinkError(f"signing key '{path}' does not hold 64 hexadecimal digits; openssl rand -hex 32 makes some")
    return SigningKey(bytes.fromhex(text))
