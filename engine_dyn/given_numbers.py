"""Numbers that a caller gives, as the arrays of floats that formulas take.

NumPy itself drops masks, units and imaginary parts, reads texts as numbers and takes the truth for
1. Everything that comes from outside passes here first, so that none of it happens in silence.

Besides, the different combinations of numbers that many designs have.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from engine_dyn.types import Floats, Integers


def given_array(name: str, value: Any, *, finite: bool = False) -> Floats:
    """Return numbers as an array of floats; an array of floats is returned as it is.

    Parameters
    ----------
    name : str
        The argument, for the message.
    value : array_like
        Numbers, or lists and arrays of them.
    finite : bool
        Whether NaN and infinity are refused.

    Raises
    ------
    ValueError
        For masked values, numbers with units, complex numbers, truth values, texts, whatever else
        is no number, and numbers beyond the range of floats.
    """
    if type(value) is not np.ndarray or value.dtype != np.float64:
        value = _as_floats(name, value)
    if finite and not np.isfinite(value).all():
        place = np.flatnonzero(~np.isfinite(value.reshape(-1)))[0]
        where = f"{name}, value {place + 1}" if value.ndim else name
        raise ValueError(f"{where} = {value.flat[place]:g}: must be a finite number")
    return value


def given_number(name: str, value: Any, *, finite: bool = False) -> float:
    """Return one number as a float; arguments and errors as of `given_array`."""
    if type(value) is not float:
        array = given_array(name, value)
        if array.size != 1:
            raise ValueError(f"{name}: {array.size} values: must be one number")
        value = float(array.reshape(-1)[0])
    if finite and not math.isfinite(value):
        raise ValueError(f"{name} = {value:g}: must be a finite number")
    return float(value)


def check_above_zero(**values: Any) -> None:
    """Refuse numbers that are not above 0, or not finite, with a ValueError that names them."""
    for name, value in values.items():
        array = given_array(name, value)
        wrong = ~((array > 0.0) & np.isfinite(array))
        if wrong.any():
            raise ValueError(f"{name} = {array[wrong].flat[0]:g}: must be above 0")


def _as_floats(name: str, value: Any) -> Floats:
    if np.ma.isMaskedArray(value):
        masked = np.flatnonzero(np.ma.getmaskarray(value).reshape(-1))
        if masked.size:
            where = f"value {masked[0] + 1} is masked" if value.ndim else "it is masked"
            raise ValueError(f"{name}: {where}: must be a number")
        value = value.data
    items: list[Any] | tuple[Any, ...] = (value,)
    if isinstance(value, list | tuple):
        items = value
    elif isinstance(value, np.ndarray) and value.dtype.hasobject:
        items = value.reshape(-1).tolist()
    kinds = set(map(type, items))
    for item in () if kinds <= {float, int} else items:
        # Numbers with units, of the packages pint, astropy and unyt, have one of three attributes
        # that plain numbers do not have.
        if any(hasattr(item, name) for name in ("magnitude", "to_value", "in_units")):
            raise ValueError(
                f"{name}: has the unit {getattr(item, 'units', getattr(item, 'unit', '?'))}: must "
                "be plain numbers; convert it to the documented unit and give the magnitude"
            )
    try:
        array = np.asarray(value)
        # An array of objects may hold fractions, or whole numbers beyond 64 bits.
        if array.dtype.kind not in "iufO" or kinds & {bool, str, type(None)}:
            raise TypeError
        return array.astype(np.float64)
    except OverflowError:
        raise ValueError(f"{name}: beyond the range of floating-point numbers") from None
    except (TypeError, ValueError):
        raise ValueError(f"{name}: {_shown(value)}: must be a number or an array of them") from None


def _shown(value: Any) -> str:
    text = " ".join(repr(value).split())
    return text if len(text) <= 60 else f"{text[:57]}..."


def distinct_combinations(*values: Any) -> tuple[Floats, Integers]:
    """Different combinations of some numbers of designs, and which of them each design has.

    NumPy sorts rows of a table as records, which takes 3 to 20 times as long.

    Parameters
    ----------
    *values : array_like
        One number of each design; all broadcast.

    Returns
    -------
    table : ndarray, shape (combinations, numbers)
        In ascending order, the first number first.
    which : ndarray of int
        Row of the table, in the shape that the values broadcast to.

    Examples
    --------
    >>> table, which = distinct_combinations([2, 1, 2, 1], [5, 5, 5, 6])
    >>> table.tolist(), which.tolist()
    ([[1.0, 5.0], [1.0, 6.0], [2.0, 5.0]], [2, 0, 2, 1])
    """
    given = [np.asarray(value, dtype=np.float64) for value in values]
    shape = np.broadcast_shapes(*(value.shape for value in given))
    which = np.zeros((), dtype=np.int64)
    for value in given:
        distinct, number = np.unique(value, return_inverse=True)
        if distinct.size > 1:
            both = which * distinct.size + number.reshape(value.shape)
            # Only combinations that occur are numbered, so that the numbers do not overflow.
            which = np.unique(both, return_inverse=True)[1].reshape(both.shape)
    which = np.array(np.broadcast_to(which, shape))
    first = np.unique(which, return_index=True)[1]
    table = np.stack([np.broadcast_to(value, shape).reshape(-1)[first] for value in given], axis=1)
    return table, which
