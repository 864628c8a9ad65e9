"""Highest order of a torque over an angle that counts."""

from __future__ import annotations

import math

import numpy as np

from engine_dyn.loads.driven_machine import TorqueOverAngle

SAMPLES_OF_TURN = 2048


def highest_order(torque: TorqueOverAngle | None) -> float:
    """Highest order of a torque, of its own shaft, with a hundredth of the largest amplitude.

    Examples
    --------
    >>> from engine_dyn.loads.driven_machine import torque_of_harmonics
    >>> highest_order(torque_of_harmonics(2.0, {0.5: (10.0, 0.0), 24: (0.0, 1.0), 30: (0.0, 0.01)}))
    24.0
    """
    if torque is None:
        return 0.0
    turns = round(torque.period / (2.0 * math.pi))
    angles = np.arange(turns * SAMPLES_OF_TURN) * (2.0 * math.pi / SAMPLES_OF_TURN)
    amplitude = np.abs(np.fft.rfft(torque(angles)))[1:]
    # Amplitudes count from one hundredth of the largest on.
    counting = np.flatnonzero(amplitude > 0.01 * amplitude.max(initial=0.0))
    return float(counting[-1] + 1) / turns if counting.size else 0.0
