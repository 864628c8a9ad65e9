"""Names of `sweeps` as type checkers see them: `make types` reads this, and nothing runs it."""

from __future__ import annotations

from typing import assert_type

import xarray as xr

import sweeps


def known() -> None:
    """Types of results, and a keyword that there is not: an ignored error must be one."""
    assert_type(sweeps.run("first", axes={"inertia": range(2, 4)}), xr.Dataset)
    assert_type(sweeps.plan("first").designs, int)
    assert_type(sweeps.__version__, str)
    sweeps.run(engin="ntua")  # type: ignore[call-arg]
