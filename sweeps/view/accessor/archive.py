"""The accessor of datasets: search, tables, files and figures of one archive."""

from __future__ import annotations

import inspect
import io
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from sweeps.base.errors import SceneError, did_you_mean, printable, shown
from sweeps.base.naming import meaning_of

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from sweeps.decide.explore.barred import Barred
    from sweeps.decide.explore.export import Exported


@xr.register_dataset_accessor("dyn")
class ArchiveAccessor:
    """Methods of `sweeps` on an archive: ``archive.dyn``.

    `plot` draws its figures, `show` and `table` give numbers, `best`, `show_best` and `pareto` find
    designs, `barred_ranges` finds speeds at which a shaft is above a limit, `status_words` and
    `outcomes` tell what became of designs, `to_excel` and `export` write files.

    Examples
    --------
    >>> import sweeps
    >>> archive = sweeps.run("first")
    >>> archive.dyn.outcomes
    {'converged': 75}
    >>> found = archive.dyn.best(least="inertia", within="delta <= 1/50", at_every="load")
    >>> float(found.inertia)
    12.0
    >>> archive.dyn.plot.numbers(quantities="delta").savefig("delta.png")
    """

    def __init__(self, archive: xr.Dataset) -> None:
        self._archive = archive
        self.plot = Plots(archive)  # No property, because completion of names does not call these

    def __repr__(self) -> str:
        from sweeps.base.errors import one_line

        methods = ", ".join(name for name in dir(self) if not name.startswith("_"))
        title = one_line(self._archive.attrs.get("title", ""), 60)
        return f"<archive.dyn of '{title}': {methods}>"

    @property
    def status_words(self) -> xr.DataArray:
        """Outcome of each design in words, on the dimensions of `status`.

        Raises
        ------
        SceneError
            For an archive of which no design can fail: it has no `status`.

        Examples
        --------
        >>> import sweeps
        >>> archive = sweeps.run("first")
        >>> str(archive.dyn.status_words.values[0, 0])
        'converged'
        """
        from engine_dyn.status import MEANINGS

        if "status" not in self._archive:
            raise SceneError(
                "status_words: the archive has no status, because none of its designs can fail"
            )
        codes = self._archive["status"]
        words = codes.copy(data=np.array(MEANINGS)[codes.values.astype(np.int64)])
        words.attrs = {"long_name": meaning_of(codes.attrs, "outcome")}
        return words.rename("status_words")

    @property
    def outcomes(self) -> dict[str, int]:
        """Number of designs of each outcome; empty where no design can fail.

        Examples
        --------
        >>> import sweeps
        >>> archive = sweeps.run("first")
        >>> archive.dyn.outcomes
        {'converged': 75}
        """
        from sweeps.view.texts.archives import outcome_counts

        return outcome_counts(self._archive)

    @property
    def load(self) -> xr.DataArray:
        """Loads of the archive [percent]: ``archive.load`` is a method of xarray.

        Raises
        ------
        SceneError
            For an archive without loads.

        Examples
        --------
        >>> import sweeps
        >>> archive = sweeps.run("first")
        >>> archive.dyn.load.values.tolist()
        [20.0, 50.0, 80.0]
        """
        if "load" not in self._archive.variables:
            raise SceneError("load: the archive has no axis and no quantity of this name")
        return self._archive["load"]

    def best(
        self, *, least: str | None = None, most: str | None = None,
        within: str | Sequence[str] = (), at_every: str | Sequence[str] = (),
        not_counted: str | Sequence[str] = (),
    ) -> xr.Dataset:  # fmt: skip
        """Find the design with the least, or most, of a quantity; see `sweeps.best`.

        Examples
        --------
        >>> import sweeps
        >>> archive = sweeps.run("first")
        >>> best = archive.dyn.best(least="delta", within="inertia <= 6", at_every="load")
        >>> round(float(best.inertia), 3)
        6.0
        """
        from sweeps.decide.explore.search import best

        return best(
            self._archive, least=least, most=most, within=within, at_every=at_every,
            not_counted=not_counted,
        )  # fmt: skip

    def show_best(
        self, *, least: str | None = None, most: str | None = None,
        within: str | Sequence[str] = (), at_every: str | Sequence[str] = (),
        not_counted: str | Sequence[str] = (), quantities: str | Sequence[str] | None = None,
        units: str | Mapping[str, str] | None = None,
    ) -> None:  # fmt: skip
        """Print which design is the best and what decides it, as ``engine-dyn best`` does.

        The parameters are those of `best`, and `quantities` and `units` those of `show`.

        Examples
        --------
        >>> import sweeps
        >>> archive = sweeps.run("first")
        >>> archive.dyn.show_best(least="inertia", within="delta <= 1/50", at_every="load")
        ... # doctest: +ELLIPSIS
        least inertia = 12 kg m²
        conditions at every load, each with its worst value:
          delta <= 1/50: 1/51.13 at load = 80 %, a margin of 2.2 %
        ...
        """
        from sweeps.base.arguments import names_given
        from sweeps.decide.explore.search import search_best
        from sweeps.view.texts.optimised import best_text

        found = search_best(
            self._archive, least=least, most=most, within=within, at_every=at_every,
            not_counted=not_counted,
        )  # fmt: skip
        names = None if quantities is None else names_given(quantities, "quantities")
        with said_in_python():
            text = best_text(self._archive, found, names, units_text(units), python=True)
        print(printable(text))

    def pareto(
        self, first: str, second: str, *more: str, most: str | Sequence[str] = (),
        within: str | Sequence[str] = (), at_every: str | Sequence[str] = (),
        not_counted: str | Sequence[str] = (),
    ) -> xr.Dataset:  # fmt: skip
        """Find the designs that no other beats in all quantities; see `sweeps.pareto`.

        Examples
        --------
        >>> import sweeps
        >>> archive = sweeps.run("first")
        >>> archive.dyn.pareto("inertia", "delta", at_every="load").inertia.size
        25
        """
        from sweeps.decide.explore.search import pareto

        return pareto(
            self._archive, first, second, *more, most=most, within=within, at_every=at_every,
            not_counted=not_counted,
        )  # fmt: skip

    def barred_ranges(self, *, threads: int | None = None, progress: bool = False) -> Barred:
        """Find the speeds at which a shaft is above a limit; see `sweeps.barred_ranges`.

        Examples
        --------
        >>> import sweeps
        >>> archive = sweeps.run(
        ...     engine="diesel_105x137",
        ...     shaft="diesel_105x137",
        ...     set={"shaft_stress_limit_8": 60},
        ...     axes={"speed": [2000, 2300]},
        ...     output={"quantities": ["shaft_stress_over_limit"]},
        ... )
        >>> [round(one.at, -1) for one in archive.dyn.barred_ranges().ranges]
        [2170.0]
        """
        from sweeps.decide.explore.barred import barred_ranges

        return barred_ranges(self._archive, threads=threads, progress=progress)

    def nearest(self, **values: float | str) -> xr.Dataset:
        """Take the nearest values of axes: ``nearest(speed=1500)``; see `sweeps.nearest`.

        Examples
        --------
        >>> import sweeps
        >>> archive = sweeps.run("first")
        >>> float(archive.dyn.nearest(load=45)["load"])
        50.0
        """
        from sweeps.decide.explore.opening import nearest

        return nearest(self._archive, **values)

    def table(
        self, *, select: Mapping[str, float | str] | None = None,
        quantities: str | Sequence[str] | None = None, sort: str | None = None, limit: int = 20,
        relative_to: Mapping[str, float | str] | str | None = None,
        units: str | Mapping[str, str] | None = None,
    ) -> pd.DataFrame:  # fmt: skip
        """Return designs as a DataFrame, one in each row, in the units of the archive.

        Parameters
        ----------
        select : mapping, optional
            Values of axes, of which the nearest are taken: ``{"load": 50}``.
        quantities : str or sequence of str, optional
            If not given, all that have one number for each design. Those over bearings, cylinders,
            orders or directions have a row for each of these.
        sort : str, optional
            A column, the smallest first; ``"-delta"``: the largest first.
        limit : int
            Most rows.
        relative_to : mapping or "nominal", optional
            A design: quantities are changes from it in percent. ``{}`` is the first one.
        units : str or mapping, optional
            Units of columns in place of those of the archive: ``{"brake_power": "hp"}``.

        Raises
        ------
        SceneError
            For names that the archive does not have, and units that do not fit.

        Examples
        --------
        >>> import sweeps
        >>> archive = sweeps.run("first")
        >>> table = archive.dyn.table(sort="delta", limit=2)
        >>> table["load"].tolist()
        [20.0, 20.0]
        """
        import pandas as pd

        from sweeps.decide.explore.rows import rows
        from sweeps.view.texts.readable_units import asked_units, factor

        shown = rows(self._archive, select=select, quantities=quantities, sort=sort, limit=limit,
                     relative_to=relative_to)  # fmt: skip
        known = {name: unit for name, unit in shown.units.items() if name not in shown.changes}
        with said_in_python():
            asked = asked_units(units_text(units), known)
        table = {n: v * factor(known[n], asked[n]) if n in asked else v
                 for n, v in shown.table.items()}  # fmt: skip
        return pd.DataFrame(table)

    def show(
        self, *, select: Mapping[str, float | str] | None = None,
        quantities: str | Sequence[str] | None = None, sort: str | None = None, limit: int = 20,
        relative_to: Mapping[str, float | str] | str | None = None,
        units: str | Mapping[str, str] | None = None,
    ) -> None:  # fmt: skip
        """Print designs as a table in readable units, as ``engine-dyn show`` does.

        The parameters are those of `table`; `units` are those of columns, such as
        ``{"brake_power": "hp"}`` or ``"archive"`` for those of the archive.

        Examples
        --------
        >>> import sweeps
        >>> archive = sweeps.run("first")
        >>> archive.dyn.show(select={"inertia": 6}, quantities="delta")
        ... # doctest: +ELLIPSIS, +NORMALIZE_WHITESPACE
        at inertia = 6
        ...
        load 20 50 80 % ...
        delta 0.02170 0.03114 0.03923 ...
        """
        from sweeps.decide.explore.rows import rows
        from sweeps.view.texts.sensitivities import has_indices, sensitivities_text
        from sweeps.view.texts.tables import rows_text

        asked = (select, quantities, sort, relative_to)
        if has_indices(self._archive) and all(one is None for one in asked):
            print(printable(sensitivities_text(self._archive)))
            return
        shown = rows(
            self._archive, select=select, quantities=quantities, sort=sort, limit=limit,
            relative_to=relative_to,
        )  # fmt: skip
        with said_in_python():
            text = rows_text(shown, units_text(units), python=True)
        print(printable(text))

    def to_excel(
        self, path: str | Path, *, quantities: str | Sequence[str] | None = None,
        overwrite: bool = False,
    ) -> Exported:  # fmt: skip
        """Write an Excel file: results, axes, assumptions and provenance; see `sweeps.export`.

        Raises
        ------
        SceneError
            For a path that does not end with .xlsx, and as `sweeps.export`.

        Examples
        --------
        >>> import sweeps
        >>> archive = sweeps.run("first")
        >>> archive.dyn.to_excel("archive.xlsx", quantities="delta").rows
        75
        """
        from sweeps.base.arguments import a_path

        if a_path(path, "path").suffix.lower() != ".xlsx":
            raise SceneError(f"{path}: must end with .xlsx; `export` writes other kinds")
        return self.export(path, quantities=quantities, overwrite=overwrite)

    def export(
        self, path: str | Path, *, quantities: str | Sequence[str] | None = None,
        orders: str | None = None, overwrite: bool = False, head_units: bool = False,
        digits: int | str | None = None,
    ) -> Exported:  # fmt: skip
        """Write a table (.csv, .parquet, .xlsx) or curves (.uff, .fmu); see `sweeps.export`.

        Examples
        --------
        >>> import sweeps
        >>> archive = sweeps.run("first")
        >>> archive.dyn.export("table.csv", head_units=True).rows
        75
        """
        from sweeps.decide.explore.export import export

        return export(
            self._archive, path, quantities=quantities, orders=orders, overwrite=overwrite,
            head_units=head_units, digits=digits,
        )  # fmt: skip

    def report(
        self, path: str | Path, *, limit: float = 20e6,
        units: str | Mapping[str, str] | None = None, target: str | Sequence[str] = (),
        not_counted: str | Sequence[str] = (), torsiogram: xr.Dataset | None = None,
        overwrite: bool = False,
    ) -> Path:  # fmt: skip
        """Write one HTML file with tables, figures and an explorer; see `sweeps.report`.

        Examples
        --------
        >>> import sweeps
        >>> archive = sweeps.run("first")
        >>> archive.dyn.report("report.html").name
        'report.html'
        """
        from sweeps.base.arguments import a_path
        from sweeps.view.report.page import report

        with said_in_python():
            return report(
                self._archive, a_path(path, "path"), limit=limit, units=units_text(units),
                target=target, not_counted=not_counted, torsiogram=torsiogram, overwrite=overwrite,
            )  # fmt: skip

    def explore(self, *, units: str | Mapping[str, str] | None = None) -> Any:
        """Return an explorer for a notebook: sliders of all axes, a line, a map, curves.

        Only what is drawn is read: the archive may be larger than memory. Needs the extra
        `explore`; the object is one of Panel.

        Raises
        ------
        SceneError
            Where Panel is not installed, for units that do not fit, and without numbers.

        Examples
        --------
        >>> import sweeps
        >>> archive = sweeps.run("first")
        >>> explorer = archive.dyn.explore(units={"torque_mean": "kN m"})
        """
        from sweeps.view.report.explore import explore

        with said_in_python():
            return explore(self._archive, units=units_text(units))


