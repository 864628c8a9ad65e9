"""The speed of the crankshaft while nothing repeats: load steps, governors, start and stop."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from engine_dyn.transient.api import Transients, follow_designs
    from engine_dyn.transient.limits import ISO_8528_5_G2, TransientLimits, kept
    from engine_dyn.transient.tables import TransientEngine, transient_engine

__all__ = [
    "ISO_8528_5_G2",
    "TransientEngine",
    "TransientLimits",
    "Transients",
    "follow_designs",
    "kept",
    "transient_engine",
]

_PLACES = {
    "api": {"Transients", "follow_designs"},
    "limits": {"ISO_8528_5_G2", "TransientLimits", "kept"},
    "tables": {"TransientEngine", "transient_engine"},
}


def __getattr__(name: str) -> Any:
    # These imports load the compiler, which nothing else of the package's users needs.
    for place, names in _PLACES.items():
        if name in names:
            from importlib import import_module

            return getattr(import_module(f"engine_dyn.transient.{place}"), name)
    raise AttributeError(f"module 'engine_dyn.transient' has no attribute {name!r}")
