"""The checked mission of each campaign, parsed once from its recorded document."""

import threading
from pathlib import Path

from gcs.api.schemas import CampaignStatic, ObstacleView
from gcs.store.campaigns import Campaigns
from gcs.store.records import CampaignRecord
from policy.mission_file import Mission, MissionError, parse_mission
from policy.world.frames import LocalFrame

KEPT = 64  # campaigns in memory; older ones are read again


class Catalog:
    """campaign id -> Mission and what the page needs of it."""

    def __init__(self, campaigns: Campaigns) -> None:
        self._campaigns = campaigns
        self._lock = threading.Lock()
        self._missions: dict[str, Mission] = {}

    def mission(self, record: CampaignRecord) -> Mission:
        """Raises MissionError when this version cannot read what an older one recorded."""
        with self._lock:
            known = self._missions.get(record.id)
        if known is None:
            directory = None if record.directory is None else Path(record.directory)
            known = parse_mission(record.document, origin=f"campaign {record.id}", directory=directory)
            self.keep(record.id, known)
        return known

    def keep(self, campaign_id: str, mission: Mission) -> None:
        """Remember a mission that was just checked."""
        with self._lock:
            self._missions[campaign_id] = mission
            while len(self._missions) > KEPT:
                self._missions.pop(next(iter(self._missions)))

    def at_hand(self, campaign_id: str) -> bool:
        """Its mission is in memory: nothing of it has to be read from the store."""
        with self._lock:
            return campaign_id in self._missions

    def static(self, campaign_id: str) -> CampaignStatic | None:
        """What does not change, or None for a campaign that is not in the store."""
        mission = self._find(campaign_id)
        return None if mission is None else campaign_static(campaign_id, mission)

    def frame(self, campaign_id: str) -> LocalFrame | None:
        """Local metres of a campaign's area."""
        mission = self._find(campaign_id)
        return None if mission is None else mission.scenario.area.frame

    def battery_j(self, campaign_id: str) -> float | None:
        """What a full battery of the mission holds."""
        mission = self._find(campaign_id)
        return None if mission is None else mission.scenario.battery_j

    def _find(self, campaign_id: str) -> Mission | None:
        """None for a campaign that the store does not have or that this version cannot read."""
        with self._lock:
            known = self._missions.get(campaign_id)
        record = self._campaigns.get(campaign_id) if known is None else None
        if record is None:
            return known
        try:
            return self.mission(record)
        except MissionError:
            return None


def campaign_static(campaign_id: str, mission: Mission) -> CampaignStatic:
    """The mission in the stream's words."""
    scenario = mission.scenario
    width_m, depth_m = scenario.area.size_m
    east_deg, north_deg = scenario.area.frame.to_enu_m(
        scenario.area.south_west_deg[0] + 1.0,
        scenario.area.south_west_deg[1] + 1.0,
    )
    return CampaignStatic(
        campaign_id=campaign_id,
        name=mission.name,
        policy=mission.policy,
        user_source=mission.users.kind,  # type: ignore[arg-type]
        south_west_deg=scenario.area.south_west_deg,
        size_m=scenario.area.size_m,
        metres_per_deg=(float(east_deg), float(north_deg)),
        fence_m=[(0.0, 0.0), (width_m, 0.0), (width_m, depth_m), (0.0, depth_m)],
        obstacles=[
            ObstacleView(name=o.name, height_m=o.height_m, polygon_m=[(float(e), float(n)) for e, n in o.polygon_m])
            for o in scenario.area.obstacles
        ],
        launch_m=[(float(e), float(n)) for e, n in scenario.launch_enu_m],
        altitude_m=scenario.altitude_m,
        serving_radius_m=scenario.serving_radius_m,
        max_speed_mps=scenario.max_speed_mps,
        mcl_db=scenario.radio.mcl_db,
        slots=scenario.slots,
        slot_s=scenario.slot_s,
    )
