"""Sobol' indices of the results of an archive: shares of their variance by parameters.

The first-order index of a parameter is the share of the variance that goes when the parameter is
known, the total index the share that stays when all others are known: I. M. Sobol' (1993), Homma
and Saltelli (1996). What can be told depends on how the designs were chosen:

====================  =============================================================================
designs               indices
====================  =============================================================================
`[sample]`, saltelli  first and total ones with confidence (Saltelli et al. 2010, SALib); a group
                      in which a design failed is dropped
a grid                first and total ones of the grid itself, exact: its values are taken as
                      equally likely, and no design may have failed
any other list        first ones with confidence, from the data alone (RBD-FAST: Tarantola et al.
                      2006, Plischke 2010, SALib); also Saltelli's design where more than 1 % failed
a scene with          those that were reduced from Saltelli's design as it was computed, with
`[reduce]`            confidence (`sweeps.running.reduce.indices`)
====================  =============================================================================
"""

from __future__ import annotations

import json
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from engine_dyn.status import MEANINGS, WITH_NUMBERS
from engine_dyn.types import Booleans, Floats
from sweeps.base.arguments import check_dataset, names_given
from sweeps.base.dimensions import DESIGN, LABELS, OUTCOMES, PARAMETER, REDUCTION
from sweeps.base.errors import SceneError, counted, shown
from sweeps.base.files.libraries import library
from sweeps.base.naming import made_from, meaning_of
from sweeps.decide.explore.attributes import members_of
from sweeps.decide.explore.columns import chosen_quantities
from sweeps.running.compute.progress import progress_bar
from sweeps.running.reduce.indices import (
    CONFIDENCE,
    FIRST,
    FIRST_CONFIDENCE,
    MOST_FAILED,
    NAMES,
    TOTAL,
    TOTAL_CONFIDENCE,
)
from sweeps.scene.sample import SEARCH, parameters_of

if TYPE_CHECKING:
    import xarray as xr

MOST_ROWS = 100_000  # Largest number of designs from which RBD-FAST estimates indices

LEAST_ROWS = 128  # Smallest number of designs from which RBD-FAST estimates indices

SALTELLI, GRID, DATA, REDUCED = "saltelli", "grid", "data", "reduced"


Indices = dict[str, Floats]  # Indices over the parameters, by the keys of `NAMES`


@dataclass(frozen=True)
class _Study:
    """How the designs of an archive were chosen."""

    # Values of the varied parameters, by key: of each design, or along each axis of a grid.
    parameters: Mapping[str, npt.NDArray[Any]]
    dims: tuple[str, ...]  # Dimensions over which the variance is taken
    group: int = 0  # Number of designs in a group of Saltelli's design; 0 for other samples


class _TooFew(SceneError):
    """There are too few designs with numbers."""


