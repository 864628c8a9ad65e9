"""Designs are found in archives: the best under conditions, and the Pareto front.

An archive is read a range at a time: it may be larger than memory.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from sweeps.base.arguments import check_dataset, names_given
from sweeps.base.dimensions import DESIGN, RANK, REDUCTION
from sweeps.base.errors import SceneError, shown
from sweeps.running.reduce.every_point import KEPT, TEXT, EveryPoint
from sweeps.running.reduce.searches import Front
from sweeps.scene.conditions import Constraint, conditions_of, units_of

if TYPE_CHECKING:
    import xarray as xr


def kept_for(
    archive: xr.Dataset, wanted: Sequence[tuple[str, float]], conditions: Sequence[Constraint],
    at_every: str | Sequence[str], *, front: bool,
) -> tuple[xr.Dataset, str]:  # fmt: skip
    """Designs that answer a search, and what was found when they were kept.

    An archive that holds all designs comes back as it is, with an empty text. SceneError refuses a
    reduced archive that kept no designs that answer it.
    """
    if REDUCTION not in archive.attrs:
        return archive, ""
    about = json.loads(archive.attrs[REDUCTION])
    axes = names_given(at_every, "at_every")
    asked = {str(condition) for condition in conditions}
    units = units_of(archive)

    def exactly(kept: Mapping[str, Any]) -> bool:
        same = [tuple(pair) for pair in kept["wanted"]] == [*wanted]
        return same and asked == {*kept["within"]} and front == (kept["number"] == 0)

    # A front answers every limit of what it optimises, a list of the best those that one fulfils.
    places = range(len(about["kept"]))
    every = about["kept"]
    for number in sorted(places, key=lambda n: (not exactly(every[n]), every[n]["number"])):
        kept = every[number]
        exact = exactly(kept)
        known = conditions_of(kept["within"], units)
        if not (exact or (not front and _holds_best(kept, known, wanted[0], conditions))):
            continue
        if set(axes) != set(about["at_every"]):
            if not axes:
                raise SceneError(
                    f"{'front' if front else 'best'}: the archive was reduced, and kept this at "
                    f"every {' and '.join(about['at_every'])}: needs at_every "
                    f"{','.join(about['at_every'])}"
                )
            continue
        if not kept["found"]:
            raise SceneError(kept["text"])
        designs = _designs(archive, number)
        designs.attrs[KEPT] = (
            "; these are the designs that [reduce] kept, and not all" if kept["number"]
            else "; [reduce] kept all designs of the front, so that no other does"
        )  # fmt: skip
        return designs, kept["text"] if exact else ""
    name = "front" if front else "best"
    everywhere = f" at every {' and '.join(about['at_every'])}" if about["at_every"] else ""
    told = "; ".join(kept["asked"] + everywhere for kept in about["kept"]) or "no designs"
    raise SceneError(
        f"{name}: the archive was reduced, and kept {told}; another search needs a run whose "
        "[reduce] asks for it"
    )


def _holds_best(
    kept: Mapping[str, Any], known: Sequence[Constraint], wanted: tuple[str, float],
    asked: Sequence[Constraint],
) -> bool:  # fmt: skip
    """Whether the best design under conditions is among kept ones, if any of them fulfils these.

    Kept are the best in the same quantity under conditions that are not stricter than those asked
    for, or a front: of all designs within limits of what it optimises, one on the front is best.
    """
    if not all(any(_as_strict(one, other) for one in asked) for other in known):
        return False
    signs = {name: sign for name, sign in kept["wanted"]}
    if kept["number"]:
        return signs == dict([wanted])
    limits = [c for c in asked if not any(str(c) == str(other) for other in known)]
    return signs.get(wanted[0]) == wanted[1] and all(
        signs.get(c.name) == (1.0 if c.above else -1.0) for c in limits
    )


def _as_strict(one: Constraint, other: Constraint) -> bool:
    """Whether every value that fulfils one condition fulfils the other."""
    if one.name != other.name or one.above != other.above:
        return False
    if one.limit == other.limit:
        return one.sign == other.sign or "=" in other.sign
    return one.limit <= other.limit if one.above else one.limit >= other.limit


def _designs(archive: xr.Dataset, number: int) -> xr.Dataset:
    """Designs that a search kept, with their results alone."""
    places = np.flatnonzero(archive[RANK].values[number])
    results = [n for n, v in archive.data_vars.items() if DESIGN in v.dims and n != RANK]
    return archive[results].isel({DESIGN: places}).drop_vars("search", errors="ignore")


def best(
    archive: xr.Dataset, *, least: str | None = None, most: str | None = None,
    within: str | Sequence[str] = (), at_every: str | Sequence[str] = (),
    not_counted: str | Sequence[str] = (),
) -> xr.Dataset:  # fmt: skip
    """Find the design with the least, or most, of a quantity, under conditions.

    Parameters
    ----------
    archive : Dataset
        As `open` or `run` returns it; it may be larger than memory.
    least, most : str
        A quantity or an axis; one of the two.
    within : str or sequence of str
        Conditions such as "delta <= 1/150", "delta <= generator" or "brake_power >= 60 kW", all of
        which must hold. Without a unit, a number is in the unit of the archive, here W.
    at_every : str or sequence of str
        Axes at all values of which the conditions must hold, such as ["load", "speed"]. Where
        `least` depends on them, its largest value there counts, of `most` the smallest. A design
        works at all values of some axes (speed, load and others,
        `sweeps.base.dimensions.NOT_CHOSEN`), so that none is chosen with it: they must stand here,
        be cut before (`sweeps.nearest`), or be named by `least`, `most` or `within`. If the archive
        has no other axes, there is no design to choose, and the case with the least or the most is
        found: `most="inertia_required"` is the largest that any load and speed needs.
    not_counted : str or sequence of str
        Only with `at_every`: outcomes such as "no_steady_state" (of an engine at idle, say). Points
        that have one of them are left out; all others must fulfil the conditions.

    Returns
    -------
    Dataset
        The archive at that design; the first of several. Axes on which none of the names depends
        stay, and those of `at_every`. Designs that failed are not considered. With `at_every`, the
        attribute `search` tells how many designs fulfil the conditions, how many are equally good,
        and what was not counted.

    Raises
    ------
    SceneError
        For names that the archive does not have, and for curves (of a quantity with a value for
        each bearing, shaft or other part the worst one counts); where speed or load would be chosen
        with a design and are not named; and where no design fulfils the conditions: then it says
        how near the designs come.

    Examples
    --------
    >>> import sweeps
    >>> archive = sweeps.run(
    ...     engine="ntua",
    ...     axes={"inertia": [5, 20, 40], "load": [50, 90], "speed": [1200, 1500]},
    ...     output={"quantities": ["delta"]},
    ... )
    >>> found = sweeps.best(
    ...     archive, least="inertia", within="delta <= 1/50", at_every=["load", "speed"]
    ... )
    >>> float(found.inertia)
    20.0
    """
    return search_best(
        archive, least=least, most=most, within=within, at_every=at_every, not_counted=not_counted
    ).design


@dataclass(frozen=True, eq=False)
class Found:
    """What `best` has found, and how."""

    archive: xr.Dataset  # Designs that were searched; of a reduced archive those that it kept
    design: xr.Dataset  # The archive at the design, as `best` returns it
    place: Mapping[str, int]  # Its place along the dimensions that tell designs apart
    name: str  # Quantity or axis that is optimised
    least: bool  # Whether less of it is wanted
    conditions: Sequence[Constraint]
    at_every: Sequence[str]  # Axes at all values of which the design was judged
    told: str  # How many designs fulfil the conditions, and what was left out
    # Whether there was no design to choose: what was found is the case with the most or the least.
    cases: bool
    designs: int  # Number of designs, or of cases
    unsolved: int  # Number of those without a result

    @property
    def ranked(self) -> bool:
        """Whether all cases are compared, and the one with the most or the least was asked for."""
        return self.cases and not self.at_every and not self.conditions


def search_best(
    archive: xr.Dataset, *, least: str | None = None, most: str | None = None,
    within: str | Sequence[str] = (), at_every: str | Sequence[str] = (),
    not_counted: str | Sequence[str] = (),
) -> Found:  # fmt: skip
    """Find a design as `best` does, and say how it was found."""
    check_dataset(archive)
    if (least is None) == (most is None):
        raise SceneError(
            "best: least and most are both given; must be one of them (`pareto` in Python, and "
            "`optimise`, take several)" if least is not None
            else "best: needs least or most, with a quantity or an axis"
        )  # fmt: skip
    name, sign = (str(least), 1.0) if least is not None else (str(most), -1.0)
    conditions = conditions_of(within, units_of(archive))
    if not_counted and not at_every:
        raise SceneError("best: not_counted is only used with at_every; failed designs never count")
    archive, told = kept_for(archive, [(name, sign)], conditions, at_every, front=False)
    search = EveryPoint(archive, [(name, sign)], conditions, at_every, not_counted)
    best_place: dict[str, int] | None = None
    smallest, equal = math.inf, 0
    for place, designs in search.judged():
        if not designs.fulfilling.any():
            continue
        values = np.where(designs.fulfilling, designs.worst[0], math.inf)
        here = float(values.min())
        if here < smallest:
            smallest, equal = here, 0
            at = np.unravel_index(int(np.argmin(values)), values.shape)
            best_place = {
                d: int(i) + s.start for d, i, s in zip(search.own, at, place, strict=True)
            }
        if here == smallest:
            equal += int(np.count_nonzero(values == smallest))
    if best_place is None:
        raise SceneError(search.nothing() + archive.attrs.get(KEPT, ""))
    archive.attrs.pop(KEPT, None)
    best = archive.isel(best_place)
    told = told or search.text(equal)
    if at_every:
        best.attrs[TEXT] = told
    return Found(
        archive, best, best_place, name, sign > 0.0, conditions, search.asked, told, search.cases,
        search.designs, search.unsolved,
    )  # fmt: skip


INERTIAS = ("inertia", "flywheel_inertia")
"""Keys of which delta falls nearly in inverse proportion."""


def least_between(found: Found) -> tuple[float, float] | None:
    """Least inertia between the values of the grid that meets the limit of delta, and its error.

    None where nothing is known: where something else than inertia was asked for or something else
    in the question changes with it, where no lighter design is in the archive, or has no result.

    At each point the product of delta and inertia changes little with the inertia (constant energy
    swing: Kakaitsas, section 3.2.2). Between the two values of the grid it is interpolated, linear
    in the logarithms. With a product that tends to a constant as Theta^-n, n at most 2, the
    relative error is at most n/8 of the step times the change of the product, both in logarithms;
    n = 2 is assumed. Computing the inertia exactly (`optimise`) takes seconds, this nothing.
    """
    name, archive = found.name, found.archive
    own = [d for d in found.place if archive.sizes[d] > 1]
    limits = [c.limit for c in found.conditions if c.name == "delta" and c.above]
    others = [c.name for c in found.conditions if not (c.name == "delta" and c.above)]
    if not found.least or name not in INERTIAS or own != [name] or not limits or min(limits) <= 0:
        return None
    if name in others or any(name in archive[other].dims for other in others):
        return None
    values = archive[name].values
    heavy = float(values[found.place[name]])
    lighter = np.flatnonzero(values < heavy)
    if not lighter.size:
        return None
    near = int(lighter[np.argmax(values[lighter])])
    light = float(values[near])
    before = archive["delta"].isel({**found.place, name: near}).values
    after, limit = found.design["delta"].values, min(limits)
    counts = np.isfinite(after) & ~(before <= limit)  # Points that need more than the lighter one
    before, after = before[counts], after[counts]
    if not light > 0.0 or not before.size or not (before > after).all() or not (after > 0.0).all():
        return None
    step, change = math.log(heavy / light), np.log(before / after)
    needed = light * np.exp(step * np.log(before / limit) / change)
    error = step * np.abs(step - change) / 4.0
    worst = int(np.argmax(needed))
    return float(needed[worst]), float(error[worst])


def pareto(
    archive: xr.Dataset, first: str, second: str, *more: str, most: str | Sequence[str] = (),
    within: str | Sequence[str] = (), at_every: str | Sequence[str] = (),
    not_counted: str | Sequence[str] = (),
) -> xr.Dataset:  # fmt: skip
    """Pareto front of two quantities or more: the designs that no other beats in all of them.

    Parameters
    ----------
    archive : Dataset
        As `open` or `run` returns it; it may be larger than memory.
    first, second, *more : str
        Quantities or axes, of which less is better.
    most : str or sequence of str
        Those of them of which more is better.
    within : str or sequence of str
        Conditions, all of which must hold, as `best` takes them.
    at_every, not_counted : str or sequence of str
        As `best` takes them: axes at all values of which the conditions must hold, and at which
        the worst value of each quantity counts; outcomes that are left out.

    Returns
    -------
    Dataset
        The archive at these designs, along a new dimension `front`, the best in `first` first.
        Designs that are equal in all of them are all in it. Axes on which none of the names
        depends stay, and those of `at_every`.

    Raises
    ------
    SceneError
        As `best`.

    Examples
    --------
    >>> import sweeps
    >>> archive = sweeps.run("first")
    >>> front = sweeps.pareto(archive, "inertia", "delta", at_every="load")
    >>> front.inertia.size
    25
    """
    check_dataset(archive)
    names = [str(name) for name in (first, second, *more)]
    for number, name in enumerate(names):
        if name in names[:number]:
            raise SceneError(f"pareto: {name} is given twice; needs two quantities or more")
    largest = names_given(most, "most")
    for name in largest:
        if name not in names:
            raise SceneError(
                f"pareto: most = {shown(name)}: must be {', '.join(names[:-1])} or {names[-1]}"
            )
    wanted = [(name, -1.0 if name in largest else 1.0) for name in names]
    conditions = conditions_of(within, units_of(archive))
    if not_counted and not at_every:
        raise SceneError(
            "pareto: not_counted is only used with at_every; failed designs never count"
        )
    archive, told = kept_for(archive, wanted, conditions, at_every, front=True)
    search = EveryPoint(archive, wanted, conditions, at_every, not_counted)
    sizes = [search.sizes[d] for d in search.own]
    front = Front(len(wanted))
    for place, designs in search.judged():
        places = np.flatnonzero(designs.fulfilling)
        if sizes:
            at = np.ix_(*(np.arange(part.start, part.stop) for part in place))
            places = np.ravel_multi_index(at, sizes)[designs.fulfilling]
        front.add(designs.worst[:, designs.fulfilling], np.asarray(places, dtype=np.int64))
    if not front.places.size:
        raise SceneError(search.nothing())
    designs_on_front = front.taken_of(archive, search.own)
    if at_every:
        designs_on_front.attrs[TEXT] = told or search.text()
    return designs_on_front
