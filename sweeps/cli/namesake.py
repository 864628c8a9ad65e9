"""The package index has another package that installs a module `sweeps`; it shows at the start."""

from __future__ import annotations

import importlib.metadata
import sys

__all__ = ["replaced", "replacing"]

NAMESAKE = "sweeps"
"""Name in the package index, of Weights & Biases."""

_PAGE = "see 'Another package named sweeps' on the page 'Install'"


def replaced() -> str:
    """One line where `import sweeps` gives another package's module, or none; otherwise empty."""
    module = sys.modules["sweeps"]  # not imported: this file would depend on all that it names
    if "read_scene" in getattr(module, "__all__", ()):
        return ""
    what = f"another package's, {module.__file__}" if module.__file__ else "gone"
    return (
        f"engine-dyn's module sweeps is {what}: packages '{NAMESAKE}' and 'engine-dyn' exclude "
        f"each other. Run: pip uninstall {NAMESAKE}, then install engine-dyn with "
        f"--force-reinstall; {_PAGE}"
    )


def replacing() -> str:
    """One line where this package has replaced the module of the other one; otherwise empty."""
    try:
        other = importlib.metadata.distribution(NAMESAKE)
    except importlib.metadata.PackageNotFoundError:
        return ""
    return (
        f"package '{NAMESAKE}' {other.version} is installed beside engine-dyn, and both install a "
        "module sweeps: that package no longer works here, and uninstalling it breaks engine-dyn; "
        f"{_PAGE}"
    )