def sensitivities(
    archive: xr.Dataset, quantities: str | Sequence[str] | None = None, *,
    confidence: float = 0.95, resamples: int = 100, seed: int = 1, progress: bool = False,
) -> xr.Dataset:  # fmt: skip
    """Sobol' indices: which share of the variance of a result is due to which parameter.

    Parameters
    ----------
    archive : Dataset
        As `sweeps.open` or `sweeps.run` returns it: of a scene with `[sample]` (``method =
        "saltelli"`` gives the most), of a table of designs, or a grid. With `[reduce]` it holds
        the indices of ``method = "saltelli"`` itself, which are returned.
    quantities : str or sequence of str, optional
        If not given, all that have one number for each design.
    confidence : float
        Of the intervals, from bootstrap samples; with `[reduce]` they are of 0.95, by the
        jackknife.
    resamples : int
        Number of these.
    seed : int
        Of their random numbers.
    progress : bool
        Show a progress bar on the terminal.

    Returns
    -------
    Dataset
        For each quantity `<quantity>_first` and `<quantity>_total`, with `_confidence` (half widths
        of the intervals), over `parameter` and the axes beside the sample; there are no total
        indices from data alone. `<quantity>_left_out` counts the designs without a number. Where
        these are more than 1 % the names end in `_conditional`: indices of the designs that
        succeeded.

    Raises
    ------
    SceneError
        In one line: for archives in which nothing varies, with too few designs, or that are a part
        of a sample; for quantities that are curves; for archives of `[reduce]` without indices, and
        another confidence than theirs. Where SALib is missing (extra `study`).

    Examples
    --------
    >>> import sweeps
    >>> archive = sweeps.run(
    ...     engine="ntua",
    ...     axes={"inertia": [2, 4, 8], "speed": [1200, 1300], "bore": [0.139, 0.141]},
    ...     output={"quantities": ["delta"]},
    ... )
    >>> indices = sweeps.sensitivities(archive, "delta")
    >>> str(indices.parameter.values[indices.delta_total.values.argmax()])
    'inertia'
    """
    import xarray as xr

    check_dataset(archive)
    if not 0.0 < confidence < 1.0:
        raise SceneError(f"confidence = {shown(confidence)}: must be a number between 0 and 1")
    if isinstance(resamples, bool) or not isinstance(resamples, int) or resamples < 2:
        raise SceneError(f"resamples = {shown(resamples)}: must be a whole number, 2 or more")
    if "sensitivity_method" in archive.attrs:
        raise SceneError(
            "archive: holds Sobol' indices already; `engine-dyn show` prints them. Must be the "
            "archive of the designs"
        )
    if REDUCTION in archive.attrs:
        return _reduced(archive, quantities, confidence)
    study = _study_of(archive)
    asked = chosen_quantities(archive, quantities)
    names = [n for n in asked if n not in OUTCOMES and set(study.dims) & set(archive[n].dims)]
    missing = [n for n in asked if n not in names] if quantities is not None else []
    if missing or not names:
        what = missing[0] if missing else "no quantity"
        raise SceneError(f"{what}: does not vary with any of {', '.join(study.parameters)}")
    settings = {"num_resamples": resamples, "conf_level": confidence, "seed": seed}
    indices: dict[str, Any] = {}
    methods: dict[str, str] = {}
    with progress_bar(total=len(names), unit=" quantities", disable=not progress) as bar:
        for name in names:
            bar.set_description(name)
            variables, methods[name] = _of_quantity(archive, name, study, settings)
            indices |= variables
            bar.update()
    rest = {d for v in indices.values() for d in v[0]} - {PARAMETER}
    dataset = xr.Dataset(indices, coords={d: archive[d] for d in rest if d in archive.coords})
    keys = [*study.parameters]
    meanings = [meaning_of(archive[key].attrs, key) for key in keys]
    dataset = dataset.assign_coords(
        {
            PARAMETER: (PARAMETER, np.array(keys, dtype=object)),
            f"{PARAMETER}_long_name": (PARAMETER, np.array(meanings, dtype=object)),
        }
    )
    return _titled(dataset, archive, methods, confidence)


def _titled(
    dataset: xr.Dataset, archive: xr.Dataset, methods: Mapping[str, str], confidence: float
) -> xr.Dataset:
    """Indices with attributes that say which results they belong to."""
    kept = ("engine", "engine_title", "title", "scene", "warnings")
    dataset.attrs = {key: archive.attrs[key] for key in kept if key in archive.attrs}
    dataset.attrs["title"] = f"Sobol' indices: {archive.attrs.get('title', '')}".strip(": ")
    titles = {
        SALTELLI: "Saltelli's design (Saltelli et al. 2010, by SALib)",
        GRID: "variances over the grid, all its values equally likely",
        DATA: "from the data alone with RBD-FAST (Tarantola et al. 2006, Plischke 2010, by SALib)",
        REDUCED: "Saltelli's design (Saltelli et al. 2010), reduced; intervals by the jackknife",
    }
    dataset.attrs["sensitivity_method"] = json.dumps({n: titles[m] for n, m in methods.items()})
    dataset.attrs["confidence"] = confidence
    return dataset


