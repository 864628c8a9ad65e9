"""The torsional calculation of a report as it is handed in: numbered tables and figures."""

from __future__ import annotations

import io
import re
import urllib.parse
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from engine_dyn.types import Floats
from sweeps.base.dimensions import DESIGN, REDUCTION
from sweeps.base.errors import SceneError, one_line, shown
from sweeps.decide.explore.attributes import members_of
from sweeps.decide.explore.shaft_extremes import Worst, worst_of_shaft
from sweeps.view.figures.drawing import drawing, kinds_of
from sweeps.view.figures.options import Options
from sweeps.view.figures.shaft_system import told_of
from sweeps.view.report.html import filled, paragraph, table, text, value_text
from sweeps.view.report.shaft_results import cases, numeric, of_crank, system, worst
from sweeps.view.texts.readable_units import converted

if TYPE_CHECKING:
    import xarray as xr

MOST_VALUES = 20_000_000  # Largest number of values of an archive whose calculation is written

MOST_SPEEDS = 30  # Largest number of lines of the table over the speed, besides the largest values

MODES = 4  # Largest number of modes with a Holzer table

TORSIOGRAM = ("disc_angle_measured_order", "disc_angle_order", "disc_angle_measured_phase",
              "disc_angle_phase")  # fmt: skip

Parts = Iterator[str]


def calculation(
    archive: xr.Dataset, choices: Any, *, torsiogram: xr.Dataset | None = None
) -> str:  # fmt: skip
    """Return the parts that the archive has quantities for; empty without a shaft.

    A `torsiogram` that `sweeps.measured` made adds a part.
    """
    if not (numeric(archive, "disc") or numeric(archive, "shaft")):
        return ""
    values = sum(v.size for v in archive.data_vars.values())
    if REDUCTION in archive.attrs or values > MOST_VALUES or not _sound(archive):
        return "".join([*system(archive), *worst(archive)])
    written: list[str] = []
    measured = ("Measured torsiogram", lambda _: _measured(archive, torsiogram))
    for title, make in (*_PARTS, measured):
        html = "".join(make(archive))
        if html:
            written.append(f'<h3 class="part">{len(written) + 1}. {title}</h3>{html}')
    return "".join(written)


def check_torsiogram(archive: xr.Dataset, torsiogram: xr.Dataset) -> None:
    """Refuse a dataset that is no torsiogram, or that of a disc which the archive lacks."""
    wanted = {name: torsiogram.get(name) for name in TORSIOGRAM}
    if any(
        one is None or one.dtype.kind != "f" or {*one.dims} != {"recording", "order"}
        for one in wanted.values()
    ):
        raise SceneError("torsiogram: must be what `measured` makes of a scene whose [measured] "
                         "has a disc")  # fmt: skip
    disc, known = str(torsiogram.attrs.get("disc")), archive.get("disc_name")
    if known is None or disc not in map(str, known.values):
        raise SceneError(f"torsiogram: disc {shown(disc)}: the archive has no such disc")


def _sound(archive: xr.Dataset) -> bool:
    """Whether the axes that are drawn over have numbers, each once, and parts have names."""
    for dim in ("speed", "misfire", "mode", "order"):
        values = archive.coords[dim].values if dim in archive.coords else np.array([np.nan])
        number = values.dtype.kind in "fiu" and np.isfinite(values).all()
        if dim in archive.dims and not (number and 0 < np.unique(values).size == values.size):
            return False
    return all(
        f"{place}_name" in archive.coords and archive.sizes[place]
        for place in ("disc", "shaft") if place in archive.dims
    )  # fmt: skip


# ---- figures and values --------------------------------------------------------------------------


