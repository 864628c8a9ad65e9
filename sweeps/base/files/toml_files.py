"""TOML files of people: their text as Python's own types, or one line that says what is wrong."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

from engine_dyn.quantities.graph import PARAMETERS
from sweeps.base.errors import SceneError, one_line
from sweeps.base.files.regular_files import read_text

MOST_BYTES, MOST_KEYS = 1 << 24, 200_000
"""Largest number of bytes and keys of a scene or engine file, of which more take minutes. Longer
lists stand in tables."""

_MISTAKES = (
    (re.compile(r"[-+]?[\d.]+ ?/ ?[\d.]+"), "a fraction needs quotes"),
    (re.compile(r"[-+]?\d+,\d+ *(#|$)"), "the decimal mark is a point"),
    (re.compile(r"[-+]?(\.\d|\d+\.(?!\d))"), "write 0.084 in place of .084, and 84.0 of 84."),
    (re.compile(r"[-+]?[\d.]+(e\d+)? *[a-df-wyzA-DF-WYZ]"), "numbers stand without their unit"),
    (re.compile(r"[-+]?(true|false|nan|inf)\b", re.IGNORECASE), "such words are written small"),
    (re.compile(r"[a-zA-Z]"), "a text needs quotes"),
)
"""Beginnings of values that are not TOML, each with a hint; the first one that fits counts."""


def parse_toml(path: Path, name: str, what: str) -> dict[str, Any]:
    """Read a TOML file; messages have the line, and the key on it where that is one of ours."""
    return toml_of_text(read_text(path, name, what, MOST_BYTES), name)


def toml_of_text(text: str, name: str) -> dict[str, Any]:
    """Return the tables of a text, as `parse_toml` does of a file."""
    keys = text.count("=") + text.count("[")
    if keys > MOST_KEYS:
        raise SceneError(f"{name}: {keys} keys, tables and lists; must be at most {MOST_KEYS}")
    # The pattern is possessive: it never goes back into a text that it has matched, which would
    # take memory for each letter. Closing quotes are optional, so that the end of a string without
    # them is looked for only once.
    quoted = re.compile(
        r'"""(?:[^"\\]|\\[\s\S]|"{1,2}(?!"))*+(?:"{3,5})?'
        r"|'''(?:[^']|'{1,2}(?!'))*+(?:'{3,5})?"
        r'|"(?:[^"\\\n]|\\.)*+"?'
        r"|'[^'\n]*+'?|#[^\n]*+"
    )
    if re.search(r"(?<![\w-])(?:[\w-]++[ \t]*+\.[ \t]*+){32}", quoted.sub("q", text)):
        # Python's reader of TOML takes memory that grows with the square of the depth of a dotted
        # key.
        raise SceneError(f"{name}: not TOML: keys nested too deeply")
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise SceneError(f"{name}: not TOML: nested too deeply") from None
    except ValueError as error:
        message = one_line(error)
        # A whole number of thousands of digits raises a ValueError that is no TOMLDecodeError
        if not isinstance(error, tomllib.TOMLDecodeError):
            raise SceneError(f"{name}: not TOML: {message}") from None
        match = re.search(r"\(at line (\d+)", message)
        lines = text.splitlines()  # The error "at end of document" means the last line
        number_of_line = int(match.group(1)) if match else max(len(lines), 1)
        on_it = lines[number_of_line - 1] if number_of_line <= len(lines) else ""
        key, _, value = (part.strip() for part in on_it.partition("="))
        hints = [f"; {hint}" for mistake, hint in _MISTAKES if mistake.match(value[:80])][:1]
        # Any file may be named, also one whose content is secret: of its text the message shows at
        # most one key, and only if that is the name of a parameter.
        message = re.sub(r"\s*\([^)]*\)|\s*'[^']*'", "", message)
        told = f", of {key}" if key in PARAMETERS else ""
        raise SceneError(
            f"{name}, line {number_of_line}: not TOML: {message}{told}{''.join(hints)}"
        ) from None
