"""The flight loop: one synchronous thread, ten ticks a second, that alone talks to the vehicles.

Order of a tick: wait, poll, requests, mission manager, gate, publish, flush, send. Heartbeats leave in ``flush``,
after the manager has stepped: a loop that stalls or dies falls silent, and the vehicles' own failsafes take over.
A large fleet's setpoints leave in the second half of a tick, at times that do not depend on how long the work before
them took: a tick with more of it (a slot's end, a burst of messages) must not shift them. Nothing else need wait for
that, so snapshot, orders and heartbeats come first.
"""

import logging
import queue
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from typing import TypeAlias

from gcs.dead_man import DeadMan
from gcs.late_setpoints import LateSetpoints
from gcs.mission.manager import MissionManager, Refused
from gcs.mission.order import CampaignOrder
from gcs.mission.preflight import Line, check_fleet, red_lines
from gcs.mission.resume import Resumption
from gcs.mission.telemetry_sampler import TelemetrySampler
from gcs.ports import (
    CampaignSnapshot,
    CommandKind,
    CommandTicket,
    Event,
    FleetLink,
    FlightClock,
    FlightSnapshot,
    Journal,
    OperatorRequest,
    RequestKind,
    RequestOutcome,
    Severity,
    Verdict,
)
from gcs.safety.gate import SealedSetpoint

logger = logging.getLogger(__name__)

TICK_S = 0.1
"""PX4 drops OFFBOARD after 1 s without setpoints, ArduPilot brakes after 3 s; ten a second bears losses."""

HEALTHY_S = 1.0  # wall time since the last tick beyond which nobody should trust the loop
SPREAD_FROM = 10  # fleets larger than this are sent to in several bursts a tick (one burst is lost in buffers)
MOST_BURSTS = 5  # a tick: after each the flight must be given the interpreter anew
SPREAD_SHARE = 0.4  # of a tick over which the bursts are spread
LEAD_EACH_S = 0.0005  # a drone: how long after a tick's own time the first burst leaves, though it be ready before
LEAD_SHARE = 0.5  # of a tick: the most of it
LEAST_GAP_S = 0.002  # between two bursts of a tick whose work took longer than that
MISSED_REPORT_S = 10.0
FAILING_HELD_S = 5.0  # a mission that fails at every tick is held for so long, then the loop falls silent
_Told: TypeAlias = tuple[CampaignSnapshot | None, bool, tuple[int, ...]]
"""A campaign, the stop latch of all, and the drones stopped one by one."""
MOST_UNTOLD = 100  # ticks that wait for the store before they are told; the journal gives up long before

_ON_CAMPAIGN_DRONES = frozenset({CommandKind.HOLD, CommandKind.RETURN, CommandKind.LAND, CommandKind.TERMINATE})
_FORBIDDEN_WHEN_STOPPED = frozenset({CommandKind.ARM, CommandKind.TAKEOFF, CommandKind.GUIDED})

Prepare = Callable[[OperatorRequest], CampaignOrder]
"""Reads users and loads a policy for a START request; runs on the caller's thread; raises ValueError in one line."""


@dataclass
class _Job:
    request: OperatorRequest
    future: Future[RequestOutcome]
    order: CampaignOrder | None = None
    ticket: CommandTicket | None = None


