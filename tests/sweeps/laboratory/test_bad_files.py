"""Files of laboratories that cannot be taken: one line with file, place and what would be."""

import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from sweeps.base.columns.recording import read_recording
from sweeps.base.columns.units import pressure_unit
from sweeps.base.errors import SceneError
from sweeps.lab.pressure.reading import read_pressure
from tests.support.laboratory import rows, samples, universal
from tests.support.tiers import all_but

ANGLE, PRESSURE = samples(-360.0)
HEAD = "CA [deg],p [bar]\n"


def text(angle: Any = ANGLE, pressure: Any = PRESSURE, head: str = HEAD) -> str:
    return head + rows(angle, pressure)


def line(number: int, content: str) -> str:
    lines = text().splitlines()
    lines[number - 1] = content
    return "\n".join(lines) + "\n"


def without(first: int, last: int) -> str:
    keep = np.ones(len(ANGLE), dtype=bool)
    keep[first:last] = False
    return text(ANGLE[keep], PRESSURE[keep])


def cycles_of(*lengths: int) -> str:
    angle = np.concatenate([np.arange(n) * 0.5 - 360.0 for n in lengths])
    return text(angle, np.concatenate([PRESSURE[:n] for n in lengths]))


BAD: dict[str, tuple[str, dict[str, Any], tuple[str, ...]]] = {
    "empty": ("", {}, ("empty",)),
    "no numbers": ("hello\nworld\n", {}, ("no table of numbers",)),
    "no ratio": (text(), {"compression_ratio": 0.5}, ("compression_ratio = 0.5: must be",)),
    "cycle that is none": (text(), {"cycle": 9}, ("cycle = 9: 'p' has 1 whole cycle",)),
    "wrong column": (text(), {"pressure_column": "q"}, ("pressure_column", "'q'", "CA, p")),
    "number of no column": (text(), {"angle_column": 7}, ("angle_column = 7", "1 to 2")),
    "column twice": (text(), {"angle_column": 1, "pressure_column": 1}, ("twice",)),
    "missing angle": (text(head="a,b\n"), {}, ("angle_column", "'a', 'b'", "without one, angle_")),
    "a filtered twin": (
        "CA [deg],PCYL1 [bar],PCYL1_FILT [bar]\n" + rows(ANGLE, PRESSURE, PRESSURE), {},
        ("pressure_column: ambiguous ('PCYL1', 'PCYL1_FILT')",),
    ),
    "missing unit": (text(head="CA,p\n"), {}, ("no unit", "may be in bar", "unit = 'bar'")),
    "missing unit, not bar": (
        "CA,p\n" + rows(ANGLE, PRESSURE * 100.0), {}, ("may be in kPa", "unit = 'kPa'"),
    ),
    "no unit of pressure": (text(), {"unit": "kg"}, ("'kg'", "bar, kPa")),
    "unit that computes": (text(), {"unit": "9**9**9"}, ("must be a unit of pressure",)),
    "volts without calibration": (text(), {"unit": "V"}, ("calibration",)),
    "calibrated bar": (text(), {"calibration": [1.0, 0.0]}, ("calibration is of volts",)),
    "a word": (line(100, "-311,high"), {}, ("line 100", "'high'", "finite number")),
    "a blank": (line(100, "-311,"), {}, ("line 100", "blank")),
    "too many fields": (line(100, "-311,1,2"), {}, ("line 100: 3 fields, must be 2",)),
    "gap": (without(700, 740), {}, ("no samples between -10.5 and 10 degree",)),
    "half a cycle": (text(ANGLE[:720], PRESSURE[:720]), {},
                     ("covers 360 degree", "720", "two-stroke")),
    "one turn of two": (without(0, 721), {}, ("whole cycle",)),
    "ends that differ": (
        text(np.append(ANGLE, 360.0), np.append(PRESSURE, PRESSURE[0] + 5.0)),
        {}, ("two pressures at -360", "2 %"),
    ),
    "angle goes back": (line(100, "-320,1"), {}, ("line 100", "must rise or fall")),
    "constant angle": (text(0 * ANGLE), {}, ("does not rise",)),
    "many cycles": (cycles_of(1440, 1440), {"write": True},
                    ("2 cycles", "--average, or average = true")),
    "cycle that is not there": (cycles_of(1440, 1440), {"cycle": 3},
                                 ("raw.csv: cycle = 3", "2 whole")),
    "average and cycle": (text(), {"average": True, "cycle": 1}, ("only one",)),
    "step that divides nothing": (text(), {"angle_step": 0.7}, ("must divide 720",)),
    "delay without speed": (text(), {"delay": 1e-5}, ("needs speed",)),
    "pegging angle without inlet": (text(), {"pegging_angle": 0},
                                    ("pegging_angle: has no effect without pegging = 'inlet'",)),
    "exponent without compression": (
        text(), {"pegging": "inlet", "inlet_pressure": 1.0, "polytropic_exponent": 1.3},
        ("polytropic_exponent: has no effect without pegging = 'compression'",),
    ),
    "order of another smoothing": (text(), {"smoothing": "savitzky_golay", "highest_order": 30},
                                   ("highest_order: has no effect", "smoothing = 'low_pass'")),
    "speed for nothing": (text(), {"speed": 1500}, ("without delay or time_constant",)),
    "gap angle without wheel": (text(), {"gap_angle": 0}, ("without encoder_column",)),
    "ambient pressure of bar": (text(), {"ambient_pressure": 0.98},
                                ("in bar: ambient_pressure is added to gauge", "'barg'")),
    "dead centre of two strokes": (text(), {"two_stroke": True, "dead_centre": "firing"},
                                   ("dead_centre: has no effect",)),
    "time as angle": (text(head="time_us,p [bar]\n"), {"angle_column": 1},
                      ("column 'time_us': is a time",)),
    "pegging without pressure": (text(), {"pegging": "inlet"}, ("inlet_pressure",)),
    "pegging without ratio": (text(), {"pegging": "compression"}, ("compression_ratio",)),
    "unknown key": (text(), {"colour": 1}, ("unknown", "colour")),
    "unknown format": (text(), {"format": "fwf"},
                       ("format = 'fwf': must be one of text, fixed_width, xlsx, mat",)),
    "smoothing of what": (text(), {"smoothing": "spline"}, ("savitzky_golay",)),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_bad_text_is_refused_in_one_line(case: str, tmp_path: Path) -> None:
    content, options, fragments = BAD[case]
    (tmp_path / "raw.csv").write_text(content)
    with pytest.raises(SceneError) as failure:
        found = read_pressure(
            tmp_path / "raw.csv", **{k: v for k, v in options.items() if k != "write"}
        )
        if "write" in options:
            found.write(tmp_path / "pressure.csv")
    message = str(failure.value)
    assert message.isprintable()
    assert message.startswith((str(tmp_path / "raw.csv"), "raw.csv: "))
    for fragment in fragments:
        assert fragment in message, message
    assert [p.name for p in tmp_path.iterdir()] == ["raw.csv"]


def damaged(name: str) -> Callable[[Path], None]:
    from tests.support.laboratory import STYLES

    def write(path: Path) -> None:
        STYLES[name][0](path)
        data = path.read_bytes()
        path.write_bytes(data[: len(data) // 2])

    return write


def write_bytes(data: bytes) -> Callable[[Path], None]:
    return lambda path: path.write_bytes(data) and None


def bomb(path: Path) -> None:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as parts:
        parts.writestr("xl/worksheets/sheet1.xml", b" " * (1 << 20))
    data = bytearray(path.read_bytes())
    for mark, place in ((b"PK\x01\x02", 24), (b"PK\x03\x04", 22)):
        at = data.index(mark) + place
        data[at : at + 4] = (3 << 30).to_bytes(4, "little")
    path.write_bytes(data)


def wide_sheet(path: Path) -> None:
    """Few cells, two of them far apart."""
    from openpyxl import Workbook

    book = Workbook()
    book.active.append(["CA", "p"])
    book.active.append([0.0, 1.0])
    book.active.cell(row=1_000_000, column=16_000, value=1.0)
    book.save(path)


def changed(old: bytes, new: bytes) -> Callable[[Path], None]:
    """A universal file in which some bytes are others."""

    def write(path: Path) -> None:
        universal(path)
        data = path.read_bytes()
        assert old in data
        path.write_bytes(data.replace(old, new))

    return write


def matrix_of_texts(path: Path) -> None:
    from scipy.io import savemat

    savemat(path, {"name": "run 12"})


FILES: dict[str, tuple[str, Callable[[Path], None], tuple[str, ...]]] = {
    "other ending": ("a.xls", write_bytes(b"x\x00"), ("must end with one of", ".xlsx")),
    "no known ending": ("a.log", write_bytes(b"x\x00"), ("format given: text, fixed_width, xlsx",)),
    "password": ("a.xlsx", write_bytes(b"\xd0\xcf\x11\xe0" + bytes(2000)), ("password",)),
    "xlsx that is none": ("a.xlsx", write_bytes(b"CA,p\n1,2\n"),
                          ("not an .xlsx file", "give format = 'text'")),
    "xlsx that inflates": ("a.xlsx", bomb, ("when inflated",)),
    "xlsx that is wide": ("a.xlsx", wide_sheet, ("a.xlsx",)),
    "mat 7.3": ("a.mat", write_bytes(b"MATLAB 7.3 MAT-file, Platform: GLNXA64" + bytes(600)),
                ("7.3", "-v7")),
    "mat of texts": ("a.mat", matrix_of_texts, ("no arrays of real numbers",)),
    "half a mat": ("a.mat", damaged("mat, rows of cycles"), (".mat file of versions 4 to 7",)),
    "half a mf4": ("a.mf4", damaged("mf4, one mark a turn"), ("not an MDF file",)),
    "mf4 that is none": ("a.mf4", write_bytes(b"CA,p\n1,2\n" * 90), ("the file is not a valid",)),
    "half a parquet": ("a.parquet", damaged("parquet, backward"), ("not a Parquet file",)),
    "half a netCDF": ("a.nc", damaged("netCDF, several cycles"), ("netCDF",)),
    "tdms that is none": ("a.tdms", write_bytes(b"CA,p\n1,2\n" * 9), ("not a .tdms file",)),
    "wav that is none": ("a.wav", write_bytes(b"CA,p\n1,2\n" * 9), ("not a .wav file",)),
    "uff that is none": ("a.uff", write_bytes(b"CA,p\n1,2\n" * 9), ("no data set between",)),
    "uff of other data": ("a.uff", write_bytes(b"    -1\n   151\nx\n    -1\n"),
                          ("has data sets [151]",)),
    "half a uff": ("a.uff", damaged("universal file"), ("truncated",)),
    "uff that claims more": ("a.unv", changed(b"      1440 ", b"1999999999 "),
                             ("data set 2: damaged: claims 1999999999 values, has 1440",)),
    "uff of no values": ("a.unv", changed(b"      1440 ", b"         0 "), ("claims 0 values",)),
    "uff of letters": ("a.unv", changed(b"e+01", b"x+01"), ("not a UFF file",)),
    "uff of many sets": ("a.unv", write_bytes(b"    -1\n    58\n    -1\n" * 10001),
                         ("20002 columns; must be at most 20000",)),
    "text with zeros": ("a.csv", write_bytes(b"a\x00\x00" * 90),
                        ("not a text file", "its format: text, fixed_width, xlsx")),
    "text of no table": ("a.log", write_bytes(b"hello"), ("no table of numbers",)),
}  # fmt: skip


@pytest.mark.parametrize("case", all_but(["xlsx that is wide"], FILES))
def test_bad_files_are_refused_in_one_line(
    case: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    name, write, fragments = FILES[case]
    write(tmp_path / name)
    with pytest.raises(SceneError) as failure:
        read_recording(tmp_path / name, name)
    message = str(failure.value)
    assert message.startswith(f"{name}: ") and message.isprintable()
    assert "object at" not in message
    for fragment in fragments:
        assert fragment in message, message
    assert capfd.readouterr() == ("", "")  # libraries print nothing


def test_an_assumed_crank_ratio_is_warned_of(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(text())
    told = "crank_ratio: 0.28 assumed for the imep; give crank_ratio or engine"
    assert told in read_pressure(tmp_path / "a.csv").warnings
    for keys in ({"crank_ratio": 0.25}, {"engine": "ntua"}):
        assert told not in read_pressure(tmp_path / "a.csv", **keys).warnings


def test_formulas_of_mdf_files_are_not_run(tmp_path: Path) -> None:
    from asammdf import MDF, Signal

    times = np.arange(8.0)
    with MDF(version="4.10") as file:
        file.append([
            Signal(times, times, name="plain", unit="deg"),
            Signal(times, times, name="formula", conversion={"formula": "X * 2"}),
        ])  # fmt: skip
        file.save(tmp_path / "a.mf4")
    assert list(read_recording(tmp_path / "a.mf4").columns) == ["time", "plain"]


@pytest.mark.parametrize(
    ("unit", "pascal"),
    [("kPa", 1e3), ("MPa", 1e6), ("psi", 6894.757), ("bar", 1e5), ("BAR", 1e5), ("N/mm2", 1e6),
     ("mbar", 100.0), ("hPa", 100.0), ("bar abs", 1e5), ("bar_a", 1e5), ("kgf/cm^2", 98066.5)],
)  # fmt: skip
def test_units_of_pressure(unit: str, pascal: float) -> None:
    found = pressure_unit(unit)
    assert found is not None and not found.gauge and not found.voltage
    assert found.factor == pytest.approx(pascal, rel=1e-6)


@pytest.mark.parametrize("unit", ["9**9**9", "rpm", "__import__('os')", "bar*bar", "1e400", ""])
def test_what_is_no_unit_of_pressure(unit: str) -> None:
    assert pressure_unit(unit) is None


@pytest.mark.parametrize("limit", ["MEMORY", "SECONDS"])
@pytest.mark.parametrize("style", ["mat, rows of cycles", "tdms, volts", "parquet, backward"])
def test_recordings_that_take_too_much(
    style: str, limit: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The libraries of these formats run in a process with limits of time and memory."""
    from sweeps.base.columns import recording
    from tests.support.laboratory import STYLES

    write, name, options = STYLES[style]
    write(tmp_path / name)
    monkeypatch.setattr(recording, limit, 0)
    monkeypatch.setattr(recording, "MEMORY_RATE", 0)
    with pytest.raises(SceneError, match=r"to be read: it takes (more|longer) than") as failure:
        read_pressure(tmp_path / name, **options)
    assert str(failure.value).isprintable()


def test_a_reader_that_ends_its_process(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from sweeps.base.columns import recording

    (tmp_path / "run.mat").write_bytes(bytes(1000))
    monkeypatch.setattr(recording, "CHILD", "sweeps.no_such_module")
    with pytest.raises(SceneError, match=r"a \.mat file, or a damaged one: reading it ends"):
        read_recording(tmp_path / "run.mat")
