"""Exact kinematics of the slider-crank mechanism, also with an offset cylinder (desaxe).

Angle zero is top dead centre; the piston's travel, velocity and acceleration are positive towards
bottom dead centre. All three are reduced: they depend on the crank ratio lambda = r/l and on the
offset e/r alone. docs/method.md (2) to (11) derives them, with the conditions under which the crank
turns; tests compare them with the closed triangle of crank, rod and line of the pin.

Offset
------
The piston pin moves on a line at a distance e from the crank's axis. Two constructions give it,
and they add up, because only the line of the pin matters to the mechanism:

    e = crank_offset + pin_offset,

`crank_offset` from the crank's axis to the cylinder's axis, `pin_offset` from the cylinder's axis
to the pin. Both are positive towards the side on which the crank pin goes down. The connecting rod
then stands more upright in the expansion stroke and the side thrust N = F tan(beta) of that stroke
is smaller; a pin moved towards the major thrust side, as is usual against noise, is negative.

What differs is where the forces act: an offset crank leaves the piston's own balance alone, while
an offset pin gives the gas force, which acts on the cylinder's axis, a moment F pin_offset about
the pin, which the skirt takes up. Travel, velocity, acceleration, torque and size of the side
thrust depend on e only.

Sources: Norton, Design of Machinery (the offset fourbar slider-crank); Mettig, Die Konstruktion
schnellaufender Verbrennungsmotoren (series in lambda and e); neither was compared page by page.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from engine_dyn.compilation import inlined
from engine_dyn.given_numbers import given_array


class _Crank(NamedTuple):
    """Crank and rod at some angles, with lengths over the crank radius."""

    ratio: Any
    offset: Any
    sine: Any  # sine of the crank's angle to the cylinder
    cosine: Any
    root: Any  # cosine of the rod's angle


def _checked(
    phi: npt.ArrayLike, crank_ratio: npt.ArrayLike, offset: npt.ArrayLike
) -> tuple[Any, Any, Any]:
    ratio = given_array("crank_ratio", crank_ratio)
    if not np.all((ratio > 0.0) & (ratio < 1.0)):
        bad = ratio[~((ratio > 0.0) & (ratio < 1.0))].flat[0]
        raise ValueError(f"crank_ratio = {bad:g}: must lie between 0 and 1, both excluded")
    offset_ratio = given_array("offset", offset)
    if offset_ratio.any():  # NaN is true here, and refused below
        turns = ratio * (1.0 + np.abs(offset_ratio)) < 1.0
        if not np.all(turns):
            bad = np.broadcast_to(offset_ratio, turns.shape)[~turns].flat[0]
            most = 1.0 / np.broadcast_to(ratio, turns.shape)[~turns].flat[0] - 1.0
            raise ValueError(
                f"offset = {bad:g} crank radii: the crank cannot turn; offset and crank radius "
                f"must together be below the rod's length, here offset below {most:g}"
            )
    return given_array("phi", phi), ratio, offset_ratio


def _crank(phi: npt.ArrayLike, crank_ratio: npt.ArrayLike, offset: npt.ArrayLike) -> _Crank:
    """Angles of crank and rod, docs/method.md (2), (4) and (5)."""
    angle, ratio, offset_ratio = _checked(phi, crank_ratio, offset)
    sine, cosine = np.sin(angle), np.cos(angle)
    # phi counts from top dead centre, where an offset crank is not in line with the cylinder.
    # Addition theorems give sine and cosine of the crank's angle to the cylinder; for many angles
    # they are quicker than the sine of each sum.
    if offset_ratio.any():
        shift = ratio * offset_ratio / (1.0 + ratio)
        rest = np.sqrt(1.0 - shift * shift)
        sine, cosine = sine * rest + cosine * shift, cosine * rest - sine * shift
    root = np.sqrt(1.0 - (ratio * (sine - offset_ratio)) ** 2)
    return _Crank(ratio, offset_ratio, sine, cosine, root)


def position(phi: npt.ArrayLike, crank_ratio: npt.ArrayLike, offset: npt.ArrayLike = 0.0) -> Any:
    """Piston travel from top dead centre over the crank radius, x/r.

    Parameters
    ----------
    phi : array_like
        Crank angle from top dead centre [rad]; broadcasts with `crank_ratio` and `offset`.
    crank_ratio : array_like
        Crank radius over rod length, lambda = r/l [1], in (0, 1).
    offset : array_like, optional
        Distance of the piston pin's line from the crank's axis over the crank radius, e/r [1],
        positive towards the side on which the crank pin goes down.

    Returns
    -------
    numpy.ndarray or numpy.float64
        x/r, from 0 at top dead centre to the stroke over r at bottom dead centre (2 without
        offset).

    Raises
    ------
    ValueError
        If a crank ratio lies outside (0, 1), or an offset does not let the crank turn.

    Notes
    -----
    docs/method.md (7) with an offset and (8) without; Kakaitsas (2015), eq. 1.4; Mosakowski, eq. 1
    (there measured from the crank's axis). Neither form has a difference of nearly equal numbers,
    so small lambda and small angles lose no digits.

    Examples
    --------
    >>> import engine_dyn
    >>> import numpy as np
    >>> engine_dyn.position(np.radians([0, 90, 180]), 0.25).round(4)
    array([0.   , 1.127, 2.   ])
    """
    crank = _crank(phi, crank_ratio, offset)
    ratio, sine, root = crank.ratio, crank.sine, crank.root
    half = np.sin(0.5 * np.asarray(phi, dtype=float)) ** 2
    plain = 2.0 * half + ratio * sine**2 / (1.0 + root)
    if not crank.offset.any():
        return plain
    top = (1.0 + ratio) * np.sqrt(1.0 - (ratio * crank.offset / (1.0 + ratio)) ** 2)
    shifted = 4.0 * (1.0 + ratio) * half / (top - ratio * crank.cosine + root)
    return np.where(crank.offset == 0.0, plain, shifted)[()]


def velocity(phi: npt.ArrayLike, crank_ratio: npt.ArrayLike, offset: npt.ArrayLike = 0.0) -> Any:
    """Piston velocity over the crank pin's, c/(r omega); positive towards bottom dead centre.

    Parameters and errors as `position`. docs/method.md (9); Kakaitsas (2015), eq. 1.6; Mosakowski,
    eq. 2 (opposite sign there).

    Examples
    --------
    >>> import engine_dyn
    >>> import numpy as np
    >>> engine_dyn.velocity(np.radians([0, 90, 180]), 0.25).round(4)
    array([0., 1., 0.])
    """
    ratio, offset, sine, cosine, root = _crank(phi, crank_ratio, offset)
    return sine * (1.0 + ratio * cosine / root) - offset * (ratio * cosine / root)


def acceleration(
    phi: npt.ArrayLike, crank_ratio: npt.ArrayLike, offset: npt.ArrayLike = 0.0
) -> Any:
    """Piston acceleration at constant speed over the crank pin's, b/(r omega^2).

    Positive towards bottom dead centre. Parameters and errors as `position`. docs/method.md (10);
    Kakaitsas (2015), eq. 1.8; Mosakowski, eq. 3 (opposite sign there).

    Examples
    --------
    >>> import engine_dyn
    >>> import numpy as np
    >>> engine_dyn.acceleration(np.radians([0, 90, 180]), 0.25).round(4)
    array([ 1.25  , -0.2582, -0.75  ])
    """
    ratio, offset_ratio, sine, cosine, root = _crank(phi, crank_ratio, offset)
    s2 = sine * sine  # two products take a tenth of the time of a fourth power
    bracket = cosine * cosine - s2 + ratio**2 * (s2 * s2)
    if offset_ratio.any():
        # The bracket is cos^2 - u sin (1 - lambda^2 u^2) with u = sin - e/r: the offset adds this.
        bracket = bracket + offset_ratio * sine * (
            1.0 - ratio**2 * (3.0 * s2 - offset_ratio * (3.0 * sine - offset_ratio))
        )
    return cosine + ratio * bracket / (root * root * root)


def rod_angle(phi: npt.ArrayLike, crank_ratio: npt.ArrayLike, offset: npt.ArrayLike = 0.0) -> Any:
    """Angle beta of the connecting rod to the cylinder axis [rad].

    Positive while the big end stands on the side on which the crank pin goes down:
    sin(beta) = lambda (sin(theta) - e/r), docs/method.md (2). Parameters and errors as `position`.
    Kakaitsas (2015), eq. 1.3.

    Examples
    --------
    >>> import engine_dyn
    >>> import numpy as np
    >>> np.degrees(engine_dyn.rod_angle(np.radians([0, 90, 180]), 0.25)).round(2)
    array([ 0.  , 14.48,  0.  ])
    """
    ratio, offset, sine, _, _ = _crank(phi, crank_ratio, offset)
    return np.arcsin(ratio * (sine - offset))


def angle_of_travel(
    travel: npt.ArrayLike, down: npt.ArrayLike, crank_ratio: npt.ArrayLike,
    offset: npt.ArrayLike = 0.0,
) -> Any:  # fmt: skip
    """Crank angle at which the piston has a travel: the inverse of `position`, exact.

    Parameters
    ----------
    travel : array_like
        Travel from top dead centre over the crank radius, x/r, from 0 to the stroke over r.
    down : array_like of bool
        Whether the piston moves towards bottom dead centre: each travel has one angle in either
        stroke.
    crank_ratio, offset : array_like
        As of `position`; all four broadcast.

    Returns
    -------
    numpy.ndarray or numpy.float64
        Crank angle [rad]: from 0 to bottom dead centre where the piston moves down, from the bottom
        dead centre before (below 0) to 0 where it moves up.

    Raises
    ------
    ValueError
        As `position`, and for a travel outside the stroke.

    Notes
    -----
    With the pin at (E, y), all over r, its distance d from the crank's axis closes a triangle with
    crank and rod. The law of cosines gives the angle gamma at the axis, cos(gamma) = (1 + d^2 -
    1/lambda^2)/(2 d), here by its half, tan^2(gamma/2) = (1/lambda + 1 - d)(1/lambda + d - 1)/((d +
    1 - 1/lambda)(d + 1 + 1/lambda)). The first factors of both products vanish at the dead centres
    and follow from the travel without differences of nearly equal numbers. The crank stands at
    gamma to one side of the pin or the other. docs/method.md (2) and (3), inverted.

    Examples
    --------
    >>> bool(abs(angle_of_travel(position(1.0, 0.25), True, 0.25) - 1.0) < 1e-15)
    True
    """
    x, ratio, apart = _checked(travel, crank_ratio, offset)
    rod = 1.0 / ratio
    top, bottom = (np.sqrt((rod + one) ** 2 - apart**2) for one in (1.0, -1.0))
    stroke = 2.0 * np.asarray(dead_centres(ratio, apart).stroke)
    outside = ~((x >= 0.0) & (x <= stroke))
    if np.any(outside):
        bad = np.broadcast_to(x, outside.shape)[outside].flat[0]
        most = np.broadcast_to(stroke, outside.shape)[outside].flat[0]
        raise ValueError(f"travel = {bad:g} crank radii: must be from 0 to the stroke, {most:g}")
    rest = stroke - x
    distance = np.hypot(apart, top - x)
    near = x * (2.0 * top - x) / (rod + 1.0 + distance)
    far = rest * (2.0 * bottom + rest) / (distance + rod - 1.0)
    gamma = 2.0 * np.arctan2(
        np.sqrt(near * (rod + distance - 1.0)), np.sqrt(far * (distance + 1.0 + rod))
    )
    # Angle by which the line from the crank's axis to the pin has turned since top dead centre.
    lean = np.arctan2(apart * x, (top - x) * top + apart**2)
    return lean + np.where(down, gamma, -gamma)


class DeadCentres(NamedTuple):
    """Where the piston turns back."""

    # Angle of the crank to the cylinder axis at top dead centre [rad], theta_T; positive for a
    # positive offset. The engine's angle phi is 0 there.
    top: Any
    # Engine's angle phi at bottom dead centre [rad], from top dead centre on; pi without offset,
    # more with a positive one.
    bottom: Any
    stroke: Any  # Stroke over two crank radii [1]; 1 without offset, more with any


def dead_centres(crank_ratio: npt.ArrayLike, offset: npt.ArrayLike = 0.0) -> DeadCentres:
    """Dead centres and stroke of a slider-crank with offset. Parameters and errors as `position`.

    docs/method.md (4) and (6).

    Examples
    --------
    >>> centres = dead_centres(0.25, 0.4)
    >>> round(float(np.degrees(centres.bottom)), 3), round(float(centres.stroke), 6)
    (183.074, 1.00538)
    """
    _, ratio, offset_ratio = _checked(0.0, crank_ratio, offset)
    reduced = ratio * offset_ratio
    top = np.arcsin(reduced / (1.0 + ratio))
    folded = np.arcsin(reduced / (1.0 - ratio))
    # The stroke, a difference of two roots, is multiplied and divided by their sum: docs/method.md
    # (6).
    far, near = (1.0 + ratio) ** 2 - reduced**2, (1.0 - ratio) ** 2 - reduced**2
    return DeadCentres(top, np.pi + (folded - top), 2.0 / (np.sqrt(far) + np.sqrt(near)))


def crank_radius(stroke: npt.ArrayLike, rod_length: npt.ArrayLike, offset: npt.ArrayLike) -> Any:
    """Crank radius [m] that gives a stroke [m] with a rod of `rod_length` and an offset e, all [m].

    docs/method.md (13): the stroke of `dead_centres`, squared twice, gives
    r^2 = (s/2)^2 (1 - e^2/(l^2 - (s/2)^2)).

    Raises
    ------
    ValueError
        If half the stroke is not above 0 and below the rod's length, or the crank cannot turn.
    """
    half = 0.5 * np.asarray(stroke, dtype=float)
    rod, beside = np.asarray(rod_length, dtype=float), np.asarray(offset, dtype=float)
    wrong = ~((half > 0.0) & (half < rod))
    if wrong.any():
        bad = 2.0 * np.broadcast_to(half, wrong.shape)[wrong].flat[0]
        raise ValueError(f"stroke = {bad:g} m: must lie between 0 and twice the rod's length")
    # The crank turns if |e| + r < l; with the radius r that is returned, if |e| < l - (s/2)^2/l.
    wrong = ~(np.abs(beside) < rod - half**2 / rod)
    if wrong.any():
        bad = np.broadcast_to(beside, wrong.shape)[wrong].flat[0]
        most = np.broadcast_to(rod - half**2 / rod, wrong.shape)[wrong].flat[0]
        raise ValueError(
            f"offset = {bad:g} m: the crank cannot turn; must be below {most:g} m with this stroke "
            "and rod"
        )
    return half * np.sqrt(1.0 - beside**2 / (rod**2 - half**2))


def crank_radius_of_ratio(
    stroke: npt.ArrayLike, crank_ratio: npt.ArrayLike, offset: npt.ArrayLike
) -> Any:
    """Crank radius [m] that gives a stroke [m] with a crank ratio lambda and an offset e [m].

    docs/method.md (14): the equation of `crank_radius` with l = r/lambda is quadratic in r^2.
    Without offset the radius is half the stroke, bit for bit.

    Raises
    ------
    ValueError
        If a crank ratio lies outside (0, 1), or the crank cannot turn.
    """
    half, beside = 0.5 * np.asarray(stroke, dtype=float), np.asarray(offset, dtype=float)
    ratio = given_array("crank_ratio", crank_ratio)
    reduced = (beside / half) ** 2
    gap = (1.0 - ratio**2) ** 2 - 4.0 * ratio**2 * reduced
    square = 0.5 * (1.0 + ratio**2 + np.sqrt(np.maximum(gap, 0.0)))
    radius = np.where(beside == 0.0, half, half * np.sqrt(square))
    wrong = ~((gap >= 0.0) & (ratio * (radius + np.abs(beside)) < radius))
    if wrong.any():
        bad = np.broadcast_to(beside, wrong.shape)[wrong].flat[0]
        raise ValueError(
            f"offset = {bad:g} m: the crank cannot turn; offset and crank radius must together be "
            "below the rod's length"
        )
    return radius[()]


# Formulas for kernels: tables give sine and cosine, and crank ratios are checked before.


@inlined
def position_at(sine: float, cosine: float, crank_ratio: float) -> float:
    """Return x/r, docs/method.md (8); for cos(phi) near 1 the caller accepts rounding of 1e-16."""
    root = math.sqrt(1.0 - crank_ratio * crank_ratio * sine * sine)
    return (1.0 - cosine) + crank_ratio * sine * sine / (1.0 + root)


@inlined
def velocity_at(sine: float, cosine: float, crank_ratio: float) -> float:
    """Return c/(r omega), docs/method.md (9)."""
    root = math.sqrt(1.0 - crank_ratio * crank_ratio * sine * sine)
    return sine * (1.0 + crank_ratio * cosine / root)


# Formulas with an offset. Tables hold sine and cosine of the engine's angle phi; the crank's angle
# to the cylinder, theta, is larger by theta_T. A kernel computes sine and cosine of theta once for
# each point and uses them in all formulas.


@inlined
def sine_of_top(crank_ratio: float, offset: float) -> float:
    """Sine of the crank's angle to the cylinder axis at top dead centre, docs/method.md (4)."""
    return crank_ratio * offset / (1.0 + crank_ratio)


@inlined
def sum_of_angles(
    sine: float, cosine: float, top_sine: float, top_cosine: float
) -> tuple[float, float]:
    """Sine and cosine of theta from those of phi and of theta_T, docs/method.md (5)."""
    return sine * top_cosine + cosine * top_sine, cosine * top_cosine - sine * top_sine


@inlined
def offset_position_at(
    sine: float, cosine: float, crank_ratio: float, offset: float, versine: float, top_cosine: float
) -> float:
    """Return x/r with an offset, from sine and cosine of theta, docs/method.md (7).

    `versine` is 1 - cos(phi).
    """
    lean = crank_ratio * (sine - offset)
    height = (1.0 + crank_ratio) * top_cosine - crank_ratio * cosine + math.sqrt(1.0 - lean * lean)
    return 2.0 * (1.0 + crank_ratio) * versine / height


@inlined
def offset_velocity_at(sine: float, cosine: float, crank_ratio: float, offset: float) -> float:
    """Return c/(r omega) with an offset, from sine and cosine of theta, docs/method.md (9)."""
    lean = crank_ratio * (sine - offset)
    return sine + lean * cosine / math.sqrt(1.0 - lean * lean)


@inlined
def offset_acceleration_at(sine: float, cosine: float, crank_ratio: float, offset: float) -> float:
    """Return b/(r omega^2) with an offset, from sine and cosine of theta, docs/method.md (10)."""
    lean = crank_ratio * (sine - offset)
    square = 1.0 - lean * lean
    bracket = crank_ratio * cosine * cosine - lean * sine * square
    return cosine + bracket / (square * math.sqrt(square))


def clearance_volume(swept_volume: Any, compression_ratio: Any) -> Any:
    """Smallest volume of a cylinder, V_h/(epsilon - 1), in the unit of the swept volume.

    The compression ratio epsilon is the largest over the smallest volume [1]; both broadcast.
    """
    return swept_volume / (compression_ratio - 1.0)


def cylinder_volume(travel: Any, area: Any, stroke: Any, compression_ratio: Any) -> Any:
    """Volume above the piston [m3]: V_h/(epsilon - 1) + A x, docs/method.md (121).

    Parameters
    ----------
    travel : array_like
        Travel x of the piston from top dead centre [m].
    area : array_like
        Area A of the piston [m2].
    stroke : array_like
        Stroke s [m]; the swept volume V_h is A s.
    compression_ratio : array_like
        Largest over smallest volume [1]. All broadcast.

    Examples
    --------
    >>> round(cylinder_volume(0.18, 0.01, 0.18, 10.0), 6)  # at bottom dead centre: 10/9 A s
    0.002
    """
    return clearance_volume(area * stroke, compression_ratio) + area * travel
