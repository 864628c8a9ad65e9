"""Checks of [reduce] against the scene that it stands in."""

from __future__ import annotations

from collections.abc import Sequence

from sweeps.base.checks import names_given
from sweeps.base.dimensions import STATUS
from sweeps.base.errors import SceneError, not_known, shown
from sweeps.scene.model import Scene
from sweeps.scene.reduce import BestTable, FrontTable, Kept, Reduce, ReduceTable


def read_reduce(table: ReduceTable | None, scene: Scene, name: str) -> Reduce | None:
    """Check what a table [reduce] asks for.

    Raises
    ------
    SceneError
        For axes and quantities that the scene does not have.
    """
    if table is None:
        return None
    where = f"{name}: [reduce]"
    over = scene.dimensions if table.over is None else _axes(table.over, scene, f"{where} over")
    every = tuple(name for name in scene.quantities if name != STATUS)  # outcomes are counted
    statistics = every if table.statistics is None else tuple(table.statistics)
    for quantity in statistics:
        _check_known(quantity, scene.quantities, f"{where} statistics")
    quantiles = tuple(sorted(set(table.quantiles)))
    for share in quantiles:
        if not 0.0 < share < 1.0:
            raise SceneError(f"{where} quantiles = {shown(share)}: must be between 0 and 1")
    names = (*scene.quantities, *scene.dimensions, *scene.designs)
    kept = []
    for number, best in enumerate(table.best):
        here = f"{where} best {number + 1}"
        if (best.least is None) == (best.most is None):
            raise SceneError(f"{here}: needs either least or most")
        one = best.least if best.most is None else best.most
        assert one is not None
        _check_known(one, names, here)
        kept.append(_kept(((one, 1.0 if best.most is None else -1.0),), best.number, best))
    for number, front in enumerate(table.front):
        here, most = f"{where} front {number + 1}", names_given(front.most, "most")
        for key in (*front.of, *most):
            _check_known(key, front.of if key in most else names, here)
        if len(set(front.of)) < len(front.of):
            raise SceneError(f"{here} of = {shown(front.of)}: names must differ")
        wanted = tuple((key, -1.0 if key in most else 1.0) for key in front.of)
        kept.append(_kept(wanted, 0, front))
    at_every = _axes(table.at_every, scene, f"{where} at_every")
    if any(one.not_counted for one in kept) and not at_every:
        raise SceneError(
            f"{where} not_counted: only used with at_every; failed designs never count"
        )
    within = tuple(names_given(table.within, "within"))
    return Reduce(statistics, over, quantiles, within, at_every, tuple(kept))


def _kept(
    wanted: tuple[tuple[str, float], ...], number: int, table: BestTable | FrontTable
) -> Kept:
    within = tuple(names_given(table.within, "within"))
    return Kept(wanted, number, within, tuple(names_given(table.not_counted, "not_counted")))


def _axes(raw: str | Sequence[str], scene: Scene, where: str) -> tuple[str, ...]:
    """Axes of the scene, in its order."""
    names = names_given(raw, where)
    for axis in names:
        _check_known(axis, scene.dimensions, where)
    return tuple(d for d in scene.dimensions if d in names)


def _check_known(name: str, known: Sequence[str], where: str) -> None:
    if name not in known:
        raise SceneError(f"{where}: {shown(name)}: not in the scene{not_known(name, list(known))}")
