"""The one error that a person's input can raise, and helpers that word messages."""

from __future__ import annotations

import difflib
import errno
from collections.abc import Iterable, Sequence

NAMED_BADLY = (
    errno.EACCES, errno.EPERM, errno.EROFS, errno.ENOTDIR, errno.EISDIR, errno.ENAMETOOLONG,
    errno.ELOOP, errno.EINVAL,
)  # fmt: skip
"""Errors of the system for a file that the user named badly; others are failures of the disk."""

LONGEST = 4000  # Characters of a message at most

LONGEST_NAME = 300  # Characters of a wrong name for which a similar one is looked for

MOST_LISTED = 40  # Largest number of names that a message lists, where a command lists all of them


class SceneError(ValueError):
    """Bad input of a person: one line that names file, key, value and what is allowed.

    Examples
    --------
    >>> import sweeps
    >>> try:
    ...     sweeps.run(engine="ntua", output={"quantities": ["delt"]})
    ... except sweeps.SceneError as error:
    ...     print("delta" in str(error))
    True
    """

    def __init__(self, message: str) -> None:
        # A name in the input may contain line ends and may have any length.
        line = printable(" ".join(message.splitlines()))
        if len(line) > LONGEST:
            line = f"{line[: LONGEST // 2]} ... {line[-LONGEST // 2 :]}"
        super().__init__(line)


def no_laboratory(error: ModuleNotFoundError) -> str | None:
    """Say that the evaluation of recordings is not installed; None for any other module."""
    if not str(error.name).startswith(("sweeps.lab", "engine_dyn.recordings")):
        return None
    return (
        "the evaluation of recordings (sweeps.lab) is not installed; python -m pip install "
        "--force-reinstall engine-dyn (in a checkout: python -m pip install -e .) installs it"
    )


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return "; did you mean 'inertia'?" for the nearest right name, "" where none is near.

    Case, blanks, hyphens and the order of words do not count as differences, so that 'Max Omega'
    finds 'omega_max'. Where two names begin so, both are named.
    """
    if len(name) > LONGEST_NAME:
        return ""
    plain: dict[str, str] = {}
    for right in known:
        plain.setdefault(right.lower().replace("-", "_"), right)
    wanted = name.strip().lower().replace("-", "_").replace(" ", "_")
    words = sorted(wanted.split("_"))
    close = [plain_name for plain_name in plain if sorted(plain_name.split("_")) == words][:1]
    close = close or difflib.get_close_matches(wanted, plain, n=1, cutoff=0.6)
    if not close and len(wanted) >= 3:
        # For 'recip', a right name that begins so, such as 'reciprocating_mass', is a good guess
        # too, although difflib does not take names of so different lengths for similar.
        close = [plain_name for plain_name in plain if plain_name.startswith(wanted)]
        close = close[: 2 if len(close) == 2 else 1]
    nearest = " or ".join(f"'{plain[plain_name]}'" for plain_name in close)
    return f"; did you mean {nearest}?" if close else ""


def not_known(name: str, known: Iterable[str], *, command: str = "", also: str = "") -> str:
    """Return what follows "unknown key": the nearest right name, and the names that are allowed.

    Parameters
    ----------
    name : str
        The wrong name.
    known : iterable of str
        The right ones.
    command : str
        The command that lists them; it replaces a very long list, and any list where a near name
        is found.
    also : str
        Other values that are allowed.
    """
    names = list(known)
    hint = did_you_mean(name, names)
    if command and (hint or len(names) > MOST_LISTED):
        return f"{hint or '.'} Allowed: see `{command}`{also}"
    return f"{hint or '.'} Allowed: {', '.join(names)}{also}"


def counted(count: int, word: str) -> str:
    """Return "1 row", "2 rows"."""
    return f"{count} {word}{'' if count == 1 else 's'}"


def listed(words: Sequence[str]) -> str:
    """Return "a", "a and b", "a, b and c"."""
    return " and ".join(filter(None, (", ".join(words[:-1]), *words[-1:])))


def size_text(count: float) -> str:
    """Bytes in decimal units."""
    for unit in ("B", "kB", "MB", "GB"):
        if count < 1000.0:
            return f"{count:.3g} {unit}"
        count /= 1000.0
    return f"{count:.3g} TB"


def printable(text: str) -> str:
    """Return a text in which escapes replace unprintable characters, except line ends.

    The contents of files must not control the terminal or reverse the direction of writing, and
    names of files that are not valid text could not be printed at all.
    """
    if text.isprintable():
        return text
    return "".join(
        c if c.isprintable() or c == "\n" else c.encode("unicode_escape").decode() for c in text
    )


def as_name(name: object) -> str:
    """Return a name of a file as it is printed: printable, and line ends in it escaped too."""
    return printable(str(name)).replace("\n", "\\n")


def outside_axis(value: float, values: Iterable[float]) -> str:
    """Return "outside the axis, 1000 to 2000" for a value that is; "" for one on it.

    The ends reach as far beyond their points as half the distance to the next ones: there the end
    is the nearest point as it would be within the axis. An axis of one point has that point alone.
    """
    points = sorted(float(v) for v in values if v == v)
    if not points:
        return "on an axis without values"
    first, last = points[0], points[-1]
    near = 1e-9 * max(abs(first), abs(last))
    below = (points[1] - first) / 2.0 if len(points) > 1 else 0.0
    above = (last - points[-2]) / 2.0 if len(points) > 1 else 0.0
    if first - below - near <= value <= last + above + near:
        return ""
    return f"outside the axis, {first:.12g}" + (f" to {last:.12g}" if last > first else " alone")


def plain_number(text: str) -> float:
    """Convert a text to a number, or raise ValueError; float() accepts more, such as 1_000."""
    if not text.isascii() or "_" in text:
        raise ValueError(text)
    return float(text)


def one_line(text: object, limit: int = 600) -> str:
    """Return a text on one line, truncated where it is longer than the limit."""
    line = printable(" ".join(str(text).split()))
    return line if len(line) <= limit else line[: limit - 3] + "..."


def shown(value: object, limit: int = 60) -> str:
    """Return a value as it would be written in a scene, short enough for a message."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return f"{value:.12g}"
    if isinstance(value, str):
        return one_line(f"'{value}'", limit)
    try:
        return one_line(repr(value), limit)
    except (ValueError, RecursionError):  # A very long integer, or a list that contains itself
        return f"<{type(value).__name__}>"


def shown_for_whole(value: object) -> str:
    """As `shown`, where a whole number is wanted: 1e3 is none, and is shown as 1000.0."""
    return float.__repr__(value) if isinstance(value, float) else shown(value)
