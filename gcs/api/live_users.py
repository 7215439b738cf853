"""Where live users are: the newest fix of each, reported by phones over REST.

Fixes come late, twice and out of order: a fix counts when it is newer than the one known. Users join in the order of
their first fix, in flight too: a campaign's arrays have a row for each user that the mission allows, and rows that
nobody has taken do not count. A user who says that he leaves, or of whom nothing new is heard for long, takes no part
until his next fix; where he was is forgotten. A receipt counts in the slot in which it arrives; who ever sent one is
judged by receipts alone.
"""

import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

import numpy as np

from gcs.ports import OperatorRequest, SlotRecord, UserPlaces
from gcs.store.records import CampaignRecord
from policy.mission_file import Mission
from policy.world.arrays import BoolArray, FloatArray
from policy.world.frames import LocalFrame
from policy.world.scenario import Scenario

MAX_SKEW = timedelta(seconds=60)  # a phone's clock may be ahead of ours by so much
AWAY_AFTER = timedelta(minutes=5)  # without a new fix: the phone is off, or its owner has gone
MAX_LATE = timedelta(seconds=60)  # an older receipt tells nothing about the present slot; it is only recorded


@dataclass(frozen=True)
class Fix:
    """Where a user was."""

    user: str
    lat_deg: float
    lon_deg: float
    time: datetime
    pending_mb: float | None = None


@dataclass(frozen=True)
class FixTally:
    """What became of a batch."""

    accepted: int = 0
    stale: int = 0  # not newer than what is known: late, or twice
    early: int = 0  # from the future
    outside: int = 0  # not in the campaign's area
    full: int = 0  # a new user, and all places are taken


class LiveUsers:
    """Written by the API's threads, read by the flight thread."""

    def __init__(
        self, frame: LocalFrame, size_m: tuple[float, float], capacity: int, away_after: timedelta = AWAY_AFTER
    ) -> None:
        self._frame, self._size_m, self._away_after = frame, size_m, away_after
        self._heard: dict[str, datetime] = {}  # on our clock, a phone's may be wrong; who left is not in it
        self._lock = threading.Lock()
        self._pos_enu_m = np.full((capacity, 2), np.nan)
        self._rows: dict[str, int] = {}
        self._times: dict[str, datetime] = {}
        self._pending_mb: dict[str, float] = {}
        self._receipts: dict[str, datetime] = {}
        self._uploaded = np.zeros(capacity, dtype=np.bool_)
        self._tells = np.zeros(capacity, dtype=np.bool_)

    @property
    def capacity(self) -> int:
        """The most users that may join."""
        return int(self._pos_enu_m.shape[0])

    def places(self) -> FloatArray:
        """[capacity, 2] east, north metres; NaN where nobody has joined."""
        with self._lock:
            return self._pos_enu_m.copy()

    def user_ids(self) -> Sequence[str]:
        """Who has joined, by row."""
        with self._lock:
            return list(self._rows)

    def pending_mb(self) -> Mapping[str, float]:
        """What users said they still hold."""
        with self._lock:
            return dict(self._pending_mb)

    def present(self, now: datetime) -> BoolArray:
        """[capacity] who takes part: has joined, has not left, and was heard of lately."""
        with self._lock:
            here = np.zeros(self.capacity, dtype=np.bool_)
            for user, row in self._rows.items():
                heard = self._heard.get(user)
                here[row] = heard is not None and now - heard <= self._away_after
                if not here[row]:
                    self._pos_enu_m[row] = np.nan
            return here

    def depart(self, user: str, time: datetime) -> bool:
        """He leaves; False when a newer fix of his is known, or nobody has heard of him."""
        with self._lock:
            known = self._times.get(user)
            if user not in self._rows or (known is not None and time < known):
                return False
            self._times[user] = time  # an older fix that arrives later does not bring him back
            self._heard.pop(user, None)
            self._pending_mb.pop(user, None)
            self._pos_enu_m[self._rows[user]] = np.nan
            return True

    def report(self, fixes: Sequence[Fix], now: datetime) -> FixTally:
        """Take in a batch, each fix for itself."""
        with self._lock:
            fates = [self._take(fix, now) for fix in fixes]
        return FixTally(**{fate: fates.count(fate) for fate in set(fates)})

    def receive(self, user: str, time: datetime, now: datetime) -> bool:
        """A receipt of an upload: False when it says nothing new (unknown user, twice, too old, from the future)."""
        with self._lock:
            row, known = self._rows.get(user), self._receipts.get(user)
            if row is None or not now - MAX_LATE <= time <= now + MAX_SKEW or (known is not None and time <= known):
                return False
            self._receipts[user] = time
            self._uploaded[row] = self._tells[row] = True
            return True

    def take_receipts(self) -> tuple[BoolArray, BoolArray]:
        """[capacity] who uploaded since the last call, and who ever told."""
        with self._lock:
            uploaded, self._uploaded = self._uploaded, np.zeros_like(self._uploaded)
            return uploaded, self._tells.copy()

    def bring_back(self, record: SlotRecord, now: datetime) -> None:
        """Take the rows over from a record; any new fix of a user counts."""
        with self._lock:
            for row, user in enumerate(record.users[: self.capacity]):
                self._rows[user.user_id] = row
                self._pos_enu_m[row] = (user.east_m, user.north_m)
                if user.active:
                    self._heard[user.user_id] = now

    def _take(self, fix: Fix, now: datetime) -> str:
        known = self._times.get(fix.user)
        east_m, north_m = map(float, self._frame.to_enu_m(fix.lat_deg, fix.lon_deg))
        if fix.time > now + MAX_SKEW:
            return "early"
        if known is not None and fix.time <= known:
            return "stale"
        if not (0.0 <= east_m <= self._size_m[0] and 0.0 <= north_m <= self._size_m[1]):
            return "outside"
        if fix.user not in self._rows and len(self._rows) >= self.capacity:
            return "full"
        row = self._rows.setdefault(fix.user, len(self._rows))
        self._pos_enu_m[row] = (east_m, north_m)
        self._times[fix.user], self._heard[fix.user] = fix.time, now
        if fix.pending_mb is not None:
            self._pending_mb[fix.user] = fix.pending_mb
        return "accepted"


