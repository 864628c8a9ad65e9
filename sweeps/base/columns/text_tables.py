"""Recordings in text files: any separator, decimal mark, lines above the numbers, row of units.

Lines above the numbers are looked at here; the numbers are read by pandas.
"""

from __future__ import annotations

import codecs
import io
import re
from collections.abc import Sequence
from dataclasses import replace
from itertools import product, takewhile
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from engine_dyn.types import Floats
from sweeps.base.columns.headers import RUN, is_number, names_and_units, number_of, start_of_numbers
from sweeps.base.columns.options import ReadingChoices
from sweeps.base.columns.recorded_columns import Column, Contents, check_size
from sweeps.base.errors import SceneError, counted, one_line, shown
from sweeps.base.files.csv_tables import BLANKS, fields
from sweeps.base.files.libraries import library

HEAD = 1 << 20
"""Bytes at the start of a file that are looked at for its form: lines above the numbers."""

LINES = 500  # Lines at the start of a file that are searched for the table

_DOS_END = b"\x1a"  # Byte that ends a text of DOS

_GROUPS = {
    mark: "[1-9]\\d{0,2}(?:" + re.escape(mark) + r"\d{3})+" for mark in ".,'\u2019 \xa0\u202f"
}
"""Marks between groups of three digits, and the pattern of the digits with each."""


class _Form(NamedTuple):
    """How the numbers of a text file are written."""

    # `first` is the row (from 0) of the first numbers, `width` the number of columns, `fields` the
    # number of fields in a row with empty ones and notes at its end. `group` is the mark between
    # groups of three digits, if there is one.

    separator: str
    decimal: str
    first: int
    width: int
    fields: int
    group: str | None = None


def read_text(path: Path, data: bytes, label: str, choices: ReadingChoices) -> Contents:
    """Columns of a text file, and the line of the first sample."""
    del path
    data = data.rstrip(_DOS_END)
    encoding, *said = encoding_of(data, label, choices.encoding)
    data, marks = _without_marks(data)
    if encoding == "utf-8-sig":
        data = data.replace("\u2212".encode(), b"-")  # Typesetting has a minus sign of its own
    head = data[:HEAD].decode(encoding, "replace").splitlines()
    if len(data) > HEAD:
        head = head[:-1]  # The last line may be cut
    head = head[:LINES]
    form = _form(head, choices)
    if form is None:
        raise SceneError(
            f"{label}: no table of numbers in its first {counted(len(head), 'line')}; must be "
            "rows of numbers with one separator (give separator and decimal if they are not "
            "recognised)"
        )
    clear = choices.decimal is not None
    contents = _as_written(data, encoding, head, form, label, said, marks, clear=clear)
    if form.group is None and any(column.text is not None for column in contents.columns):
        # Groups of digits may begin below the head, where pressure or angle first pass 1000.
        other = _form(head, choices, _grouped_lines(data, encoding))
        if other is not None and other.group is not None:
            return _as_written(data, encoding, head, other, label, said, marks, clear=clear)
    return contents


def _as_written(
    data: bytes, encoding: str, head: list[str], form: _Form, label: str, said: list[str],
    marks: list[int], *, clear: bool,
) -> Contents:  # fmt: skip
    """Read a text file in one form; `clear`: its decimal mark cannot be one of groups."""
    rows = [fields(line, form.separator) for line in head[: form.first]]
    body = [fields(line, form.separator) for line in head[form.first : form.first + RUN]]
    said = said + _numbers_above(rows, form)
    # Rows may begin with the number of the row, counted from 0 or 1.
    counted_from = ([[str(first + n)] for n in range(RUN)] for first in (0, 1))
    names, units = names_and_units(
        rows, form.width, form.separator == BLANKS, [row[:1] for row in body] in counted_from
    )
    clear = clear or form.group is not None
    columns = _columns(data, encoding, form, names, units, label, said, clear=clear)
    within = tuple(line - form.first for line in marks if line > form.first)
    if within:
        said.append(f"{counted(len(within), 'line')} MARK between the samples left out")
    first_line = form.first + 1 + len(marks) - len(within)
    return Contents(columns, first_line, tuple(filter(None, said)), within)


