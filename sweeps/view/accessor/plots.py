"""Figures of an archive as methods, one for each kind: ``archive.dyn.plot.torque_and_speed()``."""

from __future__ import annotations

import inspect
import io
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING, Any

import xarray as xr

from sweeps.base.errors import SceneError, did_you_mean, shown

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_HELP = """Draw {shows}.

Parameters
----------
ax : matplotlib.axes.Axes, optional
    Draw into this panel of a figure of your own; only where the kind has one panel.
units : str or mapping, optional
    ``{{"brake_power": "hp"}}``; ``"archive"`` keeps the units of the archive. Without it kW, rpm,
    kN, kJ, mm and l where they read better.
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
        if name.startswith("_"):  # notebooks ask for many of these
            raise AttributeError(name)
        from sweeps.view.figures.kinds import KINDS

        kind_of_name = next((kind for kind in KINDS if kind.name == name), None)
        if kind_of_name is None:
            hint = did_you_mean(name, dir(self)) or "."
            raise AttributeError(
                f"figure '{name}': no such kind{hint} Kinds: {', '.join(dir(self))}"
            )

        from sweeps.view.figures import figure, options_of

        signature = _signature(options_of)

        def draw(ax: Axes | None = None, **given: Any) -> Figure:
            signature.bind(ax=ax, **given)  # a wrong keyword is a TypeError that names it
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
    """Return the parameters of a kind: its panel, and all options of figures but the kinds."""
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
    """Return a figure that a notebook shows although it does not belong to pyplot."""
    if not hasattr(figure, "_repr_png_"):
        figure._repr_png_ = partial(_png, figure)  # type: ignore[attr-defined]
    return figure


def _png(figure: Figure) -> bytes:
    """Return a figure as a PNG file."""
    file = io.BytesIO()
    figure.savefig(file, format="png")
    return file.getvalue()
