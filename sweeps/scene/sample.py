"""[sample] of a scene: designs that are drawn from ranges and distributions.

The values are drawn once, when the scene is read, and are columns of [designs] from there on:
everything that holds for a table of designs holds for them, and archives keep them as coordinates.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from engine_dyn.engine import Engine
from engine_dyn.quantities.features.hold import HELD_KEYS
from engine_dyn.types import Floats
from sweeps.base.checks import known_key, plain
from sweeps.base.dimensions import LABELS
from sweeps.base.errors import SceneError, counted, not_known, shown, shown_for_whole
from sweeps.base.files.libraries import library
from sweeps.scene.crossings import exclusive_pair, refused
from sweeps.scene.distributions import Distribution, read_distribution
from sweeps.scene.values import GivenValues
from sweeps.scene.whole_keys import check_of_designs

if TYPE_CHECKING:
    import pandas as pd

METHODS = {
    "sobol": "a scrambled Sobol' sequence",
    "latin_hypercube": "a Latin hypercube",
    "saltelli": "Saltelli's design for Sobol' indices",
}
"""Ways to draw a sample, in words."""

SEARCH = "search"  # Method of archives of a search, whose designs were looked for, not drawn

LARGEST = 1 << 24  # Largest number of designs of one sample

LARGEST_REDUCED = 1 << 30
"""Largest number of designs of a sample that is reduced as it is computed: points of SciPy's Sobol'
sequences."""

PORTION = 1 << 16
"""Designs that are drawn at a time where a sample is reduced as it is computed: four times as many
would save 10 % of the time of the quickest scenes, and take 60 MB more."""

MOST_OF_SOBOL = 50
"""Largest number of parameters with Sobol' sequences. In more dimensions, samples of usual sizes
fill space no better than random numbers do."""

WORDS = LABELS[1:]  # Parameters whose values are texts: one of several, equally likely

_OWN = ("method", "number", "seed")


@dataclass(frozen=True)
class Sample:
    """The table [sample], once it is read."""

    method: str  # One of `METHODS`; `SEARCH` for designs that a search has chosen
    # Number of drawn designs; for `saltelli` of base points, each of which has two designs more
    # than there are parameters.
    number: int
    seed: int  # Seed of the random numbers
    parameters: Mapping[str, Distribution]  # Distribution of each parameter

    @property
    def group(self) -> int:
        """Designs of each point that is drawn."""
        return len(self.parameters) + 2 if self.method == "saltelli" else 1

    @property
    def portion(self) -> int:
        """Points that are drawn at a time where the sample is reduced as it is computed."""
        if self.method == "latin_hypercube":  # All points of a Latin hypercube belong together
            return self.number
        return portion_of(self.number, PORTION // self.group)

    @property
    def words(self) -> str:
        """The draws in words."""
        count = counted(self.number * self.group, "design")
        return f"{count}, {METHODS.get(self.method, 'a search')}, seed {self.seed}"

    @property
    def how(self) -> str:
        """How the designs were chosen, in words."""
        return "found by a search" if self.method == SEARCH else f"drawn as {METHODS[self.method]}"


def portion_of(number: int, about: int) -> int:
    """Largest part of a number of points that divides it and is at most `about`, a power of two.

    Of numbers that only smaller parts divide than a sixteenth of that, the smallest larger part, up
    to four times as many; 0 where there is none.

    Examples
    --------
    >>> portion_of(1 << 20, 1 << 16), portion_of(10**6, 1 << 16), portion_of(65537, 1 << 16)
    (65536, 62500, 65537)
    """
    most = 1 << about.bit_length() - 1
    if number <= most:
        return number
    small = next((n for n in range(most, max(most // 16, 1), -1) if number % n == 0), 0)
    return small or next((n for n in range(most, 4 * most + 1) if number % n == 0), 0)


def with_sample(
    raw: Mapping[str, Any], name: str, columns: Mapping[str, Any] | None = None
) -> tuple[dict[str, Any], Sample | None]:
    """Tables of a scene with the designs that [sample] asks for as [designs], and the sample.

    Without [sample] the tables come back as they are. With `columns`, values that were drawn before
    and that an archive has kept, nothing is drawn. [designs] beside [sample], and parameters of
    [sample] that have values elsewhere, are refused.
    """
    if raw.get("sample") is None:
        return dict(raw), None
    if raw.get("designs") is not None:
        raise refused("[sample]", "[designs]", f"{name}: [sample] and [designs]")
    where = f"{name}: [sample]"
    reduced = raw.get("reduce") is not None
    sample = read_sample(
        raw["sample"], where, words=WORDS, known=columns is not None, reduced=reduced
    )
    for key in sample.parameters:
        for table in ("set", "axes", "solver"):
            inside = raw.get(table)
            if isinstance(inside, Mapping) and key in inside:
                raise SceneError(
                    f"{name}: {key} is in both [{table}] and [sample]; give it in one place"
                )
    tables: dict[str, Any] = {}
    for key, table in raw.items():
        tables[key] = table
        # [designs] gets the place of [sample]: the order of tables decides what varies slowest.
        if key == "sample":
            count = sample.portion if reduced else sample.number
            tables["designs"] = drawn(sample, count) if columns is None else dict(columns)
    return tables, sample


def parameters_of(raw: Mapping[str, Any]) -> list[str]:
    """Names of the parameters that a table [sample] draws."""
    return [key for key in raw if key not in _OWN]


def read_sample(
    raw: Any, where: str, *, words: tuple[str, ...] = (), known: bool = False,
    reduced: bool = False,
) -> Sample:  # fmt: skip
    """Check what a table [sample] asks for; nothing is drawn.

    `where` is the table as messages call it, and `words` are keys beside the parameters that may be
    drawn from lists of texts. `known` says that the values are known, so that a search may have
    chosen them; `reduced` that designs are drawn a portion at a time, so that there may be more.
    """
    if not isinstance(raw, Mapping):
        raise SceneError(f"{where} = {shown(raw)}: must be a table")
    method = raw.get("method", "sobol")
    if not isinstance(method, str) or method not in (*METHODS, *([SEARCH] if known else ())):
        raise SceneError(f"{where} method = {shown(method)}: unknown{not_known(method, METHODS)}")
    parameters = {}
    for key in parameters_of(raw):
        if key not in words:
            check_of_designs(key, f"{where} {key}", where.rpartition(": ")[2])
        node = known_key(key, where, (*words, *_OWN))
        parameters[key] = read_distribution(raw[key], f"{where} {key}", node)
    if not parameters:
        raise SceneError(
            f"{where}: no parameter; at least one is needed, such as inertia = {{ low = 1.0, "
            "high = 12.0 }"
        )
    if method in ("sobol", "saltelli") and len(parameters) > MOST_OF_SOBOL:
        raise SceneError(
            f"{where}: {counted(len(parameters), 'parameter')}; with method = '{method}' there "
            f"must be at most {MOST_OF_SOBOL} (use 'latin_hypercube')"
        )
    if "number" not in raw:
        raise SceneError(
            f"{where}: number is missing; give the number of designs, such as number = 1024"
        )
    seed = raw.get("seed", 1)
    if isinstance(seed, bool) or not isinstance(seed, int) or not 0 <= seed < 1 << 32:
        raise SceneError(
            f"{where} seed = {shown_for_whole(seed)}: must be a whole number from 0 to 4294967295"
        )
    sample = Sample(method, 0, seed, parameters)
    if method == SEARCH:
        return Sample(method, int(raw["number"]), seed, parameters)
    portions = method != "latin_hypercube"
    most = (LARGEST_REDUCED if reduced and portions else LARGEST) // sample.group
    hint = "" if reduced or not portions or not where.endswith("[sample]") else (
        f"; with [reduce], which keeps what is asked and not every design, up to "
        f"{LARGEST_REDUCED // sample.group}"
    )  # fmt: skip
    number = _number(raw["number"], sample, (most, hint), f"{where} number")
    made = Sample(method, number, seed, parameters)
    if reduced and not made.portion:
        near = next(
            n for i in range(1, 1 << 16) for n in (number - i, number + i)
            if portion_of(n, PORTION // made.group)
        )  # fmt: skip
        raise SceneError(
            f"{where} number = {number}: must be a multiple of a number of some ten thousand, of "
            f"which a sample is reduced at a time, such as {near}"
        )
    return made


def _number(raw: Any, sample: Sample, limit: tuple[int, str], where: str) -> int:
    """Check the number of points; `limit` is the largest, and what allows more."""
    most, hint = limit
    if isinstance(raw, float) and raw.is_integer():
        raw = int(raw)
    if isinstance(raw, bool) or not isinstance(raw, int) or not 2 <= raw <= most:
        each = f", of {sample.group} designs each" if sample.group > 1 else ""
        raise SceneError(
            f"{where} = {shown_for_whole(raw)}: must be a whole number from 2 to {most}{each}"
            + hint * (isinstance(raw, int) and raw > most)
        )
    # Confidence intervals of Sobol' indices take the sequence as balanced.
    if sample.method == "saltelli" and raw & (raw - 1):
        below = 1 << int(math.log2(raw))
        raise SceneError(
            f"{where} = {raw}: must be a power of two with method = 'saltelli', such as {below} or "
            f"{2 * below}; otherwise the sequence is not balanced"
        )
    return raw


def drawn(sample: Sample, count: int | None = None) -> dict[str, Any]:
    """Draw a sample, or its first points: see `Drawing`."""
    return Drawing(sample).columns(0, sample.number if count is None else count)


class Drawing:
    """A sample while it is drawn, a range of points at a time.

    Sources: I. M. Sobol' (1967) and A. B. Owen (1998), scrambled sequences; M. D. McKay, R. J.
    Beckman and W. J. Conover (1979), Latin hypercubes; A. Saltelli et al. (2010), the design with
    two independent samples A and B and the mixtures of both.

    Raises
    ------
    SceneError
        Where SciPy is not installed.
    """

    def __init__(self, sample: Sample) -> None:
        self.sample = sample
        self.qmc = library("scipy.stats.qmc", "SciPy", "[sample]", extra="study")
        self.sequence: Any = None
        self.next = 0

    def columns(self, begin: int, count: int) -> dict[str, Any]:
        """Values of each parameter, one for each design of some points.

        The same sample of more points begins with the same values, but for a Latin hypercube.
        """
        positions = self._positions(begin, count)
        return {
            key: distribution.of(np.ascontiguousarray(positions[:, column]))
            for column, (key, distribution) in enumerate(self.sample.parameters.items())
        }

    def _positions(self, begin: int, count: int) -> Floats:
        """Points in the unit cube, one row for each design."""
        many = len(self.sample.parameters)
        if self.sample.method == "latin_hypercube":
            cube = self.qmc.LatinHypercube(many, rng=self.sample.seed)
            return np.asarray(cube.random(self.sample.number))[begin : begin + count]
        if self.sample.method != "saltelli":
            return self._points(many, begin, count)
        points = self._points(2 * many, begin, count)
        a, b = points[:, None, :many], points[:, None, many:]
        mixed = np.where(np.eye(many, dtype=bool), b, a)  # Values of A, with one parameter from B
        return np.concatenate([a, mixed, b], axis=1).reshape(-1, many)

    def _points(self, dimensions: int, begin: int, count: int) -> Floats:
        """Points of a scrambled Sobol' sequence; fastest in order."""
        if self.sequence is None or begin < self.next:
            # Samples for SALib need the keyword `seed`, with which SciPy shuffles in another way
            # than with `rng`; each kind of sample keeps its keyword, and so its values.
            key = "seed" if self.sample.method == "saltelli" else "rng"
            self.sequence = self.qmc.Sobol(dimensions, scramble=True, **{key: self.sample.seed})
            self.next = 0
        if begin > self.next:
            self.sequence.fast_forward(begin - self.next)
        self.next = begin + count
        with warnings.catch_warnings():
            # SciPy warns that only powers of two are balanced; the page on samples says so.
            warnings.filterwarnings("ignore", message="The balance properties of Sobol' points")
            return np.asarray(self.sequence.random(count))


