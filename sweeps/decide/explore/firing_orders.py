"""All firing orders of an engine, computed side by side and ranked."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from engine_dyn.geometry.arrangement import Arrangement
from engine_dyn.geometry.layouts import arrangement_from_text
from engine_dyn.geometry.possible_orders import (
    CRANKS,
    PossibleOrder,
    count_orders,
    known_order_of,
    numbered_from_other_end,
    possible_orders,
    sampled_orders,
    turning_other_way,
)
from engine_dyn.types import Floats
from engine_dyn.units import DEGREE
from sweeps.base.checks import mentioned
from sweeps.base.dimensions import ARRANGEMENT, DESIGN, ENGINE, OF_ORDERS
from sweeps.base.errors import SceneError, counted, not_known, shown
from sweeps.base.naming import named
from sweeps.scene.engine.cylinder_keys import arrangement_of, read_arrangement
from sweeps.scene.engine.engine_files import catalogue
from sweeps.scene.engine_choices import those_possible
from sweeps.scene.features import GIVEN_FEATURES
from sweeps.scene.model import Scene
from sweeps.scene.reading import built_in_scenes, is_scene, read_scene

if TYPE_CHECKING:
    import xarray as xr

MOST = 1000  # Largest number of firing orders that are computed

CRITERIA: Mapping[str, str] = {
    "torque_after_throw_range": "largest range of the torque along the shaft",
    "first_mode_torque_rms": "torque that excites the first torsional mode",
    "any_main_journal_load_max": "largest load of a main bearing",
    "all_main_journals_load_rms": "root mean square of the loads of all main bearings",
    "shaking_force_max": "largest shaking force",
    "shaking_moment_max": "largest shaking moment",
}
"""Quantities that orders are ranked by, the least first, and their descriptions."""

ALIKE = 1e-3
"""Relative difference below which orders share a place: the model is no better than that."""


def firing_orders(
    engine: str | Path | Mapping[str, Any], *,
    arrangement: str | Mapping[str, Any] | None = None,
    settings: Mapping[str, Any] | None = None, crank: str = "either-hand",
    by: str | Sequence[str] | None = None, sample: int | None = None, seed: int = 1,
    threads: int | None = None, progress: bool = False,
) -> xr.Dataset:  # fmt: skip
    """Compute an engine in every firing order that its crankshaft allows, and rank them.

    Parameters
    ----------
    engine : str, Path or dict
        An engine of the catalogue, an engine file, or a scene; a scene may have axes of numbers,
        such as `speed`, and the worst value over them counts.
    arrangement : str or dict, optional
        Another arrangement of the cylinders, such as ``"in-line 6"``, as scenes have it.
    settings : dict, optional
        Keys of `[set]`, which replace those of the scene: ``{"speed": 1500}``. `cylinder_spacing`
        is needed for the shaking moments, and so for "any" below.
    crank : str
        "own": the engine's crankshaft as it is. "either-hand": that, and its mirror image. "any":
        its throws in any sequence along the shaft.
    by : str or sequence of str, optional
        One or several of `CRITERIA`, or any other quantity with a number for each design, the least
        of which is best. Of several the sum of the ranks counts. If not given, all of `CRITERIA`
        that the engine has and that tell its orders apart.
    sample : int, optional
        Where there are more than `MOST` orders: so many of them, drawn at random.
    seed : int
        Of the random numbers.
    threads, progress
        As of `sweeps.run`.

    Returns
    -------
    Dataset
        An archive with the axis `arrangement`, sorted by the orders, and along it beside the
        quantities: `rank` (from 1 on) and `rank_sum`; `firing_order`; `known_order`, who builds
        such an engine (empty where nobody is known to), with "other end" or "other way" where its
        cylinders are counted so; `own_crank` (1 where the crankshaft is the engine's own);
        `from_other_end` and `other_way`, the orders of the same engine counted from its other end,
        and turning the other way. The attribute `firing_orders` tells how many orders there are.

    Raises
    ------
    SceneError
        In one line: for scenes that are not about one engine, engines with one order, more than
        `MOST` orders without `sample`, quantities that do not rank designs.

    Examples
    --------
    >>> import sweeps
    >>> found = sweeps.firing_orders("ntua", arrangement="in-line 4", by="torque_after_throw_range")
    >>> sorted(map(str, found.firing_order.values))
    ['1-2-4-3', '1-3-4-2']
    """
    from sweeps.running.compute.in_memory import run

    if crank not in CRANKS:
        raise SceneError(f"crank = {shown(crank)}: must be one of {', '.join(CRANKS)}")
    if settings is not None and not isinstance(settings, Mapping):
        raise SceneError(f"settings = {shown(settings)}: must be a dict of keys of [set]")
    asked = _asked(by)
    try:
        given, name = given_scene(engine, list(CRITERIA)[:1])
        own, tables = _one_engine(given, name, arrangement, dict(settings or {}), crank)
    except SceneError as error:
        # An engine without a diagram has no torque, but shaking forces and moments
        if "needs [[diagram]]" not in str(error):
            raise
        without = asked or [n for n in CRITERIA if n.startswith("shaking_moment")]
        given, name = given_scene(engine, without)
        own, tables = _one_engine(given, name, arrangement, dict(settings or {}), crank)
    orders, total = _orders(own, crank, sample, seed, name)
    tables["axes"] = {ARRANGEMENT: [_written(one.arrangement) for one in orders], **tables["axes"]}
    # Quantities that are computed for every firing order besides those that rank it
    beside = (
        "delta", "torque_range", "torque_order", "phase_vector_sum", "first_mode_torque_order",
        "first_mode_vector_sum", "main_journal_load_max", "main_journal_load_rms",
    )  # fmt: skip
    wanted = dict.fromkeys([*CRITERIA, *beside, *tables["output"].get("quantities", ()), *asked])

    def read(quantities: Sequence[str], **changed: Any) -> Scene:
        output = {**tables["output"], "quantities": list(quantities)}
        return read_scene(given, **{**tables, "output": output, **changed})

    def try_reading(quantities: Sequence[str]) -> list[str]:
        read(quantities, axes={**tables["axes"], ARRANGEMENT: tables["axes"][ARRANGEMENT][:1]})
        return list(quantities)

    possible, refused = those_possible(list(wanted), try_reading)
    for quantity in (*asked, *tables["output"].get("quantities", ())):
        if quantity in refused:
            raise refused[quantity]
    if crank == "any" and not asked and "shaking_moment_max" in refused:
        # Without the cylinder spacing no shaking moment is known, and the best order might shake.
        raise SceneError(
            f"{name}: crank any: throws in another sequence have other free moments, so give "
            "cylinder_spacing [m] in the scene or the settings, or choose the quantities to "
            "compare with by"
        )
    computed = run(read(possible), threads=threads, progress=progress)
    return _ranked(computed, orders, total, crank, asked, "-".join(map(str, own.firing_order)))


# --- tables of the scene -------------------------------------------------------------------------


def given_scene(scene: str | Path | Mapping[str, Any], asked: Sequence[str]) -> tuple[Any, str]:
    """A scene as `read_scene` takes it, and what messages call it.

    Of an engine, and of tables that ask for nothing, it asks for these quantities. SceneError
    refuses what is neither an engine nor a scene.
    """
    if isinstance(scene, Mapping):
        made = dict(scene)
        made.setdefault("output", {"quantities": list(asked)})
        return made, "scene"
    text = str(scene)
    toml = text.endswith(".toml")
    built_in = not toml and not Path(text).exists()
    if (toml and is_scene(Path(text))) or (built_in and text in built_in_scenes()):
        return scene, text
    if toml or text in catalogue():
        return {"engine": text, "output": {"quantities": list(asked)}}, text
    known = [*catalogue(), *built_in_scenes()]
    raise SceneError(
        f"{shown(text, 300)}: neither an engine nor a scene, and no such file"
        f"{not_known(text, known)}"
    )


def check_left_out(scene: Scene, name: str, compared: str) -> None:
    """Refuse tables that do not go with a comparison of one engine with itself."""
    for table in ("designs", "sample", "uncertainty", "reference", "measured"):
        if scene.source.get(table) is not None:
            raise SceneError(f"{name}: [{table}]: not allowed when {compared} are compared")


def _asked(by: str | Sequence[str] | None) -> list[str]:
    names = [by] if isinstance(by, str) else list(by or ())
    return [part.strip() for name in names for part in name.split(",") if part.strip()]


def _one_engine(
    given: Any, name: str, arrangement: str | Mapping[str, Any] | None,
    replaced: Mapping[str, Any], crank: str,
) -> tuple[Arrangement, dict[str, Any]]:  # fmt: skip
    """The engine's own arrangement, and the tables of a scene without any arrangement."""
    own = read_scene(given)
    check_left_out(own, name, "all firing orders of one engine")
    for feature in GIVEN_FEATURES.values() if crank != "own" or arrangement is not None else ():
        if feature.own_crank and feature.part_of(own) is not None:
            raise SceneError(
                f"{name}: {feature.written} belong to one crankshaft: must be left out, or crank "
                "be own without another arrangement"
            )
    if not {ARRANGEMENT, DESIGN, ENGINE}.isdisjoint(own.dimensions):
        raise SceneError(
            f"{name}: the scene has several engines or arrangements; it must have one, whose "
            "firing orders are compared"
        )
    if len(own.counts) > 1 and arrangement is None:
        raise SceneError(f"{name}: cylinders: has {len(own.counts)} values; must be one number")
    settings = {**(own.source.get("set") or {}), **replaced}
    axes = dict(own.source.get("axes") or {})
    axes.pop("cylinders", None)
    made = _arrangement(own, arrangement, name)
    for key in ("arrangement", "firing_angles"):
        settings.pop(key, None)
    settings["cylinders"] = len(made.cylinders)
    output = dict(own.source.get("output") or {})
    if own.path is None and output.get("quantities") == list(CRITERIA)[:1]:
        output.pop("quantities")  # `given_scene` put it there, since a scene needs a quantity
    return made, {"set": settings, "axes": axes, "output": output}


def _arrangement(own: Scene, given: str | Mapping[str, Any] | None, name: str) -> Arrangement:
    """Arrangement of the engine, or the one that is given in its place."""
    if given is not None:
        try:
            return arrangement_of(read_arrangement(given, "arrangement"), own.engine.period)
        except ValueError as error:
            raise SceneError(mentioned(error)) from None
    cylinders = own.cylinders_by_count[own.counts[0]]
    if cylinders.arrangement is None:
        raise SceneError(
            f"{name}: {counted(cylinders.count, 'cylinder')} in line: no firing order and so no "
            "crankshaft is known; give an arrangement"
        )
    return cylinders.arrangement


def _orders(
    engine: Arrangement, crank: str, sample: int | None, seed: int, name: str
) -> tuple[tuple[PossibleOrder, ...], int]:
    """Firing orders that are computed, and how many exist."""
    total = count_orders(engine, crank)
    if sample is not None and not (isinstance(sample, int) and 2 <= sample <= MOST):
        raise SceneError(f"sample = {shown(sample)}: must be a whole number from 2 to {MOST:,}")
    if total < 2:
        raise SceneError(
            f"{name}: {counted(len(engine.cylinders), 'cylinder')}, crank {crank}: there is only "
            "one firing order; nothing to rank"
        )
    if sample is not None and sample < total:
        return sampled_orders(engine, crank, sample, seed), total
    if total > MOST:
        raise SceneError(
            f"{name}: {counted(len(engine.cylinders), 'cylinder')}, crank {crank}: {total:,} "
            f"firing orders; at most {MOST:,} are computed; choose another crank "
            f"({', '.join(c for c in CRANKS if c != crank)}), or a sample of them"
        )
    return possible_orders(engine, crank), total


def _written(made: Arrangement) -> str | dict[str, Any]:
    """An arrangement as scenes have it: a text in line, a table of throws otherwise."""
    if len(made.banks) == 1:
        text = f"in-line {len(made.cylinders)} {made.name}"
        try:
            alike = arrangement_from_text(text, made.period)
        except ValueError:
            alike = None
        if alike is not None and _same(alike, made):
            return text
    return {
        "name": made.name,
        "uneven": made.uneven,
        "banks": [bank / DEGREE for bank in made.banks],
        **({"sides": list(made.sides)} if made.sides else {}),
        "throws": [
            {"angle": _degrees(throw.angle), "position": throw.position,
             "radius_factor": throw.radius_factor}
            for throw in made.throws
        ],
        "cylinders": [
            {"throw": one.throw + 1, "bank": one.bank + 1,
             "firing_angle": _degrees(one.firing_angle)}
            for one in made.cylinders
        ],
    }  # fmt: skip


def _degrees(angle: float) -> float:
    return round(angle / DEGREE, 9)


def _same(one: Arrangement, other: Arrangement) -> bool:
    radii = [throw.radius_factor for throw in other.throws]
    positions = [[throw.position for throw in made.throws] for made in (one, other)]
    return bool(
        positions[0] == positions[1]
        and set(radii) == {1.0}
        and np.allclose(one.firing_angles, other.firing_angles, rtol=0.0, atol=1e-9)
    )


# --- ranks ---------------------------------------------------------------------------------------


def compared_criteria(archive: xr.Dataset) -> list[str]:
    """Criteria that an archive has and that tell its orders apart."""
    return [name for name in _criteria(archive) if _differs(worst_of_orders(archive, name))]


def _criteria(archive: xr.Dataset) -> list[str]:
    return [name for name in CRITERIA if name in archive and ARRANGEMENT in archive[name].dims]


def worst_of_orders(archive: xr.Dataset, name: str) -> Floats:
    """Largest value of each order over all other dimensions; NaN where one is missing."""
    array = archive[name]
    others = [dim for dim in array.dims if dim != ARRANGEMENT]
    worst: Floats = array.max(others, skipna=False).values.astype(np.float64)
    return worst


def _differs(values: Floats) -> bool:
    known = values[np.isfinite(values)]
    return bool(known.size) and bool(np.ptp(known) > ALIKE * np.abs(known).max())


def _places(values: Floats) -> Floats:
    """Place of each value: 1 for the least, equal ones share it; missing values come last."""
    known = np.where(np.isfinite(values), values, np.inf)
    limit = known * (1.0 - np.sign(known) * ALIKE)
    places: Floats = np.array([1.0 + float((known < one).sum()) for one in limit])
    return places


def _ranked(
    archive: xr.Dataset, orders: Sequence[PossibleOrder], total: int, crank: str,
    asked: Sequence[str], own_order: str,
) -> xr.Dataset:  # fmt: skip
    for quantity in asked:
        _check_ranks(archive, quantity)
    # Where no criterion tells orders apart, all have the first place by each criterion.
    by = list(asked) or compared_criteria(archive) or _criteria(archive)
    summed = np.sum([_places(worst_of_orders(archive, quantity)) for quantity in by], axis=0)
    own_crank = [one.own_crank for one in orders]
    numbers = {
        "rank": (_places(summed), "rank of the firing order, 1 is best"),
        "rank_sum": (summed, f"sum of the ranks by {', '.join(by)}"),
        "own_crank": (own_crank, "whether the crankshaft is the engine's own: 1, or 0"),
    }
    texts = _texts(orders)
    meanings = {
        "firing_order": "firing order",
        "known_order": "known engine with this order",
        "from_other_end": "order counted from the other end of the engine",
        "other_way": "order with the opposite sense of rotation",
    }
    along = {
        key: (ARRANGEMENT, np.asarray(values, dtype=np.int32), {**named(key, text), "units": "1"})
        for key, (values, text) in numbers.items()
    } | {key: (ARRANGEMENT, texts[key], named(key, text, None)) for key, text in meanings.items()}
    ranks = {key: along.pop(key) for key in ("rank", "rank_sum")}
    made = archive.assign(ranks).assign_coords(along)
    about = {"crank": crank, "own_order": own_order, "orders": total, "computed": len(orders),
             "by": by, **_alike(orders, total)}  # fmt: skip
    made.attrs[OF_ORDERS] = json.dumps(about)
    return made


def _check_ranks(archive: xr.Dataset, quantity: str) -> None:
    if quantity not in archive or archive[quantity].dtype.kind != "f":
        raise SceneError(f"by {shown(quantity)}: must be a quantity with numbers")
    if ARRANGEMENT not in archive[quantity].dims:
        raise SceneError(
            f"by {quantity}: is the same for all firing orders; must be one of "
            f"{', '.join(compared_criteria(archive)) or 'another engine'}"
        )


def _texts(orders: Sequence[PossibleOrder]) -> dict[str, list[str]]:
    """Labels of the orders: makers that build them, and their other names."""
    texts: dict[str, list[str]] = {
        "firing_order": [], "known_order": [], "from_other_end": [], "other_way": [],
    }  # fmt: skip
    for one in orders:
        texts["firing_order"].append(one.arrangement.name)
        known = known_order_of(one.arrangement)
        if known is None:
            texts["known_order"].append("")
        else:
            entry, way = known
            texts["known_order"].append(f"{entry.source}{f' ({way})' if way else ''}")
        for key, turned in (
            ("from_other_end", numbered_from_other_end(one.arrangement)),
            ("other_way", turning_other_way(one.arrangement)),
        ):
            texts[key].append("" if turned is None else turned.name)
    return texts


def _alike(orders: Sequence[PossibleOrder], total: int) -> dict[str, int]:
    """Number of orders if those counted from the other end, or reversed, are the same."""
    if len(orders) < total:
        return {}
    place = {_key(one.arrangement): number for number, one in enumerate(orders)}
    other_end = [_place_of(numbered_from_other_end(one.arrangement), place) for one in orders]
    other_way = [_place_of(turning_other_way(one.arrangement), place) for one in orders]
    return {
        "but_for_the_end": _classes(other_end),
        "but_for_end_and_way": _classes(other_end, other_way),
    }


def _key(made: Arrangement) -> tuple[float, ...]:
    return tuple(_degrees(float(angle)) for angle in made.firing_angles)


def _place_of(made: Arrangement | None, place: Mapping[tuple[float, ...], int]) -> int | None:
    return None if made is None else place.get(_key(made))


def _classes(*partners: Sequence[int | None]) -> int:
    """Number of groups that are joined by partners."""
    group = list(range(len(partners[0])))
    for each in partners:
        for number, partner in enumerate(each):
            if partner is not None and group[number] != group[partner]:
                old, new = group[number], group[partner]
                group = [new if one == old else one for one in group]
    return len(set(group))
