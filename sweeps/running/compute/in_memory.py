"""A plan is computed into arrays, and a scene into a dataset."""

from __future__ import annotations

import time
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Unpack

import numpy as np
import numpy.typing as npt

from engine_dyn.plausibility.judgement import ImplausibleWarning
from sweeps.base.arguments import thread_count, usable_device
from sweeps.running.compute.computation import Computation
from sweeps.scene.keywords import Tables, tables_in_signature
from sweeps.scene.model import Scene
from sweeps.scene.plan.blocks import blocks, index_of, lengths_in_memory, shape_in
from sweeps.scene.plan.plan import Plan, make_plan
from sweeps.scene.reading import read_scene

if TYPE_CHECKING:
    import xarray as xr


@tables_in_signature
def run(
    scene: str | Path | Mapping[str, Any] | Scene | None = None,
    *,
    progress: bool = False,
    threads: int | None = None,
    device: str = "cpu",
    **tables: Unpack[Tables],
) -> xr.Dataset:
    """Run a scene and return its results as a labelled dataset.

    Parameters
    ----------
    scene : str, Path, dict or Scene, optional
        Path of a scene file, name of a built-in scene, dict of the same shape, or a Scene.
    progress : bool
        Show a progress bar on the terminal for runs of more than a second.
    threads : int, optional
        As many as the machine has processors, unless given.
    device : str
        "cpu", or "cuda": an NVIDIA card solves what it can (docs/large_sweeps.md).
    **tables
        Tables of a scene as keywords: `engine`, `set`, `axes`, `designs`, `output` and so on, in
        place of `scene` or replacing tables of it; see `sweeps.read_scene`.

    Returns
    -------
    xarray.Dataset
        One variable for each quantity, on the axes that it depends on, in the units of
        `engine-dyn list quantities`; `status` beside everything that can fail.

    Raises
    ------
    SceneError
        One line, for a scene that cannot be run: see `read_scene`; also one larger than memory, and
        a device that cannot be used.

    Warns
    -----
    engine_dyn.ImplausibleWarning
        One line for each measure that engines do not have, which often is in another unit. The
        lines are the attribute `warnings` of the dataset. The key `silenced_warnings` of the scene
        names those that are meant so (docs/plausibility.md).

    Examples
    --------
    >>> import sweeps
    >>> archive = sweeps.run(
    ...     engine="ntua",
    ...     set={"speed": 1500, "load": 90},
    ...     axes={"inertia": [2, 4]},
    ...     output={"quantities": ["delta"]},
    ... )
    >>> archive.delta.dims
    ('inertia',)
    >>> archive.delta.values.round(4)
    array([0.0814, 0.0405])
    """
    from sweeps.running.archive.labels import label
    from sweeps.running.archive.warnings import ATTRIBUTE

    threads, device = thread_count(threads), usable_device(device)
    plan = make_plan(read_scene(scene, **tables))
    if plan.scene.reduce is not None:
        from sweeps.running.compute.reduced import reduced

        dataset = reduced(plan, progress=progress, threads=threads, device=device)
    else:
        began = time.perf_counter()
        results = compute(plan, progress=progress, threads=threads, device=device)
        dataset = label(plan, results, seconds=time.perf_counter() - began)
    for line in dataset.attrs.get(ATTRIBUTE, "").splitlines():
        warnings.warn(line, ImplausibleWarning, stacklevel=2)
    return dataset


def compute(
    plan: Plan, *, progress: bool = False, threads: int | None = None, device: str = "cpu"
) -> dict[str, npt.NDArray[Any]]:
    """Arrays of the plan's outputs, in SI units, on the dimensions of their stages.

    No other array as large as an output exists at any time: see `sweeps.scene.plan.blocks`.

    Raises
    ------
    SceneError
        For a plan larger than memory.
    """
    results: dict[str, npt.NDArray[Any]] = {}
    lengths = lengths_in_memory(plan)
    with Computation(
        plan, lengths, progress=progress, threads=threads, device=device
    ) as computation:
        for block in blocks(plan, lengths):
            for name, values in computation.results(block).items():
                dims = plan.dims(name)
                shape = shape_in(plan, dims, {})
                if values.shape == shape:
                    results[name] = values
                    continue
                if name not in results:
                    results[name] = np.empty(shape, dtype=values.dtype)
                results[name][index_of(dims, block)] = values
    return {name: results[name] for name in plan.outputs}