def _reduced(
    archive: xr.Dataset, quantities: str | Sequence[str] | None, confidence: float
) -> xr.Dataset:
    """Indices that an archive of [reduce] holds; it keeps only some of the designs."""
    known = [*members_of(archive, REDUCTION).get("indices", {})]
    asked = known if quantities is None else names_given(quantities, "quantities")
    missing = [name for name in asked if name not in known]
    if missing or not asked:
        what = f"{shown(missing[0])}: the archive" if missing else "the archive"
        raise SceneError(
            f"{what} holds no Sobol' indices; with [reduce], these are computed for its statistics "
            "if [sample] has method = 'saltelli' and no other axis is in [reduce] over"
        )
    if confidence != CONFIDENCE:
        raise SceneError(
            f"confidence = {shown(confidence)}: must be {CONFIDENCE}, that of the intervals which "
            "the archive holds"
        )
    piece = members_of(archive, "part")
    if "shard" in piece:
        raise SceneError(
            f"shard {piece['shard']} of a sample: Saltelli's design must be complete; merge its "
            "shards"
        )
    ends = ("left_out", *(f"{key}{end}" for key in NAMES for end in ("", "_conditional")))
    names = [f"{name}_{end}" for name in asked for end in ends]
    indices = archive[[name for name in names if name in archive]].load()
    return _titled(indices, archive, dict.fromkeys(asked, REDUCED), CONFIDENCE)


def _study_of(archive: xr.Dataset) -> _Study:
    """How the designs of an archive were chosen."""
    scene = members_of(archive, "scene")
    sample = scene.get("sample")
    if sample and sample.get("method") == SEARCH:
        raise SceneError(
            "the designs were found by a search, which favours good designs, so shares of a "
            "variance cannot be computed; draw a sample for that"
        )
    if DESIGN not in archive.dims:
        axes = [str(d) for d in archive.dims if d in archive.coords and archive.sizes[d] > 1]
        grid = {d: archive[d].values for d in axes if d in scene.get("axes", {d: None})}
        if not grid:
            raise SceneError("nothing varies; an archive with a sample or with axes is needed")
        return _Study(grid, tuple(grid))
    given = parameters_of(sample) if sample else [
        str(n) for n, c in archive.coords.items()
        if c.dims == (DESIGN,) and n not in (DESIGN, *LABELS)
    ]  # fmt: skip
    columns = {key: archive[key].values for key in given if key in archive.coords}
    varying = {key: values for key, values in columns.items() if len(np.unique(values)) > 1}
    if not varying:
        raise SceneError("nothing varies along the designs")
    group = 0
    if sample and sample.get("method") == "saltelli":
        group = len(columns) + 2
        expected = group * int(sample["number"])
        if archive.sizes[DESIGN] != expected:
            raise SceneError(
                f"{counted(archive.sizes[DESIGN], 'design')} of a sample of {expected}: "
                "Saltelli's design must be complete; merge its shards"
            )
        varying = columns
    return _Study(varying, (DESIGN,), group)


def _of_quantity(
    archive: xr.Dataset, name: str, study: _Study, settings: Mapping[str, Any]
) -> tuple[dict[str, Any], str]:
    """Indices of one quantity, and the method that gave them."""
    array = archive[name]
    dims = [d for d in study.dims if d in array.dims]
    rest = [str(d) for d in array.dims if d not in dims]
    shape = [archive.sizes[d] for d in rest]
    values = array.transpose(*rest, *dims).values.astype(float)
    good = np.isfinite(values)
    if "status" in archive and set(archive["status"].dims) <= set(array.dims):
        outcome = archive["status"].broadcast_like(array).transpose(*rest, *dims).values
        good &= np.isin(outcome, WITH_NUMBERS)
    inner = [archive.sizes[d] for d in dims]
    values, good = values.reshape(-1, *inner), good.reshape(-1, *inner)
    failed = 1.0 - good.reshape(len(good), -1).mean(axis=1).min()
    method = GRID if study.dims != (DESIGN,) else SALTELLI if study.group else DATA
    if method == GRID and failed:
        raise SceneError(
            f"{name}: {counted(int((~good).sum()), 'design')} of the grid without a number; "
            "indices of a grid need results for all designs (indices of a sample do not)"
        )
    conditional = failed > MOST_FAILED and method != GRID
    if conditional:
        method = DATA
    try:
        if method == GRID:
            each = [_of_grid(one, [*study.parameters], dims) for one in values]
        else:
            make = _of_groups if method == SALTELLI else _of_data
            each = [make(v, g, study, settings) for v, g in zip(values, good, strict=True)]
    except _TooFew as error:
        raise SceneError(f"{name}: {error}{_outcomes(archive)}") from None
    ending = "_conditional" if conditional else ""
    said = ", only designs with results" if conditional else ""
    label = {"long_name": name, **array.attrs}
    indices: dict[str, Any] = {
        f"{name}_{key}{ending}": (
            (*rest, PARAMETER),
            np.reshape([one[key] for one in each], (*shape, len(study.parameters))),
            made_from(label, f"{NAMES[key]} of the {{}}{said}"),
        )
        for key in each[0]
    }
    indices[f"{name}_left_out"] = (
        tuple(rest),
        (~good).reshape(len(good), -1).sum(axis=1).reshape(shape).astype(np.int64),
        made_from(label, "designs without a number of the {}"),
    )
    return indices, method