def sample(
    parameters: Mapping[str, Any], number: int, *, method: str = "sobol", seed: int = 1
) -> pd.DataFrame:
    """Draw designs, as the table [sample] of a scene does.

    Parameters
    ----------
    parameters : dict
        Key of each parameter and what it follows, in the units of scenes: ``{"low": 1.0, "high":
        12.0}`` (``"spacing": "log"`` beside them: uniform in the logarithm), ``{"low": 0.3, "mode":
        0.35, "high": 0.45}`` (triangular), ``{"mean": 6.7, "deviation": 0.3, "low": 5.0, "high":
        8.0}`` (truncated normal), or a list of values that are equally likely; of `engine` and
        `arrangement` a list of texts.
    number : int
        Designs; for "saltelli" base points.
    method : str, optional
        "sobol" (balanced if `number` is a power of two), "latin_hypercube" or "saltelli" (for
        Sobol' indices; a power of two).
    seed : int, optional
        Of the random numbers: equal seeds give equal samples.

    Returns
    -------
    pandas.DataFrame
        One row for each design, a column for each parameter: the [designs] of a scene.

    Raises
    ------
    SceneError
        In one line, for unknown keys, ranges that are reversed or outside what a key allows, and
        numbers that the method does not have. Where SciPy or SALib is missing (extra `study`).

    Examples
    --------
    >>> import sweeps
    >>> designs = sweeps.sample({"inertia": {"low": 1.0, "high": 12.0}}, 8)
    >>> len(designs)
    8
    """
    import pandas as pd

    table = {**plain(parameters, "sample"), "method": method, "number": number, "seed": seed}
    return pd.DataFrame(drawn(read_sample(table, "sample", words=WORDS)))


