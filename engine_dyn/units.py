"""SI values of the units of files: the only place where they stand."""

from __future__ import annotations

import math

BAR = 1e5  # Pascal in a bar
MPA = 1e6

GPA = 1e9  # Pascal in a gigapascal
CUBIC_CENTIMETRE = 1e-6  # Cubic metres in a cubic centimetre
DEGREE = math.pi / 180.0  # Radians in a degree
RPM = math.pi / 30.0  # Radians per second in a revolution per minute
