"""Encodings of text files: as given, by their marks, or by what their letters say."""

from __future__ import annotations

import codecs
import re

from sweeps.base.errors import SceneError, one_line, shown
from sweeps.base.files.libraries import library

__all__ = ["encoding_of"]

HEAD = 1 << 16
"""Bytes of the lines with letters beyond ASCII that are looked at."""

_BEYOND = re.compile(rb"[^\r\n]*[\x80-\xff][^\r\n]*")

_EAST = ("gb18030", "big5hkscs", "cp932", "euc_jis_2004", "cp949")
_WEST = ("cp1252", "cp1250", "cp1251", "cp1253", "cp1254", "koi8-r", "cp866", "cp850", "mac-roman")

_SIGNS = re.compile(
    r"(?<![a-z])°(?![ a-z])|(?<![A-Za-z])[µμ](?=[A-Za-z])|[²³](?!\w)|[±·]|Ø(?= ?\d)|"
    r"(?<=[A-Za-z])[äöüß]|[äöü](?=[a-z])|(?<![a-z])[ÄÖÜ](?=[a-z])"
)
"""Signs of units where units have them, and letters that are the same in all western encodings."""

_KNOWN = re.compile(
    "角|压|壓|圧|力|转速|轉速|回転|时间|時間|각|압력|угол|угл|давлен|кут|тиск|время|оборот|частота|"
    "kąt|ciśn|úhel|szög|nyomás|γωνία|πίεση|açı|basın|ángulo|presión|pressão|prüf|fühler"
)
"""Words for angle, pressure, speed and time: in a wrong encoding they are not found."""

_IDEOGRAPHS = re.compile("[\u4e00-\u9fff]")

_NEVER = ("idna", "punycode", "undefined", "unicode_escape", "raw_unicode_escape", "utf-7")
"""Codecs of Python that are no encodings of files."""


def encoding_of(data: bytes, label: str, given: str | None = None) -> tuple[str, str]:
    """Encoding of a text file, and what is to be said of it; "" where there is no doubt.

    Raises
    ------
    SceneError
        For a file that is not of text, an encoding that is none or does not fit, and letters whose
        encoding cannot be found.
    """
    if given is not None:
        return _as_given(data, label, given), ""
    if data[:2] in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE):
        return "utf-16", ""
    if b"\x00" in data[:4096]:
        for encoding, zeros in (("utf-16-le", data[1:4096:2]), ("utf-16-be", data[0:4096:2])):
            if zeros.count(0) > 0.9 * len(zeros) and len(data) % 2 == 0:
                return encoding, f"text read as {encoding}"
        raise SceneError(f"{label}: not a text file; expected a table of numbers")
    try:
        data.decode("utf-8-sig")
        return "utf-8-sig", ""
    except UnicodeDecodeError:
        pass
    letters = b"\n".join(_BEYOND.findall(data[: 16 * HEAD]))[:HEAD]
    if not letters:  # far below the names
        return "cp1252", ""
    signs = _of_signs(letters)
    if signs is not None:
        return signs, ""
    return _by_letters(letters, label)


def _as_given(data: bytes, label: str, given: str) -> str:
    try:
        name = codecs.lookup(given).name
        if name in _NEVER:
            raise LookupError
        data.decode(name)
    except LookupError:
        raise SceneError(
            f"{label}: encoding = {shown(given)}: not known; must be one such as 'utf-8', "
            "'cp1252', 'gb18030', 'shift_jis'"
        ) from None
    except ValueError as error:
        raise SceneError(
            f"{label}: encoding = {shown(given)}: does not fit: {one_line(error, 120)}"
        ) from None
    return name


def _of_signs(letters: bytes) -> str | None:
    """Encoding in which all that is beyond ASCII are signs and umlauts, one at a time."""
    if re.search(rb"[\x80-\xff]{2}", letters):
        return None
    for encoding in ("cp1252", "cp850", "mac-roman"):
        text = letters.decode(encoding, "replace")
        if _SIGNS.sub("", text).isascii():
            return encoding
    return None


def _by_letters(letters: bytes, label: str) -> tuple[str, str]:
    """The likeliest encoding, one in which words are known if there is one."""
    detector = library("chardet", "chardet (or encoding, which names its encoding)", label)
    found = detector.detect_all(
        letters, ignore_threshold=True, include_encodings=[*_EAST, *_WEST], compat_names=False
    )
    likely = []
    for one in found:
        encoding = one["encoding"]
        text = letters.decode(encoding, "replace")
        # Korean of today has no ideographs: what seems to have them is Chinese.
        if text.isascii() or (encoding == "cp949" and _IDEOGRAPHS.search(text)):
            continue
        known = {word for word in _KNOWN.findall(text.lower()) if not word.isascii()}
        likely.append((len(known), encoding))
    if not likely:
        raise SceneError(
            f"{label}: the encoding of its letters is not found; give encoding, such as 'cp1252' "
            "or 'gb18030'"
        )
    best = max(likely, key=lambda one: one[0])[1]
    return best, f"text read as {best}, by its letters (encoding takes another one)"
