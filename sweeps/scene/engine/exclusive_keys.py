"""Parameters that exclude each other because both give the same thing.

The table holds for [values] of engine files and for [set], [axes] and [designs] of scenes alike.
"""

from __future__ import annotations

import itertools
from collections.abc import Collection, Container

from engine_dyn.loads.laws import LOAD_LAWS
from engine_dyn.quantities.parameters import INERTIA_PARTS

__all__ = ["exclusive_pair", "replaced_by"]

_EXCLUSIVE: tuple[tuple[str, tuple[str, ...], str], ...] = (
    ("crank_ratio", ("rod_length",), "both determine the rod length; give one of them"),
    ("speed", ("largest_speed", "smallest_speed"), "the nominal speed follows; give one of them"),
    ("largest_speed", ("smallest_speed",), "each determines the nominal speed; give one of them"),
    (
        "wanted_delta",
        ("inertia", "flywheel_inertia"),
        "the inertia follows from the wanted delta; give one of them",
    ),
    (
        "counterweight_fraction",
        ("counterweight_mass",),
        "both determine the counterweights; give one of them",
    ),
    (
        "counterweights_factor",
        ("counterweight_fraction", "counterweight_mass"),
        "it is a factor on [[counterweights]], which they replace; give one of them",
    ),
    (
        "motor_slip",
        ("motor_synchronous_speed",),
        "both determine the motor's synchronous speed; give one of them",
    ),
    (
        "crank_mass",
        ("throw_mass", "throw_radius"),
        "both determine the mass of a crank throw at the crank radius; give one of them",
    ),
    (
        "synchronising_torque",
        ("synchronising_power",),
        "both determine the synchronising torque; give one of them",
    ),
    ("inertia", INERTIA_PARTS, "give the inertia as a whole or in parts"),
    *(
        (key, other.keys, "each defines the load over speed; give one law")
        for law, other in itertools.combinations(LOAD_LAWS.values(), 2)
        for key in law.keys
    ),
)
"""A key, those that it excludes, and the reason."""


def exclusive_pair(keys: Container[str]) -> tuple[str, str, str] | None:
    """Two of the keys that exclude each other, and the reason; None where there are none."""
    for first, others, reason in _EXCLUSIVE:
        second = next((key for key in others if key in keys), None)
        if first in keys and second is not None:
            return first, second, reason
    return None


def replaced_by(keys: Collection[str]) -> frozenset[str]:
    """Keys of an engine that count nowhere where a scene gives these: they exclude each other."""
    found: set[str] = set()
    for first, others, _ in _EXCLUSIVE:
        if first in keys:
            found.update(others)
        if not set(others).isdisjoint(keys):
            found.add(first)
    return frozenset(found - set(keys))
