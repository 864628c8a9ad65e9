"""Finite differences."""

from collections.abc import Callable
from typing import Any

import numpy as np

PHI = np.linspace(-7.0, 7.0, 281)


def slope(curve: Callable[[Any], Any], phi: Any, step: float) -> Any:
    """Central difference of fourth order."""
    near = curve(phi + step) - curve(phi - step)
    far = curve(phi + 2.0 * step) - curve(phi - 2.0 * step)
    return (8.0 * near - far) / (12.0 * step)
