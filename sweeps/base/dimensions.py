"""Names of the dimensions, labels and published values that scenes add to their quantities.

Scenes, plans and archives use the same names; each stands here alone.
"""

from __future__ import annotations

import contextlib
import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

from sweeps.base.errors import SceneError, not_known, outside_axis, shown
from sweeps.base.files.numbers_with_units import factor_between, number_with_unit
from sweeps.base.ratios import number_or_ratio

if TYPE_CHECKING:
    import xarray as xr

DESIGN = "design"  # Dimension of [designs]: parameters that vary together

ARRANGEMENT = "arrangement"  # Dimension of [axes] arrangement, an axis of words

ENGINE = "engine"  # Dimension of [axes] engine, an axis of words

FIRING_PATTERN = "firing_pattern"  # Dimension of [axes] firing_pattern, an axis of words

COUNTED = ("throw", "bay", "piston", "main_bearing", "mount", "cylinder")
"""Dimensions whose points are parts of an engine, between which there is nothing."""

POLAR = {
    ("tangential", "radial"): "in axes that turn with the crank",
    ("x", "y"): "in axes of the engine",
    ("side", "down"): "in axes of the engine",
}
"""Endings of two variables that are the components of one load: to the right, and up."""

METHOD, INERTIA_MODEL = "method", "inertia_model"
"""Dimensions of [solver] method and inertia_model where they are lists: axes of words."""

NOT_CHOSEN = (
    "speed", "load", "characteristic_share", "held_torque", "held_power", "recorded_cycle",
    "cycle_number", "misfire", "wanted_delta", METHOD, INERTIA_MODEL, "truncation",
)  # fmt: skip
"""Axes and columns that do not belong to a design: operating points, recorded cycles, misfires,
what is wanted of the design and how it is computed. A search takes none of their values for the
best one unless it is asked to."""


class WordAxis(NamedTuple):
    """A dimension whose points are words, or a column of [designs] that holds texts."""

    # Name and long name in archives.
    name: str
    long_name: str
    column: bool = True  # Whether [designs] may have a column of this name
    title: str = ""  # Text before a word in titles of figures, such as "firing pattern "


WORD_AXES = {
    one.name: one
    for one in (
        WordAxis("case", "name of the design"),
        WordAxis(ENGINE, "engine"),
        WordAxis(ARRANGEMENT, "arrangement of the cylinders"),
        WordAxis(FIRING_PATTERN, "firing pattern", title="firing pattern "),
        WordAxis(METHOD, "method of the periodic speed", column=False),
        WordAxis(INERTIA_MODEL, "model of the moment of inertia", column=False),
    )
}
"""Axes of words by name. `sweeps.scene.axes` says what scenes may write for them."""

LABELS = tuple(name for name, axis in WORD_AXES.items() if axis.column)
"""Columns of [designs] that hold texts: the name of each design, its engine, arrangement and firing
pattern."""

PARAMETER = "parameter"
"""Dimension of elasticities: keys of the parameters that derivatives are taken by."""

UNCERTAIN = "uncertain_parameter"
"""Dimension of shares of an uncertainty: keys of the parameters that are not well known."""

PUBLISHED = "_published"
"""Ending of the variables that hold a scene's [reference], after a quantity's name."""

ELASTICITY = "_elasticity"  # Ending of the names of elasticities, which lie over `PARAMETER`

LOW, HIGH, EXPLAINED, SHARE = "_low", "_high", "_explained", "_share"
"""Endings of the variables on the uncertainty of a quantity: ends of its band, linear part of the
variance, and shares of the parameters, over `UNCERTAIN`."""

OF_ORDERS = "firing_orders"
"""Attribute of archives of all firing orders of an engine: how they were chosen, and their number,
as JSON."""

OF_PATTERNS = "firing_patterns"
"""Attribute of archives of firing patterns of a density: how they were ranked, as JSON."""

REDUCTION = "reduction"
"""Attribute of archives that hold results of all designs together, in place of each: the [reduce]
of the scene and the results of its searches, as JSON."""

RANK, STATE = "rank", "reduction_state"
"""Variables of archives with [reduce]: the rank of each kept design by each search, and what
`merge` needs, as a ZIP file of NumPy's arrays."""

FAILED_DRAWS = "failed_draws"
"""Variable that counts the draws of uncertain values in which a design has no result."""

GENERATION, RESTART, FOUND, FULFILLING = "generation", "restart", "found", "fulfilling"
"""Columns of designs that a search computed: generation and restart in which it came to each,
whether it is a result, and whether it fulfils the conditions."""

SEARCHED = (GENERATION, RESTART, FOUND, FULFILLING)

STATUS, TORSION_STATUS, NONLINEAR_STATUS = "status", "torsion_status", "nonlinear_status"
PASSING_STATUS, PERIODIC_STATUS = "passing_status", "periodic_status"
OUTCOMES = (STATUS, TORSION_STATUS, NONLINEAR_STATUS, PASSING_STATUS, PERIODIC_STATUS)
"""Variables with the outcome of each design: of its speed, of the vibration of its shaft, of that
with couplings that are not linear, of that while it passes a range of speeds, and of the periodic
speed beside one that is followed in time."""

