"""Samples of parameters as tables, for programs that want them before or without a scene."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from sweeps.base.checks import plain
from sweeps.scene.sample import WORDS, drawn, read_sample

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["sample"]


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
        "sobol" (a power of two), "latin_hypercube" or "saltelli" (for Sobol' indices).
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