def drawn(archive: xr.Dataset, names: Sequence[str], *kinds: str) -> Parts:
    """Figures of `engine-dyn plot` of some kinds, of those quantities that the archive has."""
    data = archive[[name for name in names if name in archive]]
    if "speed" in archive.coords:  # A Campbell diagram is over it, whatever its quantities are
        data = data.assign_coords(speed=archive["speed"])
    some = tuple(one.name for one, takes in kinds_of(data) if takes and one.name in kinds)
    if not some:
        return
    # Letters as text, not as outlines, make pictures much smaller.
    with drawing(data, Options(only=some, style={"svg.fonttype": "none"})) as figures:
        for stem, figure in figures:
            stream = io.StringIO()
            figure.savefig(stream, format="svg", metadata={"Date": None, "Creator": None})
            written = f"<svg{stream.getvalue().partition('<svg')[2]}"
            written = re.sub("<[^>]*>", lambda tag: _shorter(tag[0]), written)
            # A picture, unlike markup, cannot run what stands in names of an archive.
            quoted = urllib.parse.quote(written, safe=" /:;,=()-.+*!?[]{}@$~_|")
            yield (
                f'<img class="drawn" alt="{text(stem.replace("_", " "))}" '
                f'src="data:image/svg+xml,{quoted}">'
            )


def _shorter(tag: str) -> str:
    """A tag of SVG with two decimals, and with letters that are as wide where these are missing."""
    tag = re.sub(r"(\d\.\d\d)\d+", r"\1", tag)
    return tag.replace("'DejaVu Sans'", "'DejaVu Sans', Verdana, sans-serif")


def _of(archive: xr.Dataset, name: str, *dims: str) -> Floats | None:
    """Values of a quantity over some dimensions, at the first place of all others, or None."""
    if name not in archive or not {*dims} <= {*archive[name].dims}:
        return None
    data = archive[name]
    first = data.isel({d: 0 for d in data.dims if d not in dims})
    return np.asarray(first.transpose(*dims).values, dtype=float)


def _names(archive: xr.Dataset, place: str) -> list[str]:
    return [one_line(name, 60) for name in archive[f"{place}_name"].values]


def _number(value: float, digits: int = 4) -> str:
    return f"{value + 0.0:.{digits}g}" if np.isfinite(value) else ""


def _head(archive: xr.Dataset, name: str) -> str:
    unit = converted(str(archive[name].attrs.get("units", "1")), None)[1]
    said = name.removesuffix("_half_range").replace("_", " ")
    return f"{said} [{unit}]" if unit else said


def _first_of(archive: xr.Dataset, *names: str) -> Parts:
    """A note where a table shows the first design alone."""
    apart = {str(d) for name in names if name in archive for d in archive[name].dims}
    apart -= {"mode", "disc", "shaft", "order", "throw", "misfire"}
    several = sorted(d for d in apart if archive.sizes[d] > 1)
    if several:
        at = ", ".join(f"{d} {value_text(archive[d], archive[d].values[0], None)}" for d in several)
        yield paragraph(f"At {at}.", "note")


# ---- system and modes ----------------------------------------------------------------------------


def _system(archive: xr.Dataset) -> Parts:
    """The mass-elastic diagram, tables of discs and shafts, and what excites them."""
    names = ("system_inertia", "system_stiffness", "system_speed_ratio")
    yield from drawn(archive, names, "mass_elastic")
    inertia, ratio = _of(archive, names[0], "disc"), _of(archive, names[2], "disc")
    stiffness, pairs = _of(archive, names[1], "shaft"), told_of(archive).get("shafts")
    more: dict[str, dict[str, list[str]]] = {}
    if inertia is not None and ratio is not None:
        more["disc"] = {
            "inertia [kg m²]": [_number(one, 5) for one in inertia],
            "speed over crank": [_number(one) for one in ratio],
            "at the crank [kg m²]": [_number(one, 5) for one in inertia * ratio**2],
        }
        if stiffness is not None and isinstance(pairs, list):
            at_crank = stiffness * ratio[[pair[0] - 1 for pair in pairs]] ** 2
            more["shaft"] = {
                "stiffness [N m/rad]": [_number(one, 5) for one in stiffness],
                "at the crank [N m/rad]": [_number(one, 5) for one in at_crank],
            }
        yield from _first_of(archive, *names)
    yield from system(archive, more)
    rows = []
    for one in told_of(archive).get("excitations", []):
        over = f"proportional to the speed to the power {one['power']:g}, " if one["power"] else ""
        over = "a table over the speed, " if one["table"] else over
        orders = ", ".join(
            f"{order:g}: {_number(size)}"
            for order, size in zip(one["orders"], one["amplitudes"], strict=True)
        )
        mean = one["mean"] if abs(one["mean"]) > 1e-9 * sum(one["amplitudes"]) else 0.0
        rows.append([one["name"], one["disc"], f"{over}here at {one['speed']:.4g} rpm",
                     _number(mean), orders])  # fmt: skip
    if rows:
        heads = ("excitation", "disc", "over the speed", "mean [N m]",
                 "order of the disc's turns: amplitude [N m]")  # fmt: skip
        yield table(heads, rows, (1, 3))


