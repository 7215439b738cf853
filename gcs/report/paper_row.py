"""The paper's own line of the comparison, where the campaign is one of the paper's."""

import math

from gcs.report.data import MetricsRow
from policy.evaluation.tables.paper import TABLE_III
from policy.mission_file import Mission
from policy.world.metrics import Metrics

TRACES = {"purdue_59.csv": "purdue", "ncsu_33.csv": "ncsu", "kaist_92.csv": "kaist"}
UAVS, SLOTS, SLOT_S, MCL_DB, MAX_SPEED_MPS = 2, 120, 15.0, 117.0, 18.0  # Section VII-A


def paper_rows(mission: Mission) -> tuple[MetricsRow, ...]:
    """GCRL-min(AoI) of Table III for this campus; nothing unless fleet, radio, users and length are the paper's."""
    campus = TRACES.get(mission.users.trace or "")
    scenario = mission.scenario
    setting = (scenario.num_uavs, scenario.slots, scenario.slot_s, scenario.radio.mcl_db, scenario.max_speed_mps)
    if campus is None or setting != (UAVS, SLOTS, SLOT_S, MCL_DB, MAX_SPEED_MPS):
        return ()
    printed = TABLE_III["gcrl", campus]
    note = "as printed in the paper (Table III): 2 UAVs, 117 dB, 120 slots, ideal motion"
    return (MetricsRow("paper, GCRL-min(AoI)", Metrics(*printed, final_aoi=math.nan), note),)
