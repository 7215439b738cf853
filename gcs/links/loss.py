"""Loss of one vehicle's messages, from the 8-bit sequence numbers (https://mavlink.io/en/guide/packet_loss.html)."""

_SMOOTHING = 0.02  # about the last 50 messages
_REORDERED = 128  # a step back, or a restart: says nothing about loss


class LossMeter:
    """Exponentially smoothed share of messages that did not come."""

    def __init__(self) -> None:
        self.ratio = 0.0
        self._last: int | None = None

    def on_sequence(self, sequence: int) -> None:
        """A message with this number arrived."""
        if self._last is not None:
            missed = (sequence - self._last - 1) % 256
            if missed >= _REORDERED:
                self._last = sequence if missed != 255 else self._last
                return
            for _ in range(min(missed, 50)):
                self.ratio += _SMOOTHING * (1.0 - self.ratio)
        self.ratio -= _SMOOTHING * self.ratio
        self._last = sequence
