"""Remaining data and age of information (Eq. 3, 4)."""

from policy.world.arrays import Array, array_namespace

INITIAL_AOI_SLOTS = 1.0


def next_data_mb(data_mb: Array, served: Array, collect_mbps: Array, slot_s: float) -> Array:
    """Eq. 3: zero when served, else one more slot's data: [..., M] -> [..., M] megabits."""
    xp = array_namespace(data_mb)
    return xp.where(served, xp.zeros_like(data_mb), data_mb + collect_mbps * slot_s)


def next_aoi_slots(aoi_slots: Array, served: Array) -> Array:
    """Eq. 4: one when served, else one older: [..., M] -> [..., M]."""
    xp = array_namespace(aoi_slots)
    return xp.where(served, xp.ones_like(aoi_slots), aoi_slots + 1.0)
