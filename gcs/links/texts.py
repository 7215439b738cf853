"""STATUSTEXTs, long ones joined from their chunks."""

from typing import Any

_CHUNK_CHARS = 50


class TextJoiner:
    """Joins chunks by STATUSTEXT.id and chunk_seq; a shorter chunk than 50 characters is the last."""

    def __init__(self) -> None:
        self._partial: dict[int, dict[int, str]] = {}

    def take(self, message: Any) -> str | None:
        """The whole text, or None while chunks are missing."""
        text = str(message.text).rstrip("\0")
        number = getattr(message, "id", 0)
        if number == 0:
            return text
        chunks = self._partial.setdefault(number, {})
        chunks[message.chunk_seq] = text
        if len(text) >= _CHUNK_CHARS:
            return None
        del self._partial[number]
        return "".join(chunks[key] for key in sorted(chunks))