def _numbers_above(rows: list[list[str]], form: _Form) -> list[str]:
    """Remark on a row of numbers above the table that is left out."""
    texts = [text for text in rows[-1] if text.strip()] if rows else []
    if len(texts) != form.width or not all(is_number(text, form.decimal) for text in texts):
        return []
    return [
        f"line {form.first} left out: numbers above the table ({one_line(', '.join(texts), 60)})"
    ]


def _without_marks(data: bytes) -> tuple[bytes, list[int]]:
    """Return the data without lines of marks, and how many lines are before each."""
    pieces, marks, before, start = [], [], 0, 0
    # Loggers of engine controllers write lines such as "MARK 001" where a key is pressed or a page
    # begins.
    for mark in re.finditer(rb'(?m)^[ \t]*"?MARK[ \t]+\d[^\r\n]*(?:\r\n|\n|\r|\Z)', data):
        pieces.append(data[start : mark.start()])
        before += len(pieces[-1].splitlines())
        marks.append(before)
        start = mark.end()
    return b"".join([*pieces, data[start:]]) if marks else data, marks


def is_text(data: bytes) -> bool:
    """Whether a file seems to be a text, by the bytes at its start."""
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return True
    # Texts have none of these control bytes.
    return re.search(rb"[\x00-\x08\x0e-\x1f\x7f]", data[:HEAD].rstrip(_DOS_END)) is None


def _grouped_lines(data: bytes, encoding: str) -> list[str]:
    """Return the first line with each kind of groups of digits: it may lie below the head."""
    text = data.decode(encoding, "replace")
    found = []
    for mark, digits in _GROUPS.items():
        if mark not in text:
            continue
        other = "," if mark == "." else "." if mark == "," else "[.,]"
        number = rf"(?<![\w.,']){digits}(?:{other}\d+)?(?![\w.,'])"
        if match := re.search(number, text):
            start, end = text.rfind("\n", 0, match.start()) + 1, text.find("\n", match.end())
            found.append(text[start : end if end >= 0 else None].rstrip("\r"))
    return found


def _form(head: list[str], choices: ReadingChoices, grouped: Sequence[str] = ()) -> _Form | None:
    """Separator and decimal mark that make the most numbers of the first lines.

    `grouped` are lines of the file, here or below, that may have groups of digits.
    """
    separators: Sequence[str] = (";", "\t", "|", ",", BLANKS)
    decimals: Sequence[str] = (".", ",")
    if choices.separator is not None:
        words = {"tab": "\t", "\\t": "\t", "blank": BLANKS, "space": BLANKS, " ": BLANKS}
        separators = (words.get(choices.separator, choices.separator),)
    if choices.decimal is not None:
        decimals = (choices.decimal,)
    forms: list[tuple[int, bool, _Form]] = []
    for separator in separators:
        plain = [fields(line, separator) for line in [*head, *grouped]]
        for decimal, mark in product(decimals, (None, *_GROUPS)):
            if separator == decimal or decimal == mark:
                continue
            rows = plain
            if mark is not None:
                rows = _ungrouped(plain, decimal, mark, stated=choices.decimal is not None)
            start = start_of_numbers(rows[: len(head)], decimal)
            if start is None:
                continue
            first, width = start
            numbers = sum(is_number(text, decimal) for row in rows[first:] for text in row)
            texts = sum(bool(text.strip()) for row in rows[first:] for text in row) - numbers
            parts = _seem_parts(rows[:first], rows[first:])
            most = _most_fields(rows[first : len(head)], width)
            form = _Form(separator, decimal, first, width, most, mark)
            forms.append((numbers - 2 * texts, parts, form))
    # A form that seems to cut numbers at their decimal commas is dropped where another form takes
    # the comma as decimal mark.
    whole = any(not parts and form.decimal == "," for _, parts, form in forms)
    good = [one for one in forms if not (whole and one[1])]
    return max(good, key=lambda one: one[0])[2] if good else None


