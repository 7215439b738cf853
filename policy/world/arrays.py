"""One spelling for NumPy and torch: the functions of the world ask their arguments which library they are."""

from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt
from array_api_compat import array_namespace

Array: TypeAlias = Any
"""A numpy.ndarray or a torch.Tensor; a function returns what it was given."""

FloatArray: TypeAlias = npt.NDArray[np.float64]
BoolArray: TypeAlias = npt.NDArray[np.bool_]
IntArray: TypeAlias = npt.NDArray[np.int64]

__all__ = ["Array", "BoolArray", "FloatArray", "IntArray", "array_namespace", "norm"]


def norm(vector: Array) -> Array:
    """Euclidean length over the last axis: [..., D] -> [...]."""
    xp = array_namespace(vector)
    return xp.sqrt(xp.sum(vector * vector, axis=-1))
