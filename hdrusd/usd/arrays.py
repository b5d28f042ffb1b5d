"""Array attributes as NumPy arrays of the shape that is wanted, whatever the layer wrote."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt


def rows(value: object, width: int) -> npt.NDArray[np.generic] | None:
    """An array attribute as (n, at least ``width``) numbers; None where it is anything else.

    A layer may give a schema's attribute another type, and a primvar indices that lead nowhere.
    """
    array = np.asarray(value if value is not None else [])
    if array.ndim == 0 or array.size == 0 or array.dtype.kind not in "fiu":
        return None
    shaped = array.reshape(len(array), -1)
    return shaped if shaped.shape[1] >= width else None


def integers(value: object) -> npt.NDArray[np.int64]:
    """An array attribute as (n,) whole numbers; empty where it is anything else."""
    array = rows(value, 1)
    whole = array is not None and array.shape[1] == 1 and array.dtype.kind in "iu"
    return array.ravel().astype(np.int64) if array is not None and whole else np.zeros(0, np.int64)


def numbers(value: object) -> npt.NDArray[np.float64]:
    """An array attribute as (n,) finite numbers; empty where it is anything else."""
    array = rows(value, 1)
    if array is None or array.shape[1] != 1:
        return np.zeros(0)
    result = array.ravel().astype(np.float64)
    return result if bool(np.isfinite(result).all()) else np.zeros(0)