def _number_in_groups(decimal: str, mark: str) -> re.Pattern[str]:
    return re.compile(rf"[+-]?{_GROUPS[mark]}(?:{re.escape(decimal)}\d*)?")


def _ungrouped(rows: list[list[str]], decimal: str, mark: str, *, stated: bool) -> list[list[str]]:
    """Rows without the marks between groups of digits; none where marks stand in other places.

    1.234 alone is no number in groups, unless the decimal mark is `stated` to be the comma, or
    other numbers have one.
    """
    number = _number_in_groups(decimal, mark)
    fields = [text.strip() for row in rows for text in row if mark in text]
    grouped = {text for text in fields if number.fullmatch(text)}
    if not grouped:
        return []
    other = any(re.fullmatch(r"[-+.,'\d]+", text) for text in fields if text not in grouped)
    told = (
        stated or mark not in ".,"
        or any(decimal in text or text.count(mark) > 1 for text in grouped)
        or any(decimal in text and is_number(text, decimal) for row in rows for text in row)
    )  # fmt: skip
    if other or not told:
        return []
    return [
        [text.replace(mark, "") if text.strip() in grouped else text for text in row]
        for row in rows
    ]


def _most_fields(rows: Sequence[Sequence[str]], width: int) -> int:
    """Most fields of a row: the first rows may have notes at their ends, later ones may not."""
    return max([width, *takewhile(lambda length: length > width, map(len, rows))])


def _seem_parts(above: list[list[str]], rows: list[list[str]]) -> bool:
    """Whether digits such as 066 are decimals behind a comma: not first, and not below names."""
    names = next((row for row in reversed(above) if any(text.strip() for text in row)), [])
    if len(names) > 1 and len(names) == len(rows[0]):
        return False
    return any(re.fullmatch(r"0\d+", text.strip()) for row in rows for text in row[1:])


def _columns(
    data: bytes, encoding: str, form: _Form, names: list[str], units: list[str], label: str,
    said: list[str], *, clear: bool,
) -> list[Column]:  # fmt: skip
    """Read the columns of a text file; `clear`: its decimal mark cannot be one of groups."""
    import pandas as pd

    how: dict[str, Any] = {
        "sep": form.separator, "skiprows": form.first, "header": None,
        "names": range(form.fields), "encoding": encoding, "encoding_errors": "replace",
        "engine": "c", "skip_blank_lines": False, "low_memory": False, "skipinitialspace": True,
        "on_bad_lines": "error",
    }  # fmt: skip

    check_size(float(data.count(b"\n") + 1) * form.width, form.width, label)
    try:
        frame = pd.read_csv(io.BytesIO(data), decimal=form.decimal, **how)
    except (ValueError, OverflowError) as error:  # errors of pandas' parser are ValueErrors
        match = re.search(r"Expected (\d+) fields in line (\d+), saw (\d+)", str(error))
        if match is None:
            raise SceneError(
                f"{label}: {one_line(error, 160)}; expected a table of numbers"
            ) from None
        raise SceneError(
            f"{label}, line {match[2]}: {counted(int(match[3]), 'field')}, must be {match[1]}"
        ) from None
    blank = frame.isna().all(axis=1).to_numpy()
    rows = len(blank) - int(np.argmin(blank[::-1])) if not blank.all() else 0
    frame = frame.iloc[:rows]
    beside = frame.iloc[:, form.width :].notna().any(axis=1).to_numpy()
    if beside.any():
        said.append(f"values right of the table in {counted(int(beside.sum()), 'row')} left out")
    if form.group is not None:
        said.append(f"'{form.group}' taken as the mark between groups of three digits")
    columns = []
    for place, (name, unit) in enumerate(zip(names, units, strict=True)):
        if frame[place].isna().all() and name.startswith("column "):
            continue
        column = _column(name, unit, frame[place], form)
        if not clear and _may_be_groups(column.values):
            texts = pd.read_csv(io.BytesIO(data), usecols=[place], dtype=str, **how)[place]
            column = replace(column, doubt=_doubt(texts, form.decimal))
        columns.append(column)
    return columns


