"""The four metrics of a campaign (Eq. 5-7 and the energy ratio), from its recorded slots."""

from dataclasses import dataclass

import numpy as np

from policy.world.arrays import BoolArray, FloatArray
from policy.world.scenario import Scenario


@dataclass(frozen=True)
class Metrics:
    """One campaign's scores; ``user_coverage`` is a fraction of the users."""

    episodic_aoi: float  # kappa, slots, at least 1
    data_collection_ratio: float  # psi
    user_coverage: float  # rho
    energy_ratio: float  # zeta
    final_aoi: float  # mean AoI after the last slot


def campaign_metrics(
    scenario: Scenario,
    aoi_slots: FloatArray,
    data_mb: FloatArray,
    served: BoolArray,
    energy_used_j: FloatArray,
) -> Metrics:
    """Metrics over slots 1..T: ``aoi_slots`` [T, M], ``data_mb`` [T, M], ``served`` [T, M] after each slot,
    ``energy_used_j`` [U] in the whole campaign.
    """
    slots = aoi_slots.shape[0]
    if slots == 0:
        raise ValueError("a campaign without slots has no metrics")
    collected_mb = slots * scenario.slot_s * float(np.sum(scenario.collect_mbps))
    return Metrics(
        episodic_aoi=float(np.mean(aoi_slots)),  # Eq. 7
        data_collection_ratio=1.0 - float(np.sum(data_mb[-1])) / collected_mb,  # Eq. 5
        user_coverage=float(np.mean(served)),  # Eq. 6, as a fraction of M
        energy_ratio=float(np.mean(energy_used_j)) / scenario.battery_j,
        final_aoi=float(np.mean(aoi_slots[-1])),
    )