OWN_UNITS = "units_of_archive"
"""Attribute of variables that are converted for people: their unit in the archive, in which numbers
without a unit are taken."""

COMPARED = "_compared"
"""Ending of the variables of a second archive that is compared with the first."""


def words_of(archive: xr.Dataset) -> dict[str, str]:
    """Coordinates of words: by which name a value of each is given."""
    return {
        str(name).removesuffix("_name") if f"{coordinate.dims[0]}_name" == name else str(name): str(
            name
        )
        for name, coordinate in archive.coords.items()
        if coordinate.ndim == 1 and coordinate.dtype.kind in "UOT"
    }


def selected_places(archive: xr.Dataset, values: Mapping[str, float | str]) -> dict[str, list[int]]:
    """Find values along their axes: labels, positions such as "#2", or the nearest numbers.

    Parameters
    ----------
    archive : Dataset
        An archive.
    values : mapping of str to float or str
        Of axes, and of columns of words along one. Of words the label itself: 110 and "110" both
        mean the one that is written so. Only where no label is written so, "#2" is the second
        place. Of numbers the value (`axis_number`).

    Returns
    -------
    dict of list of int
        Places along each dimension: one, or those of all designs of the labels.

    Raises
    ------
    SceneError
        For a name that is no axis, labels that there are not, what is no number of the axis, and an
        axis that is selected twice.
    """
    places: dict[str, list[int]] = {}
    labelled: set[str] = set()
    for name, value in values.items():
        dimension, of_axis = _places_of(archive, name, value)
        both_labels = name != dimension and dimension in labelled
        if dimension in places and not both_labels:
            raise SceneError(
                f"{name}: the axis {dimension} is selected twice; give one value of it"
            )
        if both_labels:
            of_axis = [place for place in of_axis if place in places[dimension]]
            if not of_axis:
                raise SceneError(
                    f"{name} = {shown(value)}: no design has this value together with the others"
                )
        if name != dimension:
            labelled.add(dimension)
        places[dimension] = of_axis
    return places


def _places_of(archive: xr.Dataset, name: str, value: float | str) -> tuple[str, list[int]]:
    import numpy as np  # Imported here, so that `engine-dyn --help` does not load NumPy

    words = words_of(archive)
    if name in words:
        column = archive[words[name]]
        return str(column.dims[0]), _places_of_label(name, value, column.values)
    axes = [str(d) for d in archive.dims if d in archive.coords]
    if name not in axes:
        known = [*words, *(a for a in axes if a not in words)]
        raise SceneError(f"{name}: not an axis of the archive{not_known(name, known)}")
    number = axis_number(archive, name, value)
    distances = np.abs(archive[name].values - number)
    return name, [int(np.argmin(np.where(np.isnan(distances), np.inf, distances)))]


def axis_number(archive: xr.Dataset, name: str, value: float | str) -> float:
    """Return a value of an axis of numbers, in the unit of its coordinate.

    It may be a fraction such as "1/200", have a unit, such as "110 kW", or be "none", which is no
    misfire in figures too. A number without a unit is in that of the archive, also where the
    coordinate was converted since. SceneError refuses anything else, and names the unit.
    """
    attributes = archive[name].attrs
    unit = str(attributes.get("units", "")) or "1"
    own = str(attributes.get(OWN_UNITS, unit))
    number: Any = getattr(value, "item", lambda: value)()  # Also of NumPy's own numbers
    if name == "misfire" and value == "none":
        number = 0
    elif isinstance(value, str):
        with contextlib.suppress(ValueError):
            number = number_or_ratio(value)
    return number_with_unit(number, name, own) * (factor_between(own, unit) or 1.0)


def number_inside(archive: xr.Dataset, name: str, value: float | str) -> tuple[float, str]:
    """As `axis_number`, with the unit behind the number; SceneError also for one outside."""
    unit = str(archive[name].attrs.get("units", "1"))
    number, unit = axis_number(archive, name, value), f" {unit}" if unit not in ("", "1") else ""
    outside = outside_axis(number, archive[name].values)
    if outside:
        raise SceneError(f"{name} = {number:.12g}{unit}: {outside}{unit}")
    return number, unit


def _places_of_label(name: str, value: float | str, labels: Any) -> list[int]:
    texts = [str(text) for text in labels]
    written = [value] if isinstance(value, str) else [str(value), shown(value)]
    for text in written:
        places = [place for place, label in enumerate(texts) if label == text]
        if places:
            return places
    # The text "#2" means the second value of an axis of words; a number without the sign means the
    # label that is written like it.
    position = re.fullmatch(r"#(\d{1,9})", written[-1], flags=re.ASCII)
    if position is None:
        known = list(dict.fromkeys(texts))
        also = "; '#2' is the second of them" if len(texts) > 1 else ""
        raise SceneError(f"{name} = {shown(value)}: unknown{not_known(written[-1], known)}{also}")
    if not 1 <= int(position[1]) <= len(texts):
        raise SceneError(
            f"{name} = {shown(value)}: there is no such place; must be '#1' to '#{len(texts)}'"
        )
    return [int(position[1]) - 1]