def _may_be_groups(values: Floats) -> bool:
    """Whether 998, 999, 1.002 may be written here: a step from whole numbers to thousandths."""
    size = np.abs(values)
    large, small = (size >= 100.0) & (size == np.round(size)), (size >= 1.0) & (size < 10.0)
    steps = (large[1:] & small[:-1]) | (small[1:] & large[:-1])
    return bool(steps.any() and size.max() < 1000.0 and (size != np.round(size)).any())


def _doubt(texts: Any, decimal: str) -> tuple[int, str] | None:
    """First text that is digits in groups or a decimal number, if no other text of them tells."""
    marked = texts.str.contains(decimal, regex=False).fillna(False).to_numpy(bool)
    grouped = texts.str.fullmatch(rf"\s*[+-]?{_GROUPS[decimal]}\s*").fillna(False).to_numpy(bool)
    if not marked.any() or (marked & ~grouped).any():
        return None
    first = int(np.flatnonzero(marked)[0])
    return first, one_line(texts.iloc[first], 60)


def _column(name: str, unit: str, series: Any, form: _Form) -> Column:
    """One column, with the first of its texts where it has some."""
    import pandas as pd

    if series.dtype.kind in "iuf":
        return Column(name, unit, series.to_numpy(np.float64))
    texts = series.astype(str).str.strip()
    # A column with a single text is read as texts, the numbers among them as they are written.
    written = texts
    if form.group is not None:
        grouped = texts.str.fullmatch(_number_in_groups(form.decimal, form.group))
        written = written.where(~grouped, written.str.replace(form.group, "", regex=False))
    if form.decimal == ",":
        pointed = written.str.contains(".", regex=False)
        written = written.str.replace(",", ".", regex=False).where(~pointed, "no number")
    values = pd.to_numeric(written, errors="coerce").to_numpy(np.float64)
    wrong = np.flatnonzero(np.isnan(values) & series.notna().to_numpy())
    text = (int(wrong[0]), one_line(texts.iloc[wrong[0]], 60)) if len(wrong) else None
    return Column(name, unit, values, text)


def read_fixed_width(path: Path, data: bytes, label: str, choices: ReadingChoices) -> Contents:
    """Columns of a text file with fixed places, and the line of the first sample."""
    del path
    encoding, said = encoding_of(data, label, choices.encoding)
    text = data.decode(encoding, "replace")
    lines = text.rstrip().splitlines()
    start = _start(lines[:LINES], choices)
    if start is None:
        raise SceneError(
            f"{label}: no lines of numbers in its first {LINES} lines; must be columns of numbers "
            "at fixed places"
        )
    first, decimal = start
    body = lines[first:]
    places = _places(body)
    check_size(float(len(body)) * len(places), len(places), label)
    # One or two lines of names may be wider
    for above in (lines[max(first - 2, 0) :], lines[max(first - 1, 0) :]):
        wider = _places(above)
        if len(wider) == len(places) and all(map(_within, places, wider)):
            places = wider
            break
    head = [[line[place].strip() for place in places] for line in lines[:first]]
    names, units = names_and_units(head, len(places))
    columns = [
        _fixed_column(name, unit, [line[place].strip() for line in body], decimal)
        for name, unit, place in zip(names, units, places, strict=True)
    ]
    return Contents(columns, first + 1, tuple(filter(None, [said])))


def _start(lines: Sequence[str], choices: ReadingChoices) -> tuple[int, str] | None:
    """The first of six lines of numbers (fewer at the end of the file), and their decimal mark."""
    for decimal in (".", ",") if choices.decimal is None else (choices.decimal,):
        numeric = [
            bool(line.strip()) and all(is_number(field, decimal) for field in line.split())
            for line in lines
        ]
        for first in range(len(lines)):
            if all(numeric[first : first + 6]):
                return first, decimal
    return None


def _places(lines: Sequence[str]) -> list[slice]:
    """Places of columns: they lie between places where all lines are blank."""
    used = np.zeros(max(map(len, lines)) + 2, dtype=bool)
    for line in lines:
        used[1 : len(line) + 1] |= np.array([not letter.isspace() for letter in line], dtype=bool)
    begins, ends = np.flatnonzero(np.diff(used)).reshape(-1, 2).T
    return [slice(int(begin), int(end)) for begin, end in zip(begins, ends, strict=True)]


