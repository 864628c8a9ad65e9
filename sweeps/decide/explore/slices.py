"""Slices of archives, nearest to values of their axes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sweeps.base.axis_places import selected_places
from sweeps.base.checks import check_dataset

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["nearest"]


def nearest(archive: xr.Dataset, **values: float | str) -> xr.Dataset:
    """Slice of an archive, nearest to values of its axes.

    Parameters
    ----------
    archive : Dataset
        As `open` or `run` returns it.
    **values : float or str
        A value of each axis to be cut, in the units of the archive, a fraction such as "1/200", or
        a word of an axis of words: `nearest(archive, load=50, method="newton")`. Of equally near
        values the first is taken. A word that looks like a number means itself: of the firing
        patterns "1" and "110", 1 is the first and 110 the second, wherever they stand; ``"#2"`` is
        the second place of an axis of words. Designs may also be named, `case="B"`,
        `engine="ntua"`: where several have that label, all of them stay.

    Returns
    -------
    Dataset
        With the coordinates of what was taken.

    Raises
    ------
    SceneError
        For a name that is no axis, and for values that are neither numbers nor words of the axis.

    Examples
    --------
    >>> import sweeps
    >>> archive = sweeps.run(
    ...     engine="ntua",
    ...     axes={"inertia": [5, 20, 40], "speed": [1200, 1500]},
    ...     output={"quantities": ["delta", "torque_mean"]},
    ... )
    >>> one = sweeps.nearest(archive, inertia=18, speed=1510)
    >>> float(one.inertia), float(one.speed)
    (20.0, 1500.0)
    """
    check_dataset(archive)
    places = selected_places(archive, values)
    return archive.isel({d: found[0] if len(found) == 1 else found for d, found in places.items()})