def _modes(archive: xr.Dataset) -> Parts:
    """Natural frequencies, and a Holzer table for each of the first modes."""
    wanted = ("natural_frequency", "modal_inertia", "modal_damping_ratio",
              "damped_natural_frequency", "damping_ratio")  # fmt: skip
    names = [n for n in wanted if n in archive and "mode" in archive[n].dims]
    values = [_of(archive, name, "mode") for name in names]
    if names:
        rows = [
            [str(mode), *(f"{of[i]:.5g}" for of in values if of is not None)]
            for i, mode in enumerate(archive["mode"].values)
        ]
        yield table(("mode", *(_head(archive, n) for n in names)), rows, range(1, 1 + len(names)))
        yield from _first_of(archive, *names)
    yield from drawn(archive, ("mode_shape", "natural_frequency"), "mode_shapes")
    yield from drawn(archive, ("natural_frequency", "critical_speed", "mode_vector_sum",
                               "damped_natural_frequency"), "campbell")  # fmt: skip
    yield from _holzer(archive)


def _holzer(archive: xr.Dataset) -> Parts:
    shape, torque = (_of(archive, "mode_shape", "mode", "disc"),
                     _of(archive, "mode_torque", "mode", "shaft"))  # fmt: skip
    frequency = _of(archive, "natural_frequency", "mode")
    told = told_of(archive)
    if shape is None or torque is None or frequency is None or "free_end" not in told:
        return
    inertia = _of(archive, "system_inertia", "disc")
    inertia = np.full(shape.shape[1], np.nan) if inertia is None else inertia
    stress = _of(archive, "mode_stress", "mode", "shaft")
    stress = np.full(torque.shape, np.nan) if stress is None else stress
    discs, shafts, free_end = (*(_names(archive, p) for p in ("disc", "shaft")), told["free_end"])
    yield paragraph(
        f"Holzer tables: amplitudes over that of the free end, {discs[free_end - 1]}; torques and "
        "stresses per degree of its amplitude. Each shaft stands beside its first disc; the torque "
        "of a disc is that of its inertia, at its own speed.", "note",
    )  # fmt: skip
    for mode in range(min(MODES, len(frequency))):
        end = shape[mode, free_end - 1]
        if not (np.isfinite(frequency[mode]) and end and np.isfinite(torque[mode]).any()):
            continue
        rows: list[list[str]] = []
        for i, name in enumerate(discs):
            over = round(shape[mode, i] / end, 9)  # Without rounding errors of what stands still
            moment = over * (2.0 * np.pi * frequency[mode]) ** 2 * inertia[i] * np.pi / 180.0
            of_disc = [f"{i + 1} {name}", _number(inertia[i], 5), _number(over), _number(moment)]
            # Oil alone holds no static torque.
            beside = [[f"{n + 1} {shafts[n]}", _number(torque[mode, n]), _number(stress[mode, n])]
                      for n, pair in enumerate(told["shafts"])
                      if pair[0] == i + 1 and torque[mode, n]]  # fmt: skip
            for of_shaft in beside or [[""] * 3]:
                rows.append([*of_disc, *of_shaft])
                of_disc = [""] * 4
        heads = ("disc", "inertia [kg m²]", "amplitude", "torque [N m/degree]", "shaft",
                 "its torque [N m/degree]", "stress [MPa/degree]")  # fmt: skip
        yield f"<h4>Mode {archive['mode'].values[mode]}: {frequency[mode]:.5g} Hz</h4>"
        yield filled(heads, rows, (1, 2, 3, 5, 6))


