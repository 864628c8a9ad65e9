"""Which equation the designs of a block have, told to the compiler.

All designs of a block have one form. What a form does not need is left out when a kernel is
compiled for it: Numba decides a condition on the length of a tuple that is an argument of the very
function, and compiles one side only. So a form is handed on as a tuple whose length is its number,
and is asked for by ``len(form) == LINEAR``.
"""

from __future__ import annotations

__all__ = [
    "ANY_POWER",
    "CONSTANT_INERTIA",
    "CONSTANT_LOAD",
    "FORM_OF_KIND",
    "ITERATED",
    "LINEAR",
    "OF_CONSTANT_INERTIA",
    "PROPORTIONAL",
    "RATIONAL",
    "SQUARE_ROOT",
    "VARIABLE_INERTIA",
    "Form",
    "Inertia",
    "form_of",
    "inertia_of",
]

Form = tuple[int, ...]
"""Tuple whose length is one of LINEAR to RATIONAL."""

Inertia = tuple[int, ...]
"""Tuple with the length CONSTANT_INERTIA or VARIABLE_INERTIA."""

LINEAR, CONSTANT_LOAD, SQUARE_ROOT, PROPORTIONAL, ANY_POWER, RATIONAL = 1, 2, 3, 4, 5, 6
"""Forms of an equation. LINEAR: exponent 2 with constant inertia, a linear equation with constant
coefficients. CONSTANT_LOAD: exponent 0. SQUARE_ROOT: exponent 1, F = sqrt(q). PROPORTIONAL:
exponent 2 with variable inertia, F = q. ANY_POWER: any exponent. RATIONAL: a law that is a
rational function of the speed, see `rational`."""

ITERATED = SQUARE_ROOT
"""The forms from this one on have a nonlinear remainder, which is iterated."""

CONSTANT_INERTIA, VARIABLE_INERTIA = 1, 2
"""Whether the inertia of the engine is constant or varies over the crank angle."""

FORM_OF_KIND = (CONSTANT_LOAD, SQUARE_ROOT, PROPORTIONAL, ANY_POWER, RATIONAL, RATIONAL)
"""Form for each kind of law (see `engine_dyn.speed.arguments.Choice`) that the solver knows."""

OF_CONSTANT_INERTIA: Inertia = (0,) * CONSTANT_INERTIA


def form_of(kind: int, variable: bool) -> Form:
    """Form of the designs with one kind of law and one inertia model."""
    form = FORM_OF_KIND[kind]
    return (0,) * (LINEAR if form == PROPORTIONAL and not variable else form)


def inertia_of(variable: bool) -> Inertia:
    """What tells the compiler the inertia model."""
    return (0,) * (VARIABLE_INERTIA if variable else CONSTANT_INERTIA)