_NUMBERS = ("number", "seed")


def read_uncertainty(
    raw: Mapping[str, Any] | None, values: GivenValues, name: str
) -> Sample | None:
    """Read [uncertainty]: the engine's ranges, and those that the scene gives instead or besides.

    What the scene gives in [set], [axes] or [designs] is taken as known, and so is what that
    replaces, unless its [uncertainty] says otherwise of a value of [set].

    Raises
    ------
    SceneError
        For what is no distribution, for keys that vary along an axis, and where nothing is
        uncertain.
    """
    if raw is None:
        return None
    engine, where = values.engine, f"{name}: [uncertainty]"
    if "method" in raw:
        raise SceneError(f"{where} method: unknown key; draws are a Sobol' sequence")
    own = {key: item for key, item in raw.items() if key not in _NUMBERS}
    for key in own:
        if key in values.axes or key in values.designs:
            place = "axes" if key in values.axes else "designs"
            raise SceneError(f"{where} {key}: varies in [{place}]; give it in one place")
        if key in HELD_KEYS and not values.gives(key):
            raise SceneError(f"{where} {key}: needs the value in [set] that it is uncertain about")
    known = {k: item for k, item in engine.uncertainty.items() if not _given_instead(k, values)}
    if not {**known, **own}:
        raise SceneError(
            f"{where}: no uncertain values: the engine file of {engine.name} gives no ranges for "
            "values left open by the scene; give some here, such as "
            "friction_constant = { low = 0.1, high = 0.2 }"
        )
    check_engine_ranges(engine)
    # 256 draws by default: the ends of a 95 % band are then known within some 5 % of its width.
    table = {"number": 256, **known, **raw}
    return read_sample(table, where)


def _given_instead(key: str, values: GivenValues) -> bool:
    """Whether the scene gives a value of the engine, or parts of the inertia in its place."""
    own = (*values.settings, *values.axes, *values.designs)
    return values.gives(key) or any(exclusive_pair((key, other)) is not None for other in own)


def check_engine_ranges(engine: Engine) -> None:
    """Check the ranges of an engine file, which leaves number and seed to the scene."""
    if not engine.uncertainty:
        return
    where = f"engine {engine.name}: [uncertainty]"
    for key in _NUMBERS:
        if key in engine.uncertainty:
            raise SceneError(f"{where} {key}: must be in the scene")
    read_sample({"number": 2, **engine.uncertainty}, where)