def _vector_sums(archive: xr.Dataset) -> Parts:
    """Vector sums of orders and modes with critical speeds, and the firing diagram."""
    sums = _of(archive, "mode_vector_sum", "mode", "order")
    critical = _of(archive, "critical_speed", "mode", "order")
    if sums is not None:
        kept = [i for i in range(len(sums)) if np.isfinite(sums[i]).any()]
        rows = []
        for j, order in enumerate(archive["order"].values):
            cells = [
                f"{sums[i, j]:.3f}" + ("" if critical is None else f" ({critical[i, j]:.5g})")
                for i in kept
            ]
            rows.append([f"{order:g}", *cells])
        heads = [f"mode {archive['mode'].values[i]}" for i in kept]
        speeds = "" if critical is None else ", with the critical speed in rpm in parentheses"
        yield paragraph(f"Vector sum of each order in each mode{speeds}.", "note")
        yield table(("order", *heads), rows, range(1 + len(kept)))
        yield from _first_of(archive, "mode_vector_sum", "critical_speed")
    names = ("mode_shape", "mode_vector_sum", "critical_speed")
    yield from drawn(archive, names, "phase_vectors")


def _excitation(archive: xr.Dataset) -> Parts:
    """Torque on a throw by order, at a few speeds."""
    name = "throw_torque_order"
    if name not in archive or not {"throw", "order"} <= {*archive[name].dims}:
        return
    healthy = next(cases(archive))[1]
    places: list[Any] = [None]
    if "speed" in healthy[name].dims:
        places = sorted({0, healthy.sizes["speed"] // 2, healthy.sizes["speed"] - 1})
    columns, heads = [], []
    for place in places:
        part = healthy if place is None else healthy.isel(speed=place)
        values = _of(part, name, "throw", "order")
        assert values is not None
        at = "" if place is None else f" at {float(part['speed']):.4g} rpm"
        columns.append(np.nanmax(values, axis=0))
        heads.append(f"amplitude{at} [N m]")
        phase = _of(part, "throw_torque_phase", "throw", "order")
        if phase is not None:
            columns.append(phase[0])
            heads.append("phase [degree]")
    rows = [
        [f"{order:g}", *(_number(column[i]) for column in columns)]
        for i, order in enumerate(archive["order"].values)
    ]
    yield paragraph("Torque of gas and masses on a throw: the largest amplitude of all throws, "
                    "phase of throw 1 from its firing dead centre.", "note")  # fmt: skip
    yield table(("order", *heads), rows, range(1 + len(heads)))


# ---- what is borne -------------------------------------------------------------------------------


def _largest(archive: xr.Dataset, name: str, limits: Sequence[str] = ()) -> Parts:
    """The largest value of each part over the speed, healthy and with a misfire, and its limits."""
    if name not in archive or not {"disc", "shaft"} & {*archive[name].dims}:
        return
    place = "disc" if "disc" in archive[name].dims else "shaft"
    dims = [str(d) for d in archive[name].dims if d != place and archive.sizes[d] > 1]
    found: dict[str, dict[str, Worst]] = {}
    for case, part in cases(archive):
        for one in worst_of_shaft(part[[name]]):
            found.setdefault(one.place, {})[case] = one
    known = list(dict.fromkeys(case for each in found.values() for case in each))
    bounds = [limit for limit in limits if limit in archive]
    rows = []
    for i, part_name in enumerate(map(str, archive[f"{place}_name"].values)):
        if part_name not in found:
            continue
        cells = [one_line(part_name, 60)]
        for case in known:
            most = found[part_name].get(case)
            places = [None if most is None else most.at.get(k) for k in _axes(case, dims)]
            cells.append("" if most is None else _number(most.value))
            cells += [f"{at:g}" if isinstance(at, int | float) else "" for at in places]
        for limit in bounds:
            values = archive[limit].isel({place: i}).values.astype(float)
            ends = [np.nanmin(values), np.nanmax(values)] if np.isfinite(values).any() else []
            cells.append(" to ".join(dict.fromkeys(_number(float(end)) for end in ends)))
        rows.append(cells)
    heads = [place]
    for case in known:
        heads.append(f"{_head(archive, name)}{', ' if case else ''}{case}")
        heads += ["at rpm" if k == "speed" else "cylinder" if k == "misfire" else k
                  for k in _axes(case, dims)]  # fmt: skip
    heads += [_head(archive, limit) for limit in bounds]
    if rows:
        yield table(heads, rows, range(1, len(heads)))


def _axes(case: str, dims: Sequence[str]) -> list[str]:
    """Axes of which the table of a case tells where the largest value is."""
    return [d for d in dims if d != "misfire" or case.startswith("one")]


def _stresses(archive: xr.Dataset) -> Parts:
    """Stresses by order and synthesised over the speed, with limits and the spread of cylinders."""
    stress, torque = "shaft_stress_half_range", "shaft_torque_half_range"
    limits = ("shaft_stress_limit", "propulsion_stress_limit", "propulsion_stress_limit_passing")
    yield from _largest(archive, stress, limits)
    if stress not in archive:
        yield from _largest(archive, torque, ("shaft_torque_limit",))
    yield from _spread(archive, stress)
    yield from _over_speed(archive)
    yield from drawn(archive, (stress, *limits), "shaft_loads")
    data = archive if "shaft_stress_order" in archive else archive.drop_vars(
        [stress], errors="ignore"
    )  # fmt: skip
    names = ("shaft_stress_order", stress, "critical_speed")
    if "shaft_stress_order" not in archive:
        names = ("shaft_torque_order", torque, "critical_speed")
    yield from drawn(data, names, "shaft_orders")
    yield from worst(archive)


def _spread(archive: xr.Dataset, name: str) -> Parts:
    """How the largest value of each part spreads over sampled designs, as by unequal cylinders."""
    sampled = members_of(archive, "scene").get("sample")
    if not sampled or name not in archive or DESIGN not in archive[name].dims:
        return
    healthy = next(cases(archive))[1][name]
    most = healthy.max([d for d in healthy.dims if d not in (DESIGN, "shaft")])
    values = most.transpose("shaft", DESIGN).values
    rows = [
        [part, *(_number(float(np.nanquantile(one, q))) for q in (0.05, 0.5, 0.95, 1.0))]
        for part, one in zip(_names(archive, "shaft"), values, strict=True)
        if np.isfinite(one).any()
    ]
    drawn_keys = ", ".join(k for k in sampled if k not in ("number", "seed", "method"))
    yield paragraph(
        f"Spread of {_head(archive, name)}, the largest over the speed, over "
        f"{archive.sizes[DESIGN]:,} draws of {drawn_keys}.", "note",
    )  # fmt: skip
    yield table(("shaft", "5 %", "median", "95 %", "largest"), rows, (1, 2, 3, 4))


def _over_speed(archive: xr.Dataset) -> Parts:
    """Table of the synthesis over the speed: free end, crankshaft, other shafts and couplings."""
    told = told_of(archive)
    if archive.sizes.get("speed", 1) < 2 or archive["speed"].dtype.kind not in "fiu":
        return
    columns: list[tuple[str, str, list[int]]] = []
    if "disc_angle_half_range" in archive and "free_end" in told:
        columns.append(("free end [degree]", "disc_angle_half_range", [told["free_end"] - 1]))
    crank = of_crank(archive)
    for name, unit in (("shaft_stress_half_range", "MPa"), ("shaft_torque_half_range", "N m")):
        if name not in archive or "shaft" not in archive[name].dims:
            continue
        shafts = _names(archive, "shaft")
        stressed = [] if name == "shaft_stress_half_range" else [
            one for _, of, places in columns for one in places if of == "shaft_stress_half_range"
        ]  # fmt: skip
        known = np.isfinite(archive[name].values).any(
            axis=tuple(i for i, d in enumerate(archive[name].dims) if d != "shaft")
        )
        left = [i for i in np.flatnonzero(known).tolist() if i not in stressed]
        left = [i for i in left if i < len(shafts) - told.get("dampers", 0)]
        own = [i for i in left if shafts[i] in crank]
        if own and (unit == "MPa" or not stressed):
            columns.append((f"crankshaft [{unit}]", name, own))
        columns += [(f"{shafts[i]} [{unit}]", name, [i]) for i in left
                    if i not in own and "free_end" in told]  # fmt: skip
    if len(columns) < 2:
        return
    apart = [case for case, _ in cases(archive)]
    cells, rank = [], []
    for _, name, places in columns:
        of_cases = []
        for _, part in cases(archive):
            data = part[name].isel({"disc" if "disc" in part[name].dims else "shaft": places})
            of_cases.append(data.max([d for d in data.dims if d != "speed"]).values)
        cells.append(of_cases)
        rank += [int(np.nanargmax(one)) for one in of_cases if np.isfinite(one).any()]
    speeds = archive["speed"].values.astype(float)
    step = -(-speeds.size // MOST_SPEEDS)
    shown = sorted({*range(0, speeds.size, step), *rank}, key=lambda i: speeds[i])
    rows = [
        [f"{speeds[i]:g}",
         *(" / ".join(_number(one[i], 3) for one in of_cases) for of_cases in cells)]
        for i in shown
    ]  # fmt: skip
    said = f", {' / '.join(apart)}" if apart[1:] else ""
    yield paragraph(f"Synthesis over the speed, half ranges{said}; of the crankshaft the largest "
                    "of its shafts.", "note")  # fmt: skip
    yield table(("rpm", *(head for head, *_ in columns)), rows, range(1 + len(columns)))


def _passing(archive: xr.Dataset) -> Parts:
    """The worst of each shaft while the speed passes a range, with limit and verdict."""
    over, torque = "shaft_stress_in_passing_over_limit", "shaft_torque_in_passing"
    ranked = [over, "shaft_stress_in_passing", torque]
    ranked = [n for n in ranked if n in archive and "shaft" in archive[n].dims]
    if not ranked:
        return
    shown = [n for n in (*ranked[::-1], "shaft_stress_limit_in_passing", "speed_in_passing")
             if n in archive]  # fmt: skip
    axes = sorted({str(d) for n in ranked for d in archive[n].dims} - {"shaft"})
    axes = [d for d in axes if archive.sizes[d] > 1]
    rows, worst = [], (-np.inf, "")
    for i, name in enumerate(_names(archive, "shaft")):
        part = archive[shown].isel(shaft=i)
        rank = next((n for n in ranked if np.isfinite(part[n].values).any()), "")
        if not rank:
            continue
        values = part[rank].values
        at = zip(part[rank].dims, np.unravel_index(np.nanargmax(values), values.shape), strict=True)
        here = part.isel(dict(at), missing_dims="ignore")
        cells = [value_text(archive[d], here[d].values[()], None) for d in axes]
        rows.append([name, *(_number(float(here[n])) for n in shown), *cells])
        if rank == over:
            known = shown[-1] == "speed_in_passing"
            speed = f", at {_number(float(here[shown[-1]]))} rpm" if known else ""
            worst = max(worst, (float(here[over]), f"{name}{speed}"))
    if np.isfinite(worst[0]):
        what = "Above" if worst[0] > 1.0 else "Within"
        said = f"{what} the limit in passing: at most {worst[0]:.3g} of it, {worst[1]}."
        yield paragraph(said, "verdict")
    if worst[0] > 1.0 and "speed_ramp" in axes:
        most = archive[over].max([d for d in archive[over].dims if d != "speed_ramp"])
        fine = archive["speed_ramp"].values[most.values <= 1.0]
        said = f"{fine.min():g} rpm/s is enough" if fine.size else "none is enough"
        yield paragraph(f"Of the ramps computed, {said}.")
    yield table(("shaft", *(_head(archive, n) for n in shown), *axes), rows,
                range(1, 1 + len(shown) + len(axes)))  # fmt: skip


def _couplings(archive: xr.Dataset) -> Parts:
    """Torque, twist and heat of couplings and dampers over the speed."""
    crank = of_crank(archive)
    if "shaft" not in archive.dims or "shaft_name" not in archive.coords:
        return
    diameters = {**members_of(archive, "parameters"), **dict.fromkeys(map(str, archive.coords))}
    names = _names(archive, "shaft")
    kept = [
        i for i, name in enumerate(names)
        if name not in crank and f"shaft_diameter_{i + 1}" not in diameters
        and _lossy(archive, i)
    ]  # fmt: skip
    if not kept:
        return
    part = archive.isel(shaft=kept)
    quantities = ("shaft_torque_half_range", "shaft_twist_half_range", "shaft_loss",
                  "damper_heat_per_area", "shaft_torque_min")  # fmt: skip
    for name in quantities:
        yield from _largest(part, name, ("shaft_torque_limit",) if "torque_half" in name else ())
    for name in ("shaft_torque_half_range", "shaft_twist_half_range", "shaft_loss"):
        yield from drawn(part, (name, "shaft_torque_limit"), "shaft_loads")


def _lossy(archive: xr.Dataset, place: int) -> bool:
    """Whether a shaft has a noticeable part of the losses; all have where these are not known."""
    if "shaft_loss" not in archive or "shaft" not in archive["shaft_loss"].dims:
        return True
    loss = archive["shaft_loss"]
    most = loss.max([d for d in loss.dims if d != "shaft"]).values
    return bool(most[place] > 0.02 * np.nanmax(most))


def _free_end(archive: xr.Dataset) -> Parts:
    """Amplitude of the free end by order over the speed, which a torsiograph measures."""
    told, name = told_of(archive), "disc_angle_order"
    if name not in archive or "free_end" not in told or "disc" not in archive[name].dims:
        return
    part = archive.isel(disc=[told["free_end"] - 1])
    yield from drawn(part, (name, "disc_angle_half_range", "critical_speed"), "shaft_orders")
    if "speed" not in part[name].dims:
        return
    healthy = next(cases(part))[1][name]
    most = healthy.max([d for d in healthy.dims if d not in ("order", "speed")])
    values = most.transpose("order", "speed").values
    if not np.isfinite(values).any():
        return
    size = np.nanmax(values, axis=1)
    rows = [
        [f"{part['order'].values[i]:g}", _number(size[i]),
         f"{float(part['speed'].values[int(np.nanargmax(values[i]))]):g}"]
        for i in np.flatnonzero(size >= 0.02 * size.max())
    ]  # fmt: skip
    yield paragraph("Largest amplitude of each order over the speed, healthy; orders of less than "
                    "2 % of the strongest are left out.", "note")  # fmt: skip
    yield table(("order", "amplitude [degree]", "at rpm"), rows, (0, 1, 2))


def _measured(archive: xr.Dataset, torsiogram: xr.Dataset | None) -> Parts:
    """Measured and computed amplitudes and phases of a disc, order by order."""
    if torsiogram is None:
        return
    yield from drawn(torsiogram, [str(name) for name in torsiogram.data_vars], "torsiogram")
    measured, computed, *phases = (
        torsiogram[name].transpose("recording", "order").values for name in TORSIOGRAM
    )
    rpm = torsiogram["omega_mean_measured"].values * 30.0 / np.pi
    largest = measured.max(axis=0)
    rows = []
    for i in np.flatnonzero(largest >= 0.02 * largest.max()):
        at, other = int(np.argmax(measured[:, i])), computed[:, i]
        turned = (phases[0][at, i] - phases[1][at, i] + 180.0) % 360.0 - 180.0
        own = int(np.argmax(np.where(np.isfinite(other), other, -1.0)))
        rows.append([f"{torsiogram['order'].values[i]:g}", _number(largest[i]), f"{rpm[at]:.5g}",
                     _number(other[at]), f"{turned:.1f}" if np.isfinite(turned) else "",
                     _number(other[own]), f"{rpm[own]:.5g}"])  # fmt: skip
    disc = one_line(torsiogram.attrs.get("disc", ""), 60)
    yield paragraph(
        f"Disc {disc}, {rpm.size} recordings or parts of them; each is computed at its own mean "
        "speed. Orders of less than 2 % of the strongest are left out.", "note",
    )  # fmt: skip
    heads = ("order", "measured [degree]", "at rpm", "computed there [degree]",
             "phase, measured less computed [degree]", "largest computed [degree]",
             "at rpm")  # fmt: skip
    yield table(heads, rows, range(len(heads)))


_PARTS: tuple[tuple[str, Callable[[Any], Parts]], ...] = (
    ("The system", _system),
    ("Natural frequencies and modes", _modes),
    ("Vector sums and firing diagram", _vector_sums),
    ("Excitation by order", _excitation),
    ("Stresses and torques", _stresses),
    ("Passing a range of speeds", _passing),
    ("Couplings and dampers", _couplings),
    ("Free end of the crankshaft", _free_end),
)
