"""Plans for people: all that a run would refuse is refused here, before anything is computed."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Unpack

from sweeps.running.compute.computation import check_given
from sweeps.scene.keywords import Tables, tables_in_signature
from sweeps.scene.model import Scene
from sweeps.scene.plan.plan import Plan, make_plan
from sweeps.scene.reading import read_scene

__all__ = ["plan"]


@tables_in_signature
def plan(
    scene: str | Path | Mapping[str, Any] | Scene | None = None, **tables: Unpack[Tables]
) -> Plan:
    """Plan a scene: what would be computed, on which axes; no design is solved.

    Parameters
    ----------
    scene : str, Path, dict or Scene, optional
        As `sweeps.run` takes it.
    **tables
        Tables of a scene; see `sweeps.read_scene`.

    Returns
    -------
    Plan
        Its stages and the axes that each depends on; a notebook shows them as a table. What
        `engine-dyn plan` tells of time and memory is `sweeps.scene.plan.forecast.text(plan)`.

    Raises
    ------
    SceneError
        As `sweeps.run`.

    Examples
    --------
    >>> import sweeps
    >>> sweeps.plan("first").designs
    75
    """
    made = make_plan(read_scene(scene, **tables))
    if made.scene.reduce is not None:
        from sweeps.running.reduce.reduction import Reduction  # which brings labels

        Reduction(made)  # checks conditions and searches
    check_given(made)
    return made
