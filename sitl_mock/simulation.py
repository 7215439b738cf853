"""N autopilots in one air: physics, links and faults advance in fixed steps. No socket, no clock."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sitl_mock.autopilot import PX4, Autopilot
from sitl_mock.body import Body
from sitl_mock.faults import Fault, Script
from sitl_mock.geodesy import Geodetic, to_geodetic
from sitl_mock.link import Link
from sitl_mock.physics.fleet import TICK_S, Air, Fleet, wind_ne
from sitl_mock.physics.vehicle import M600, VehicleType
from sitl_mock.sensors import Receiver
from sitl_mock.wire import Parser

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sitl_mock.autopilot.flavour import Flavour

PURDUE = Geodetic(40.4258, -86.9197, 186.0)  # middle of the Purdue trace's area, its ground about 186 m AMSL


@dataclass(frozen=True, slots=True)
class Setup:
    """What is simulated."""

    count: int = 1
    flavour: Flavour = PX4
    kind: VehicleType = M600
    home: Geodetic = PURDUE
    spacing_m: float = 4.0  # pads lie this far apart to the east of home
    wind_mps: float = 0.0
    wind_from_deg: float = 0.0
    gust_w20_mps: float = 0.0  # Dryden's wind at 20 ft
    ready_after_s: float | None = None
    faults: Sequence[Fault] = ()
    seed: int = 0
    gps_noise_m: float = 0.0
    gps_delay_s: float = 0.2
    ambient_c: float = 20.0
    key: bytes | None = None  # 32 bytes: all vehicles sign, and take signed messages only


@dataclass(frozen=True, slots=True)
class Datagram:
    """To be sent by vehicle `index` to one peer, or to all that it knows (None)."""

    index: int
    peer: int | None
    data: bytes


class Simulation:
    """Advances in steps of TICK_S. The same setup and the same received bytes give the same sent bytes."""

    def __init__(self, setup: Setup) -> None:
        """Vehicles stand on their pads, motors off, at time 0."""
        air = Air(wind_ne(setup.wind_mps, setup.wind_from_deg), setup.gust_w20_mps, setup.seed)
        self._fleet = Fleet([setup.kind] * setup.count, air)
        self._ticks = 0
        self._parsers: dict[tuple[int, int], Parser] = {}
        self.setup = setup
        seeds = np.random.SeedSequence(setup.seed).spawn(3 * setup.count)
        chances = [np.random.default_rng(seed) for seed in seeds]
        self.autopilots = [self._autopilot(setup, index, chances[3 * index + 2]) for index in range(setup.count)]
        self._up = [Link(chances[3 * index]) for index in range(setup.count)]
        self._down = [Link(chances[3 * index + 1]) for index in range(setup.count)]
        self.script = Script(list(setup.faults), setup.count)
        self._fleet.advance(0)  # compiles or loads the kernel before anybody waits for it

    def _autopilot(self, setup: Setup, index: int, rng: np.random.Generator) -> Autopilot:
        pad = to_geodetic(setup.home, 0.0, index * setup.spacing_m, 0.0)
        receiver = Receiver(setup.gps_noise_m, setup.gps_delay_s)
        body = Body(self._fleet, index, pad, rng, receiver=receiver, ambient_c=setup.ambient_c)
        return Autopilot(index + 1, setup.flavour, body, ready_after_s=setup.ready_after_s, key=setup.key)

    @property
    def now_s(self) -> float:
        """Simulated seconds since boot."""
        return self._ticks * TICK_S

    def receive(self, index: int, peer: int, data: bytes) -> None:
        """Takes a datagram that `peer` sent to vehicle `index`."""
        up = self._up[index]
        if up.quality.perfect and up.empty:
            self._deliver(index, peer, data)
        else:
            up.put(peer, data, self.now_s)

    def _deliver(self, index: int, peer: int, data: bytes) -> None:
        parser = self._parsers.setdefault((index, peer), Parser())
        for frame in parser.feed(data):
            self.autopilots[index].receive(frame, peer, self.now_s)

    def forget(self, index: int, peer: int) -> None:
        """Drops what is remembered of a peer."""
        self._parsers.pop((index, peer), None)

    def step(self) -> list[Datagram]:
        """One step of TICK_S; returns what is to be sent at its end."""
        now_s = self.now_s
        self._break(now_s)
        decides = self._fleet.decides
        for index, autopilot in enumerate(self.autopilots):
            for peer, data in self._up[index].take(now_s):
                assert peer is not None, "what goes up has a sender"
                self._deliver(index, peer, data)
            if decides:
                autopilot.tick(now_s)
        self._fleet.advance(1)
        self._ticks += 1
        return self.pending()

    def _break(self, now_s: float) -> None:
        """Faults begin and end."""
        for change in self.script.advance(now_s):
            autopilot = self.autopilots[change.index]
            self._up[change.index].quality, self._down[change.index].quality = change.effects.up, change.effects.down
            autopilot.suffer(change.effects)
            for strike in change.strikes:
                if strike.kind == "reboot":
                    autopilot.reboot()
                else:
                    autopilot.vehicle.body.drain(strike.value)

    def pending(self) -> list[Datagram]:
        """What is to be sent now."""
        now_s = self.now_s
        out: list[Datagram] = []
        for index, autopilot in enumerate(self.autopilots):
            autopilot.vehicle.now_s = now_s
            down = self._down[index]
            smooth = down.quality.perfect and down.empty
            for sent in autopilot.collect():
                if smooth:
                    out.append(Datagram(index, sent.peer, sent.data))
                else:
                    down.put(sent.peer, sent.data, now_s)
            out += [Datagram(index, peer, data) for peer, data in down.take(now_s)]
        return out

    def advance_to(self, until_s: float) -> list[Datagram]:
        """Steps up to `until_s` (the nearest step); returns all that was to be sent on the way."""
        out: list[Datagram] = []
        while self._ticks < round(until_s / TICK_S):
            out += self.step()
        return out
