"""Lists searched by words: the names of one thing find the same lines, near spellings are told."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from sweeps.base.errors import SceneError, shown

__all__ = ["SAME", "Found", "found_lines", "named_by", "same_words"]

SAME: tuple[tuple[str, ...], ...] = (
    ("piston pin", "gudgeon pin", "wrist pin", "small end", "gudgeon", "wrist"),
    ("connecting rod", "con rod", "conrod", "rod"),
    ("crank pin", "crankpin", "big end"),
    ("main journal", "main bearing"),
)
"""Names of one thing: each finds whatever has any of them. Longer names stand before those within.
"""

_NAMES = tuple((re.compile(rf"\b(?:{'|'.join(n)})s?\b"), n[0].replace(" ", "")) for n in SAME)
"""What finds the names of each thing, and the one word that stands for it."""


@dataclass(frozen=True)
class Found:
    """Names that words lead to.

    Attributes
    ----------
    names : list of str
        In the order of the list, one that is exactly what was typed first.
    note : str
        What was not found and which word was searched in its place; empty where all were found.
    """

    names: list[str]
    note: str = ""


def named_by(words: str, texts: Mapping[str, str]) -> list[str]:
    """Return the names in a list that words lead to, one that is exactly what was typed first.

    Parameters
    ----------
    words : str
        Each must begin a word of a text; no words find all.
    texts : mapping of str to str
        What each name is found by, beside itself.
    """
    parts = _typed(words)
    names = [name for name, text in _searched(texts).items() if _begin(parts, text)]
    return sorted(names, key=lambda name: not same_words(name, words))


def same_words(name: str, words: str) -> bool:
    """Whether words are a name, written with underscores, hyphens or blanks."""
    return _plain(name) == _plain(words)


def found_lines(words: str, texts: Mapping[str, str], of: str) -> Found:
    """Return what `named_by` finds; where that is nothing, what the nearest spellings find.

    Parameters
    ----------
    words, texts
        As for `named_by`.
    of : str
        The list, as the command names it.

    Raises
    ------
    SceneError
        Where nothing is found.
    """
    names = named_by(words, texts)
    if names:
        return Found(names)
    known = {part for text in _searched(texts).values() for part in text.split()}
    near = {part: _nearest(part, known) for part in _typed(words)}
    if all(near.values()):
        names = named_by(" ".join(near.values()), texts)
    if not names:
        raise SceneError(f"list {of} {shown(words)}: nothing found; engine-dyn list {of} lists all")
    said = "; ".join(
        f"nothing found for '{part}'; did you mean '{meant}'?"
        for part, meant in near.items()
        if part != meant
    )
    return Found(names, f"{said} This is what that finds:")


def _plain(text: str) -> str:
    """Words in small letters with single blanks between them."""
    return " ".join(re.findall(r"[^\W_]+", text.lower()))


def _typed(words: str) -> list[str]:
    """Words as they are searched: one for a name of several words."""
    text = _plain(words)
    for names, word in _NAMES:
        text = names.sub(word, text)
    return text.split()


def _searched(texts: Mapping[str, str]) -> dict[str, str]:
    """Each name with its text, and behind them all other names of what they name."""
    found = {name: _plain(f"{name} {text}") for name, text in texts.items()}
    for name, text in found.items():
        for (names, word), same in zip(_NAMES, SAME, strict=True):
            if names.search(text):
                found[name] += f" {word} {' '.join(same)}"
    return found


def _nearest(part: str, known: Iterable[str]) -> str:
    """The word itself where it begins a known one, else the nearest; empty where none is near."""
    if any(one.startswith(part) for one in known):
        return part
    return next(iter(difflib.get_close_matches(part, known, n=1, cutoff=0.75)), "")


def _begin(parts: Iterable[str], text: str) -> bool:
    """Whether each part begins a word of a text."""
    return all(f" {part}" in f" {text}" for part in parts)
