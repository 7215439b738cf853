"""The journal of one headless flight, kept in memory; warnings are told as they come."""

from collections.abc import Callable
from dataclasses import dataclass, field

from gcs.ports import Checkpoint, DecisionRecord, Event, Journal, SetpointSummary, Severity, SlotRecord, TelemetrySample


@dataclass
class FlightLog:
    """ports.Journal; ``tell`` gets every caution and warning as one line."""

    tell: Callable[[str], None] = lambda _line: None
    also: tuple[Journal, ...] = ()
    events: list[Event] = field(default_factory=list)
    slots: list[SlotRecord] = field(default_factory=list)
    telemetry: list[TelemetrySample] = field(default_factory=list)
    decisions: list[DecisionRecord] = field(default_factory=list)

    def record(self, event: Event) -> None:
        """Keep, pass on, tell."""
        self.events.append(event)
        for journal in self.also:
            journal.record(event)
        if event.severity is not Severity.INFO:
            self.tell(f"[{event.time_s:7.1f} s] {event.severity}: {event.message}")

    def record_slot(self, campaign_id: str, record: SlotRecord) -> None:
        """Keep and pass on."""
        self.slots.append(record)
        for journal in self.also:
            journal.record_slot(campaign_id, record)

    def record_decision(self, campaign_id: str, record: DecisionRecord) -> None:
        """Keep and pass on."""
        self.decisions.append(record)
        for journal in self.also:
            journal.record_decision(campaign_id, record)

    def record_setpoints(self, campaign_id: str, slot: int, told: tuple[SetpointSummary, ...]) -> None:
        """Pass on."""
        for journal in self.also:
            journal.record_setpoints(campaign_id, slot, told)

    def record_telemetry(self, campaign_id: str, sample: TelemetrySample) -> None:
        """Keep and pass on."""
        self.telemetry.append(sample)
        for journal in self.also:
            journal.record_telemetry(campaign_id, sample)

    def checkpoint(self, checkpoint: Checkpoint) -> None:
        """Pass on: a headless flight itself is not taken up again."""
        for journal in self.also:
            journal.checkpoint(checkpoint)

    def settle(self) -> bool:
        """Memory is there at once."""
        settled = [journal.settle() for journal in self.also]  # each one, whatever the others say
        return all(settled)

    def durability(self) -> Callable[[], bool]:
        """As the journals behind say."""
        questions = [journal.durability() for journal in self.also]
        return lambda: all(durable() for durable in questions)