def _within(place: slice, wider: slice) -> bool:
    """Whether a column of numbers lies below one name."""
    return bool(wider.start <= place.start and place.stop <= wider.stop)


def _fixed_column(name: str, unit: str, fields: Sequence[str], decimal: str) -> Column:
    """One column, with the first of its texts where it has some."""
    values = np.full(len(fields), np.nan)
    text: tuple[int, str] | None = None
    for place, field in enumerate(fields):
        if is_number(field, decimal):
            values[place] = number_of(field, decimal)
        elif field and text is None:
            text = (place, one_line(field, 60))
    return Column(name, unit, values, text)


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
    letters = b"\n".join(re.findall(rb"[^\r\n]*[\x80-\xff][^\r\n]*", data[:HEAD]))[: HEAD // 16]
    if not letters:  # The bytes beyond ASCII lie far below the names
        return "cp1252", ""
    signs = _of_signs(letters)
    if signs is not None:
        return signs, ""
    return _by_letters(letters, label)


def _as_given(data: bytes, label: str, given: str) -> str:
    try:
        name = codecs.lookup(given).name
        # The codecs of Python below are no encodings of files.
        no_files = "idna", "punycode", "undefined", "unicode_escape", "raw_unicode_escape", "utf-7"
        if name in no_files:
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
    """Encoding in which all letters beyond ASCII are signs and umlauts, one at a time."""
    if re.search(rb"[\x80-\xff]{2}", letters):
        return None
    for encoding in ("cp1252", "cp850", "mac-roman"):
        text = letters.decode(encoding, "replace")
        # Signs that units have, and umlauts where German words have them, are right: they are left
        # out.
        other = re.sub(
            r"(?<![a-z])°(?![ a-z])|(?<![A-Za-z])[µμ](?=[A-Za-z])|[²³](?!\w)|[±·]|Ø(?= ?\d)|"
            r"(?<=[A-Za-z])[äöüß]|[äöü](?=[a-z])|(?<![a-z])[ÄÖÜ](?=[a-z])", "", text
        )  # fmt: skip
        if other.isascii():
            return encoding
    return None


def _by_letters(letters: bytes, label: str) -> tuple[str, str]:
    """The likeliest encoding, preferably one in which known words appear."""
    detector = library("chardet", "chardet (or encoding, which names its encoding)", label)
    guesses = detector.detect_all(
        letters, ignore_threshold=True, include_encodings=[
            "gb18030", "big5hkscs", "cp932", "euc_jis_2004", "cp949", "cp1252", "cp1250", "cp1251",
            "cp1253", "cp1254", "koi8-r", "cp866", "cp850", "mac-roman",
        ], compat_names=False,
    )  # fmt: skip
    likely = []
    for one in guesses:
        encoding = one["encoding"]
        if encoding is None:  # bytes of no text
            continue
        text = letters.decode(encoding, "replace")
        # Korean of today has no ideographs: a text that seems to have them is Chinese.
        if text.isascii() or (encoding == "cp949" and re.search("[\u4e00-\u9fff]", text)):
            continue
        # Words for angle, pressure, speed and time, which a wrong encoding does not give.
        words = re.findall(
            "角|压|壓|圧|力|转速|轉速|回転|时间|時間|각|압력|угол|угл|давлен|кут|тиск|время|оборот|частота|"
            "kąt|ciśn|úhel|szög|nyomás|γωνία|πίεση|açı|basın|ángulo|presión|pressão|prüf|fühler",
            text.lower(),
        )
        known = {word for word in words if not word.isascii()}
        likely.append((len(known), encoding))
    if not likely:
        raise SceneError(
            f"{label}: the encoding of its letters is not found; give encoding, such as 'cp1252' "
            "or 'gb18030'"
        )
    best = max(likely, key=lambda one: one[0])[1]
    return best, f"text read as {best}, by its letters (encoding takes another one)"