class FlightLoop:
    """Runs the mission manager on a clock (ports.FlightControl for other threads)."""

    def __init__(
        self,
        clock: FlightClock,
        link: FleetLink,
        manager: MissionManager,
        journal: Journal,
        prepare: Prepare | None = None,
    ) -> None:
        self._clock, self._link, self._manager, self._journal = clock, link, manager, journal
        self._prepare = prepare
        self._sampler = TelemetrySampler(journal)
        self._jobs: queue.SimpleQueue[_Job] = queue.SimpleQueue()
        self._commands: list[_Job] = []
        self._stop = threading.Event()
        self._next_s = clock.now_s()
        self._tick = 0
        self._ticked_wall_s: float | None = None
        self._period_s: float | None = None  # between the last two ticks' setpoints, wall clock
        self._missed = 0
        self._missed_reported_s = clock.now_s()
        self._snapshot = FlightSnapshot(clock.now_s(), 0)
        self._failing_since_s: float | None = None
        self._dead_man = DeadMan(clock.now_s, link.send)
        self._late = LateSetpoints()
        self._untold: deque[tuple[Callable[[], bool], _Told]] = deque(maxlen=MOST_UNTOLD)
        self._told: _Told = (None, False, ())

    # --- any thread -----------------------------------------------------------------------------------------------

    def snapshot(self) -> FlightSnapshot:
        """The newest tick."""
        return self._snapshot

    def submit(self, request: OperatorRequest) -> "Future[RequestOutcome]":
        """Leave a request; a START is prepared here, on the caller's thread, so that the loop never waits."""
        future: Future[RequestOutcome] = Future()
        order = None
        if request.kind is RequestKind.START:
            if self._prepare is None or request.mission is None:
                future.set_result(RequestOutcome(False, "a start needs a mission"))
                return future
            try:
                order = self._prepare(request)
            except ValueError as error:
                future.set_result(RequestOutcome(False, str(error)))
                return future
        self._jobs.put(_Job(request, future, order))
        return future

    def healthy(self) -> bool:
        """Ticked within :data:`HEALTHY_S` on the wall clock."""
        return self._ticked_wall_s is not None and time.monotonic() - self._ticked_wall_s < HEALTHY_S

    def violations(self) -> dict[str, int]:
        """UAV-slots of the newest campaign in which a rule was broken, by rule."""
        campaign = self._manager.campaign
        return dict(campaign.monitor.counts) if campaign is not None else {}

    def stop(self) -> None:
        """End :meth:`run` after the present tick. Drones are not brought down: that is what ABORT is for."""
        self._stop.set()

    # --- the flight thread ----------------------------------------------------------------------------------------

    def run(self, until: Callable[[FlightSnapshot], bool] | None = None) -> None:
        """Tick until stopped or until ``until`` says so."""
        if not self._clock.is_virtual:
            self._dead_man.watch()
        try:
            while not self._stop.is_set():
                snapshot = self.tick()
                if until is not None and until(snapshot):
                    return
        finally:
            self._dead_man.end()

    def tick(self) -> FlightSnapshot:
        """One tick, in the order that the module names."""
        due_s = self._wait()
        with self._dead_man.hands:
            self._link.poll(due_s)
        now_s = self._clock.now_s()  # a poll that took long makes what it brought old
        self._take_requests(now_s)
        safe = self._fly(now_s)
        snapshot = self._publish(now_s)
        with self._dead_man.hands:
            self._settle_commands(now_s)
            if self._failing_since_s is None:  # nothing vouches for a mission that no longer steps
                self._link.flush(now_s)
            self._send(safe, now_s)
        for notice in self._link.drain_notices():
            self._journal.record(Event(now_s, "link.notice", notice, Severity.WARNING))
        self._tell_delays(self._dead_man.feed(safe), now_s)
        self._note_sent()
        self._sampler.tick(self._manager.campaign, self._manager.vehicles, now_s)  # after all that somebody waits for
        return snapshot

    def _tell_delays(self, held_s: float, now_s: float) -> None:
        if held_s:
            message = f"the flight loop stalled for {held_s:.1f} s or more; its drones were told to stop meanwhile"
            self._journal.record(Event(now_s, "loop.stalled", message, Severity.WARNING))
        late = self._late.report(now_s)
        if late:
            self._journal.record(Event(now_s, "loop.late", late, Severity.WARNING))

    def _fly(self, now_s: float) -> list[SealedSetpoint]:
        """The mission's setpoints; a mission that fails is a defect, and its drones hold, then nothing is sent."""
        try:
            safe = self._manager.step(now_s)
        except Exception as error:  # a defect somewhere in the mission: whatever it is, the drones must not fly on
            logger.exception("the mission failed")
            if self._failing_since_s is None:
                self._failing_since_s = now_s
                message = f"the mission failed ({type(error).__name__}: {error}); its drones hold"
                self._journal.record(Event(now_s, "loop.failed", message, Severity.WARNING))
            return [] if self._is_silent(now_s) else self._held(now_s)
        self._failing_since_s = None
        return safe

    def _held(self, now_s: float) -> list[SealedSetpoint]:
        try:
            return self._manager.holding(now_s)
        except Exception:  # nothing is left to trust: the vehicles' own failsafes fly
            logger.exception("holding failed too")
            return []

    def _is_silent(self, now_s: float) -> bool:
        """The mission has failed for too long: no more setpoints either, the vehicles' failsafes take over."""
        return self._failing_since_s is not None and now_s - self._failing_since_s > FAILING_HELD_S

    def start(self, order: CampaignOrder, actor: str = "system") -> None:
        """Begin a campaign from the flight thread itself; raises ``Refused``."""
        self._manager.start(order, self._clock.now_s(), actor)

    def take_up(self, order: CampaignOrder, resumption: Resumption) -> None:
        """Go on with a campaign of a process before; to be called before :meth:`run`."""
        self._manager.take_up(order, resumption, self._clock.now_s())

    def latch_stop(self, system_id: int | None = None) -> None:
        """The emergency stop, for all or one, was latched when the process before ended; before :meth:`run`."""
        self._manager.emergency.press(system_id)

    def _wait(self) -> float:
        self._clock.wait_until(self._next_s)
        now_s = self._clock.now_s()
        late = int((now_s - self._next_s) / TICK_S)
        if late > 0:  # missed ticks are counted, never made up for in a burst
            self._missed += late
            self._next_s += late * TICK_S
        self._next_s += TICK_S
        if self._missed and now_s - self._missed_reported_s >= MISSED_REPORT_S:
            message = f"{self._missed} ticks missed: the machine is too slow or was asleep"
            self._journal.record(Event(now_s, "loop.missed", message, Severity.CAUTION))
            self._missed, self._missed_reported_s = 0, now_s
        return now_s

    def _send(self, safe: Sequence[SealedSetpoint], judged_s: float) -> None:
        """In real time a large fleet's setpoints are spread over the tick; what has become old is not sent."""
        each = len(safe) if self._clock.is_virtual else max(SPREAD_FROM, -(-len(safe) // MOST_BURSTS))
        bursts = -(-len(safe) // max(each, 1))
        from_s = self._next_s - TICK_S + min(len(safe) * LEAD_EACH_S, LEAD_SHARE * TICK_S)
        for burst in range(bursts):
            if bursts > 1:
                even_s = from_s + burst * SPREAD_SHARE * TICK_S / bursts
                self._clock.wait_until(even_s if burst == 0 else max(even_s, self._clock.now_s() + LEAST_GAP_S))
            for setpoint in safe[burst * each : (burst + 1) * each]:
                now_s = self._clock.now_s()
                self._link.send(self._late.in_time(setpoint, judged_s, now_s), now_s)

    def _note_sent(self) -> None:
        wall_s = time.monotonic()
        self._period_s = wall_s - self._ticked_wall_s if self._ticked_wall_s is not None else None
        self._ticked_wall_s = wall_s

    def _publish(self, now_s: float) -> FlightSnapshot:
        self._tick += 1
        campaign, stopped, stopped_ids = self._durable(now_s)
        self._snapshot = FlightSnapshot(
            time_s=now_s,
            tick=self._tick,
            vehicles=tuple(self._manager.vehicles.values()),
            campaign=campaign,
            stopped=stopped,
            stopped_ids=stopped_ids,
            setpoint_period_s=self._period_s,
        )
        return self._snapshot

    def _durable(self, now_s: float) -> _Told:
        """The newest campaign and stop latches whose records are in the store: mostly this tick's, else one before."""
        manager, emergency = self._manager, self._manager.emergency
        told = (manager.snapshot(now_s), emergency.latched, tuple(sorted(emergency.ones)))
        self._untold.append((self._journal.durability(), told))
        while self._untold and self._untold[0][0]():
            _, self._told = self._untold.popleft()
        return self._told

    def _take_requests(self, now_s: float) -> None:
        while not self._jobs.empty():
            job = self._jobs.get()
            if not job.future.set_running_or_notify_cancel():
                continue  # nobody waits for it any more
            try:
                outcome = self._act(job, now_s)
            except Refused as refusal:
                outcome = RequestOutcome(False, str(refusal))
                if job.order is not None:
                    job.order.planner.close()
            except Exception as error:  # a defect in one request must not end the flight of those in the air
                logger.exception("a request failed")
                outcome = RequestOutcome(False, f"{job.request.kind} failed: {type(error).__name__}: {error}")
            self._note(job.request, outcome, now_s)
            if outcome is not None:
                job.future.set_result(outcome)

    def _act(self, job: _Job, now_s: float) -> RequestOutcome | None:
        """Do it; None when the outcome comes later."""
        request, manager = job.request, self._manager
        if request.kind is RequestKind.COMMAND:
            return self._command(job, now_s)
        if request.kind is RequestKind.START:
            assert job.order is not None
            self._preflight(job.order, request, now_s)
            manager.start(job.order, now_s, request.actor)
        elif request.kind is RequestKind.EMERGENCY_STOP:
            manager.stop(now_s, request.actor, request.system_id)
        elif request.kind is RequestKind.RESET_STOP:
            manager.reset_stop(now_s, request.actor, request.system_id)
        else:
            self._check_campaign(request)
            actions = {
                RequestKind.PAUSE: manager.pause,
                RequestKind.RESUME: manager.resume,
                RequestKind.ABORT: manager.abort,
            }
            actions[request.kind](now_s, request.actor)
        return RequestOutcome(True)

    def _preflight(self, order: CampaignOrder, request: OperatorRequest, now_s: float) -> None:
        """No start while a line is red, unless an admin overrides it, which is recorded."""
        red = red_lines(self.preflight(order, now_s))
        if not red:
            return
        words = "; ".join(line.words() for line in red)
        if not request.override:
            raise Refused(f"pre-flight: {words}")
        event = Event(now_s, "preflight.overridden", f"pre-flight overridden by {request.actor}: {words}",
                      Severity.WARNING, request.campaign_id, None, request.actor)  # fmt: skip
        self._journal.record(event)

    def preflight(self, order: CampaignOrder, now_s: float) -> tuple[Line, ...]:
        """The checklist for a campaign, as of now."""
        reserve = order.settings.battery_reserve
        return check_fleet(order.scenario, order.system_ids, self._link.vehicles(), now_s, reserve)

    def _check_campaign(self, request: OperatorRequest) -> None:
        campaign = self._manager.campaign
        if request.campaign_id is not None and (campaign is None or campaign.order.campaign_id != request.campaign_id):
            raise Refused(f"campaign {request.campaign_id} is not being flown")

    def _command(self, job: _Job, now_s: float) -> RequestOutcome | None:
        """One order to one vehicle. A drone of a campaign is released first, or the order is refused."""
        command = job.request.command
        if command is None:
            raise Refused("a command request needs a command")
        if self._manager.emergency.stops(command.system_id) and command.kind in _FORBIDDEN_WHEN_STOPPED:
            raise Refused("the emergency stop is latched; reset it first")
        if self._manager.holds(command.system_id):
            if command.kind not in _ON_CAMPAIGN_DRONES:
                raise Refused(f"drone {command.system_id} flies a campaign; it takes hold, rtl, land or terminate only")
            self._manager.release(command.system_id, now_s, f"{command.kind} ordered by {job.request.actor}")
        if command.kind is not CommandKind.HOLD:
            self._manager.emergency.leave(command.system_id, now_s)
        job.ticket = self._link.submit(command, now_s)
        self._commands.append(job)
        return None

    def _settle_commands(self, now_s: float) -> None:
        for job in list(self._commands):
            verdict = job.ticket.verdict if job.ticket is not None else None
            if verdict is not None:
                self._commands.remove(job)
                outcome = RequestOutcome(verdict.accepted, verdict.reason, verdict)
                self._note_verdict(job.request, verdict, now_s)
                job.future.set_result(outcome)

    def _note(self, request: OperatorRequest, outcome: RequestOutcome | None, now_s: float) -> None:
        answer = "taken up" if outcome is None or outcome.accepted else f"refused: {outcome.reason}"
        message = f"{request.kind} by {request.actor}: {answer}"
        system_id = request.command.system_id if request.command is not None else None
        event = Event(now_s, "operator.request", message, Severity.INFO, request.campaign_id, system_id, request.actor)
        self._journal.record(event)

    def _note_verdict(self, request: OperatorRequest, verdict: Verdict, now_s: float) -> None:
        command = verdict.command
        words = f": {verdict.reason}" if verdict.reason else ""
        message = f"drone {command.system_id} {command.kind}: {verdict.result}{words}"
        severity = Severity.INFO if verdict.accepted else Severity.CAUTION
        data = {
            "command": str(command.kind),
            "result": str(verdict.result),
            "attempts": verdict.attempts,
            "reason": verdict.reason,
        }
        self._journal.record(
            Event(now_s, "command.verdict", message, severity, None, command.system_id, request.actor, data)
        )
