"""The second link: MAVSDK packs and reads the frames (its own C++ MAVLink, another table of messages than pymavlink).

What MAVSDK would do by itself is not used, because a dead planner must not be hidden: its offboard plugin repeats the
last setpoint (MAVSDK-Python#374), and its heartbeats come from a thread of its own. So it runs over our sockets (its
``raw://`` connection, one core a peer), and one of its heartbeats leaves for each that the flight loop's tick asks for.
"""

import importlib
import json
import math
import queue
from collections.abc import Mapping, Sequence
from types import SimpleNamespace
from typing import Any, Final

from gcs.links.fleet_link import Clock, WiredFleetLink
from gcs.links.frames import FrameCutter
from gcs.links.tlog import TlogRecorder
from gcs.links.transport import LinkError, Transport, open_all, troubles_of
from gcs.links.wire import OWN_COMPONENT_ID, OWN_SYSTEM_ID, Fields, Heard, Path

_HEARTBEAT: Final = 0
_OWN_NOTES: Final = frozenset({"message_id", "message_name"})  # that MAVSDK puts beside the fields


class MavsdkFleetLink(WiredFleetLink):
    """:class:`gcs.ports.FleetLink` over MAVSDK; the same addresses as the pymavlink link. It cannot sign."""

    def __init__(
        self,
        addresses: Sequence[str],
        expected: Mapping[str, int] | None = None,
        recorder: TlogRecorder | None = None,
        clock: Clock | None = None,
    ) -> None:
        try:
            mavsdk = importlib.import_module("mavsdk")
            direct = importlib.import_module("mavsdk.plugins.mavlink_direct")
        except ImportError as error:
            raise LinkError("the mavsdk link needs MAVSDK; pip install 'uav-crowdsensing[mavsdk]'") from error
        super().__init__(MavsdkWire(mavsdk, direct, open_all(addresses), recorder), expected, clock)


class MavsdkWire:
    """:class:`gcs.links.wire.Wire` over one MAVSDK core a peer."""

    def __init__(
        self, mavsdk: Any, direct: Any, transports: Sequence[Transport], recorder: TlogRecorder | None = None
    ) -> None:
        self._mavsdk, self._direct, self._recorder = mavsdk, direct, recorder
        self._transports = {transport.address: transport for transport in transports}
        self._cores: dict[Path, _Core] = {}
        for transport in transports:
            for peer in transport.peers():
                self._core(Path(transport.address, peer))

    def read(self, now_s: float) -> list[Heard]:
        """Headers of what has arrived (for loss), and what MAVSDK has decoded by now: it does so in its own thread."""
        heard: list[Heard] = []
        for transport in self._transports.values():
            for peer, data in transport.read(now_s):
                heard += self._core(Path(transport.address, peer)).take(data, now_s)
        for core in self._cores.values():
            heard += core.decoded()
            core.pass_on(now_s)
        return heard

    def write(self, name: str, fields: Fields, paths: Sequence[Path], now_s: float) -> None:
        """Let MAVSDK pack it; what it has packed by now leaves at once, the rest with the next call."""
        for core in [self._core(path) for path in paths] or list(self._cores.values()):
            if name == "HEARTBEAT":
                core.heartbeats += 1
            else:
                core.send(name, fields)
            core.pass_on(now_s)

    def skipped(self) -> dict[str, int]:
        """Datagrams thrown away unread so far, by address."""
        return {address: transport.skipped for address, transport in self._transports.items()}

    def troubles(self) -> list[str]:
        """What could not be sent, read or logged since the last call, for operators."""
        log = [] if self._recorder is None else self._recorder.take_troubles()
        return [*troubles_of(self._transports.values()), *log]

    def close(self) -> None:
        """End the cores, then release the sockets."""
        for core in self._cores.values():
            core.close()
        for transport in self._transports.values():
            transport.close()

    def _core(self, path: Path) -> "_Core":
        core = self._cores.get(path)
        if core is None:
            transport = self._transports[path.address]
            core = self._cores[path] = _Core(self._mavsdk, self._direct, path, transport, self._recorder)
        return core