_HELP = """Draw {shows}.

Parameters
----------
ax : matplotlib.axes.Axes, optional
    Draw into this panel of a figure of your own; only where the kind has one panel.
units : str or mapping, optional
    ``{{"brake_power": "hp"}}``; ``"archive"`` keeps the units of the archive. Without it kW, rpm,
    kN, kJ, mm and l.
{options}

Returns
-------
matplotlib.figure.Figure
    The first figure of the kind; ``archive.dyn.plot("{name}")`` gives all. A notebook shows it,
    ``savefig`` writes it.

Raises
------
SceneError
    Where the archive does not give this kind, and for options that do not fit.
"""


class _NoKind(SceneError, AttributeError):
    """No such kind of figure: an error as of wrong options, which `hasattr` and `dir` know too."""


class Plots:
    """Figures of an archive: each kind is a method, and ``archive.dyn.plot()`` draws all.

    Its text lists what this archive gives, and what the other kinds need.

    Examples
    --------
    >>> import sweeps
    >>> archive = sweeps.run("first")
    >>> figure = archive.dyn.plot.numbers(quantities="delta", target="delta=1/50")
    >>> figure.axes[0].get_xlabel().startswith("Moment of inertia")
    True
    >>> figure.savefig("delta.svg")
    """

    def __init__(self, archive: xr.Dataset) -> None:
        self._archive = archive

    def __repr__(self) -> str:
        from sweeps.view.figures.drawing import kinds_text

        return kinds_text(self._archive)

    def __dir__(self) -> list[str]:
        from sweeps.view.figures.kinds import KINDS

        return [kind.name for kind in KINDS]

    def __getattr__(self, name: str) -> Callable[..., Figure]:
        if name.startswith("_"):  # Notebooks ask for many such names, as _repr_html_
            raise AttributeError(name)
        from sweeps.view.figures.kinds import KINDS

        kind_of_name = next((kind for kind in KINDS if kind.name == name), None)
        if kind_of_name is None:
            hint = did_you_mean(name, dir(self)) or "."
            raise _NoKind(f"figure '{name}': no such kind{hint} Kinds: {', '.join(dir(self))}")

        from sweeps.view.figures import figure, options_of

        signature = _signature(options_of)

        def draw(ax: Axes | None = None, **given: Any) -> Figure:
            signature.bind(ax=ax, **given)  # A wrong keyword gives a TypeError that names it
            if ax is not None and not hasattr(ax, "get_figure"):
                raise SceneError(f"ax = {shown(ax)}: must be an Axes of matplotlib")
            archive = self._readable(given.pop("units", None))
            drawn = figure(archive, name, options_of(**given), ax)
            return _shown(drawn) if ax is None else drawn

        draw.__name__ = draw.__qualname__ = name
        draw.__signature__ = signature  # type: ignore[attr-defined]
        options = inspect.cleandoc(options_of.__doc__ or "")
        options = options.partition("----------\n")[2].partition("\n\nReturns")[0]
        options = "quantities :" + options.partition("quantities :")[2]
        draw.__doc__ = _HELP.format(shows=kind_of_name.shows, options=options, name=name)
        return draw

    def __call__(
        self,
        only: str | Iterable[str] = (),
        *,
        units: str | Mapping[str, str] | None = None,
        **options: Any,
    ) -> dict[str, Figure]:
        """Draw all figures, or all of some kinds; by the names that their files would have.

        The keywords are those of the single kinds.

        Examples
        --------
        >>> import sweeps
        >>> archive = sweeps.run("first")
        >>> sorted(archive.dyn.plot("numbers", size="160x100"))[:2]
        ['brake_power_load', 'delta_inertia']
        """
        from sweeps.view.figures import figures, options_of

        drawn = figures(self._readable(units), options_of(only=only, **options))
        return {name: _shown(one) for name, one in drawn.items()}

    def _readable(self, units: str | Mapping[str, str] | None) -> xr.Dataset:
        from sweeps.view.texts.readable_dataset import readable_dataset

        with said_in_python():
            return readable_dataset(self._archive, units_text(units))