@dataclass(frozen=True)
class Roster:
    """Live users as ports.LivePlaces."""

    users: LiveUsers
    wall: Callable[[], datetime]

    @property
    def num_users(self) -> int:
        """M: rows, taken or free."""
        return self.users.capacity

    def positions(self, sample: int) -> FloatArray:
        """[M, 2] east, north metres, the newest known: a live user is only where he is now, whatever the sample."""
        return self.users.places()

    def user_ids(self) -> tuple[str, ...]:
        """Who has joined, by row."""
        return tuple(self.users.user_ids())

    def present(self) -> BoolArray:
        """[M] who takes part now."""
        return self.users.present(self.wall())

    def take_receipts(self) -> tuple[BoolArray, BoolArray]:
        """[M] each; see :meth:`LiveUsers.take_receipts`."""
        return self.users.take_receipts()


class LiveCampaigns:
    """The live users of each campaign; the API fills them, the flight takes them from here."""

    def __init__(
        self, away_after: timedelta = AWAY_AFTER, wall: Callable[[], datetime] = lambda: datetime.now(UTC)
    ) -> None:
        self._away_after, self._wall = away_after, wall
        self._lock = threading.Lock()
        self._users: dict[str, LiveUsers] = {}

    def users(self, campaign_id: str, mission: Mission) -> LiveUsers:
        """The campaign's users, made at the first question."""
        area = mission.scenario.area
        with self._lock:
            if campaign_id not in self._users:
                self._users[campaign_id] = LiveUsers(area.frame, area.size_m, mission.users.live, self._away_after)
            return self._users[campaign_id]

    def enrol(self, request: OperatorRequest, scenario: Scenario) -> tuple[Scenario, tuple[str, ...], UserPlaces]:
        """For the flight: a row for each user that the mission allows. Raises ValueError while nobody has joined."""
        if request.campaign_id is None or request.mission is None:
            raise ValueError("a live campaign needs an id and a mission")
        users = self.users(request.campaign_id, request.mission)
        ids = tuple(users.user_ids())
        if not ids:
            raise ValueError("no user has sent a fix yet: post fixes before the start")
        free = ("",) * (users.capacity - len(ids))
        return scenario, ids + free, Roster(users, self._wall)

    def bring_back(self, record: CampaignRecord, mission: Mission, slots: Sequence[SlotRecord]) -> None:
        """After a restart: who took part, where they were at the end of the newest slot."""
        if mission.users.kind == "live" and slots:
            self.users(record.id, mission).bring_back(slots[-1], self._wall())

    def forget(self, campaign_id: str) -> None:
        """A campaign is over; places of people are not kept longer than needed."""
        with self._lock:
            self._users.pop(campaign_id, None)