class _Core:
    """One MAVSDK for one peer. Its callbacks come from its threads and only fill queues."""

    def __init__(
        self, mavsdk: Any, direct: Any, path: Path, transport: Transport, recorder: TlogRecorder | None
    ) -> None:
        self._path, self._transport, self._recorder, self._direct = path, transport, recorder, direct
        self._cutter, self._sent = FrameCutter(), FrameCutter()
        self._outbox: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        self._inbox: queue.SimpleQueue[tuple[str, int, int, str]] = queue.SimpleQueue()
        self._plugins: dict[int, Any] = {}
        self.heartbeats = 0  # asked for and not yet sent
        configuration = mavsdk.Configuration.create_manual(OWN_SYSTEM_ID, OWN_COMPONENT_ID, True)
        self._core = mavsdk.Mavsdk(configuration)
        self._core.add_any_connection("raw://")
        self._core.subscribe_raw_bytes_to_be_sent(lambda data: self._outbox.put(bytes(data)))

    def take(self, data: bytes, now_s: float) -> list[Heard]:
        """Hand bytes to MAVSDK; what their headers say."""
        frames = self._cutter.feed(data)
        for frame in frames:
            self._record(frame.data, now_s)
            self._core.pass_received_raw_bytes(frame.data)
        return [Heard(self._path, "", frame.system_id, frame.component_id, frame.sequence, None) for frame in frames]

    def decoded(self) -> list[Heard]:
        """Messages decoded since the last call."""
        if self._core.system_count() > len(self._plugins):
            self._listen_to_new()
        heard = []
        while not self._inbox.empty():
            name, system_id, component_id, document = self._inbox.get()
            body = _body(name, document)
            if body is not None:
                heard.append(Heard(self._path, name, system_id, component_id, None, body))
        return heard

    def send(self, name: str, fields: Fields) -> None:
        """Pack one message; nothing before the vehicle has been heard."""
        if not self._plugins:
            return
        target, component = fields.get("target_system", 0), fields.get("target_component", 0)
        plugin = self._plugins.get(target) or next(iter(self._plugins.values()))
        plain = {
            key: None if isinstance(value, float) and math.isnan(value) else value for key, value in fields.items()
        }
        document = json.dumps(plain)
        plugin.send_message(
            self._direct.MavlinkMessage(name, OWN_SYSTEM_ID, OWN_COMPONENT_ID, target, component, document)
        )

    def pass_on(self, now_s: float) -> None:
        """Send what MAVSDK has packed; of its own heartbeats as many as were asked for."""
        while not self._outbox.empty():
            for frame in self._sent.feed(self._outbox.get()):
                if frame.message_id == _HEARTBEAT:
                    if self.heartbeats == 0:
                        continue
                    self.heartbeats = 0  # a loop that stalled does not owe the missed ones
                self._record(frame.data, now_s)
                self._transport.write(frame.data, self._path.peer)

    def close(self) -> None:
        """Plugins first: they live in the core."""
        for plugin in self._plugins.values():
            plugin.destroy()
        self._core.destroy()

    def _listen_to_new(self) -> None:
        for system in self._core.get_systems():
            system_id = int(system.get_system_id())
            if system_id not in self._plugins:
                plugin = self._plugins[system_id] = self._direct.MavlinkDirect(system)
                plugin.subscribe_message("", self._on_message)

    def _on_message(self, message: Any, _: Any) -> None:
        self._inbox.put((message.message_name, message.system_id, message.component_id, message.fields_json))

    def _record(self, frame: bytes, now_s: float) -> None:
        if self._recorder is not None:
            self._recorder.record(self._path.address, now_s, frame)


def _body(name: str, document: str) -> Any:
    """Fields as attributes; JSON has no NaN and says null. None: no JSON, or a value that it cannot carry matters."""
    try:
        fields = {key: value for key, value in json.loads(document).items() if key not in _OWN_NOTES}
    except (ValueError, AttributeError):
        return None
    if name == "PARAM_VALUE" and fields.get("param_value") is None:
        return None  # an integer whose bytes are no number as a float: lost on the way
    return SimpleNamespace(**{key: math.nan if value is None else value for key, value in fields.items()})