@contextmanager
def said_in_python() -> Iterator[None]:
    """Let messages about options of the command name the keyword of Python: units, not --units."""
    try:
        yield
    except SceneError as error:
        raise SceneError(str(error).removeprefix("--")) from None


def _signature(options_of: Callable[..., Any]) -> inspect.Signature:
    """Signature of a kind of figure: its panel, and all options of figures but the kinds."""
    first = inspect.Parameter("ax", inspect.Parameter.POSITIONAL_OR_KEYWORD, default=None)
    units = inspect.Parameter("units", inspect.Parameter.KEYWORD_ONLY, default=None)
    given = inspect.signature(options_of).parameters
    return inspect.Signature([first, units, *(p for n, p in given.items() if n != "only")])


def units_text(units: str | Mapping[str, str] | None) -> str | None:
    """Units of quantities as the command takes them: ``brake_power=hp,speed=rpm``."""
    if isinstance(units, Mapping):
        return ",".join(f"{name}={unit}" for name, unit in units.items()) or None
    return units


def _shown(figure: Figure) -> Figure:
    """A figure that a notebook shows although it does not belong to pyplot."""
    if not hasattr(figure, "_repr_png_"):
        figure._repr_png_ = partial(_png, figure)  # type: ignore[attr-defined]
    return figure


def _png(figure: Figure) -> bytes:
    """A figure as a PNG file."""
    file = io.BytesIO()
    figure.savefig(file, format="png")
    return file.getvalue()
