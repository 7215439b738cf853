"""Which of the commands that were sent may still act. Compiled, and called by nothing else that is compiled."""

from numba import njit

from policy.world.arrays import FloatArray

_ALIKE_MPS = 0.5


@njit(cache=True)
def still_acting(sent: FloatArray, acting: FloatArray) -> int:
    """Different velocities among ``sent`` [S, 3], newest first, into ``acting`` [most, 3]; returns how many.

    Of those that are much alike the newest stands for all; the more there are, the more counts as alike.
    """
    alike_mps, most = _ALIKE_MPS, len(acting)
    while True:
        count = 0
        for s in range(len(sent)):
            is_known = False
            for k in range(count):
                d_e, d_n, d_u = sent[s, 0] - acting[k, 0], sent[s, 1] - acting[k, 1], sent[s, 2] - acting[k, 2]
                is_known = is_known or d_e * d_e + d_n * d_n + d_u * d_u <= alike_mps * alike_mps
            if is_known:
                continue
            if count == most:
                count += 1
                break
            acting[count] = sent[s]
            count += 1
        if count <= most:
            return count
        alike_mps *= 2.0


@njit(cache=True)
def acting_climbs(sent: FloatArray, climbs: FloatArray) -> None:
    """Lowest and highest climb among ``sent`` [S, 3] into ``climbs`` [2]: here none counts as alike another one."""
    climbs[0], climbs[1] = sent[:, 2].min(), sent[:, 2].max()
