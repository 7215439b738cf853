"""Machine code from Python by numba: kept between runs, without the interpreter's lock, with no NaN tricks."""

from collections.abc import Callable
from typing import Any, TypeVar, cast

from numba import njit

Function = TypeVar("Function", bound=Callable[..., Any])

# Sums may be reordered (that is what lets them run on vector units); infinities keep their meaning.
FAST_SUMS = {"reassoc", "contract", "nsz"}


def compiled(function: Function) -> Function:
    """Compile at the first call for the types given. All that calls each other lives in one file: numba's cache
    watches the file of the caller only.
    """
    return cast(Function, njit(cache=True, nogil=True, fastmath=FAST_SUMS, error_model="numpy")(function))