def _outcomes(archive: xr.Dataset) -> str:
    """Counts of outcomes, as an addition to a message; empty without a status."""
    if "status" not in archive:
        return ""
    codes = archive["status"].values.reshape(-1).astype(np.int64)
    counts = np.bincount(codes, minlength=len(MEANINGS))
    listed = ", ".join(f"{MEANINGS[i]} {counts[i]}" for i in np.flatnonzero(counts))
    return f"; outcomes of {counted(codes.size, 'design')}: {listed}"


def _of_grid(values: Floats, parameters: Sequence[str], dims: Sequence[str]) -> Indices:
    """Indices of a grid: variances of means along its axes."""
    every = tuple(range(values.ndim))
    whole = values.var()
    first, total = np.zeros(len(parameters)), np.zeros(len(parameters))
    for place, key in enumerate(parameters):
        if key not in dims or whole == 0.0:
            continue
        own = dims.index(key)
        first[place] = values.mean(axis=tuple(a for a in every if a != own)).var() / whole
        total[place] = 1.0 - values.mean(axis=own).var() / whole
    return {FIRST: first, TOTAL: total}


def _of_groups(
    values: Floats, good: Booleans, study: _Study, settings: Mapping[str, Any]
) -> Indices:
    """Indices of Saltelli's design; groups in which a design failed are dropped."""
    sobol = library("SALib.analyze.sobol", "SALib", "sensitivities", extra="study")
    whole = good.reshape(-1, study.group).all(axis=1)
    kept = values.reshape(-1, study.group)[whole].reshape(-1)
    theirs = {FIRST: "S1", FIRST_CONFIDENCE: "S1_conf", TOTAL: "ST", TOTAL_CONFIDENCE: "ST_conf"}
    if kept.std() == 0.0:
        return {key: np.zeros(len(study.parameters)) for key in theirs}
    indices = sobol.analyze(
        _problem(study), kept, calc_second_order=False, print_to_console=False, **settings
    )
    return {key: np.asarray(indices[name]) for key, name in theirs.items()}


def _of_data(values: Floats, good: Booleans, study: _Study, settings: Mapping[str, Any]) -> Indices:
    """First-order indices from designs that were chosen in any way."""
    rbd_fast = library("SALib.analyze.rbd_fast", "SALib", "sensitivities", extra="study")
    if study.group:  # Only the first and last designs of a group were drawn independently
        place = np.arange(good.size) % study.group
        good = good & ((place == 0) | (place == study.group - 1))
    places = np.flatnonzero(good)
    if places.size < LEAST_ROWS:
        raise _TooFew(
            f"{counted(int(places.size), 'design')} with numbers: too few for indices; must be at "
            f"least {LEAST_ROWS}"
        )
    places = places[:MOST_ROWS]
    # RBD-FAST takes numbers, so words are numbered in alphabetical order.
    columns = [np.unique(v[places], return_inverse=True)[1] if v.dtype.kind not in "iuf"
               else v[places] for v in study.parameters.values()]  # fmt: skip
    chosen = values[places]
    if chosen.std() == 0.0:
        return {key: np.zeros(len(columns)) for key in (FIRST, FIRST_CONFIDENCE)}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        indices = rbd_fast.analyze(
            _problem(study), np.column_stack(columns).astype(float), chosen, **settings
        )
    return {FIRST: np.asarray(indices["S1"]), FIRST_CONFIDENCE: np.asarray(indices["S1_conf"])}


def _problem(study: _Study) -> dict[str, Any]:
    """Parameters as SALib wants them; it takes no bounds from here."""
    names = [*study.parameters]
    return {"num_vars": len(names), "names": names, "bounds": [[0.0, 1.0]] * len(names)}
