"""Tables with notes, other alphabets, blank fields and sheets: the same samples in each."""

from pathlib import Path

import numpy as np
import pytest

import sweeps
from sweeps.base.columns.options import PressureOptions, ReadingChoices
from sweeps.base.columns.recorded_columns import Signals, signals_of
from sweeps.base.columns.recording import read_recording

ANGLE = np.arange(-360.0, 360.0)
PRESSURE = np.round(1.0 + 48.0 / (1.0 + (ANGLE / 20.0) ** 2), 3)


def lines(separator: str = ",", end: str = "") -> list[str]:
    pairs = zip(ANGLE, PRESSURE, strict=True)
    return [f"{a:g}{separator}{p:g}{end}" for a, p in pairs]


def found(path: Path, **options: str) -> Signals:
    return signals_of(read_recording(path, path.name), PressureOptions.model_validate(options))


LAYOUTS = {
    "notes in the names": ["angle,p_cyl,,speed", "deg,bar,,1450", *lines(end=",,")],
    "notes without separators": ["angle,p_cyl,,speed,load", "deg,bar,,1450,55", *lines()],
    "a number among units": ["no,angle,p_cyl,n", "-,deg,bar,1450", *(
        f"{i},{line},3" for i, line in enumerate(lines()))],
    "a column of comments": ["X_Value\tangle_deg\tp_cyl_bar\tComment", *(
        f"{1e-3 * i:.3f}\t{line}" for i, line in enumerate(lines("\t")))],
    "notes beside samples": ["angle [deg],p_cyl [bar],,note", *(
        line + note for line, note in zip(
            lines(), [",,speed", ",,1450", ",,load", ",,55", *[",,"] * 716], strict=True))],
    "a shorter channel": ["angle [deg],p_cyl [bar],rail", *(
        line + ("" if i > 3 else f",{i}") for i, line in enumerate(lines()))],
    "a channel that ends": ["angle [deg],p_cyl [bar],rail", *(
        line + ("," if i > 400 else f",{i}") for i, line in enumerate(lines()))],
    "a slower channel": ["angle [deg],p_cyl [bar],rail", *(
        line + (f",{i}" if i % 10 == 0 else ",") for i, line in enumerate(lines()))],
    "a channel at every third": ["angle [deg],p_cyl [bar],rail", *(
        line + (f",{i}" if i % 3 == 0 else ",") for i, line in enumerate(lines()))],
    "labels before rows": ["DIADEM-HEADER", "NAME;angle;p_cyl", "UNIT;deg;bar", "LENGTH;720;720",
                           "MINIMUM;-360;1", "MAXIMUM;359;49", *lines(";")],
    "labels and numbers": ["Kanalname;angle;p_cyl", "Einheit;deg;bar", "Kommentar;Geber;Sensor", *(
        f"{i + 1};{line}" for i, line in enumerate(lines(";")))],
    "numbers of channels": ["angle,p_cyl", "deg,bar", "1,2", *lines()],
    "rows with numbers": ["angle_deg p_bar", *(
        f"{i + 1} {line}" for i, line in enumerate(lines(" ")))],
    "gauge in brackets": ["angle (deg),p (bar g)", *lines()],
    "signs of typesetting": ["angle_deg,p_bar", *(line.replace("-", "\u2212") for line in lines())],
    "groups of digits": ["Winkel [°KW];p_cyl [mbar]", *(
        f"{a:.1f}".replace(".", ",") + ";" + f"{1e3 * p:,.2f}".translate({44: 46, 46: 44})
        for a, p in zip(ANGLE, PRESSURE, strict=True))],
    "groups by apostrophes": ["angle [deg];p_cyl [mbar]", *(
        f"{a:.1f};" + f"{1e3 * p:,.2f}".replace(",", "'")
        for a, p in zip(ANGLE, PRESSURE, strict=True))],
    "units in words": ["угол ПКВ;давление", "град.;МПа", *(
        f"{a:g};{0.1 * p:.4f}" for a, p in zip(ANGLE, PRESSURE, strict=True))],
}  # fmt: skip


@pytest.mark.parametrize("layout", LAYOUTS)
def test_no_sample_is_lost_whatever_stands_beside_it(layout: str, tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("\n".join(LAYOUTS[layout]) + "\n", encoding="utf-8")
    signals = found(tmp_path / "a.csv")
    (pressure,) = signals.pressures.values()
    (unit,) = signals.units.values()
    assert signals.angle is not None
    assert np.array_equal(signals.angle, ANGLE)
    assert np.allclose(pressure * {"MPa": 10.0, "mbar": 1e-3}.get(unit, 1.0), PRESSURE, rtol=1e-12)
    assert unit or next(iter(signals.pressures)).endswith("bar")


NAMES = {
    "gb18030": ["曲轴转角 (°),气缸压力 (bar)", "曲轴转角,缸压", "角度[deg],压力[MPa]",
                "曲轴转角 (度),缸压 1 (兆帕)", "转角 °CA,压力 bar"],
    "big5": ["曲軸轉角 (°),氣缸壓力 (bar)"],
    "shift_jis": ["クランク角 [deg],筒内圧 [bar]", "クランク角度,筒内圧力", "角度,圧力"],
    "euc_jp": ["クランク角 [deg],筒内圧 [bar]"],
    "cp949": ["크랭크 각도 (deg),실린더 압력 (bar)", "크랭크각,압력"],
    "cp1251": ["угол поворота (град),давление (бар)", "Угол ПКВ,Давление",
               "угол п.к.в. [град],давление в цилиндре [МПа]"],
    "koi8-r": ["угол поворота (град),давление (бар)"],
    "cp866": ["угол поворота (град),давление (бар)"],
    "cp1250": ["Kąt obrotu wału [deg],Ciśnienie w cylindrze [bar]", "Úhel [°],Tlak ve válci [bar]"],
    "cp1252": ["Kurbelwinkel [°KW],Zylinderdruck Prüfstand [bar]", "Ángulo (°),Presión (bar)",
               "Vinkel på vevaxeln [°],Cylindertryck [bar]"],
    "cp850": ["Kurbelwinkel [°KW],Zylinderdruck [bar]"],
    "mac-roman": ["Angle vilebrequin [deg],Pression mesurée [bar]"],
    "utf-16": ["угол поворота (град),давление (бар)"],
    "utf-16-le": ["曲轴转角 (°),气缸压力 (bar)"],
}  # fmt: skip


@pytest.mark.parametrize(
    ("encoding", "names"), [(key, one) for key, several in NAMES.items() for one in several]
)
def test_names_in_all_alphabets_are_read_and_known(
    encoding: str, names: str, tmp_path: Path
) -> None:
    (tmp_path / "a.csv").write_bytes("\n".join([names, *lines()]).encode(encoding))
    signals = found(tmp_path / "a.csv")
    first, second = names.split(",")
    (pressure,) = signals.pressures
    assert first.startswith(signals.angle_name) and second.startswith(pressure)
    assert np.array_equal(signals.pressures[pressure], PRESSURE)
    given = read_recording(tmp_path / "a.csv", "a.csv", ReadingChoices(encoding=encoding))
    assert list(given.columns) == [signals.angle_name, pressure]
    assert not given.said
    named = found(tmp_path / "a.csv", angle_column=first, pressure_column=second)
    assert list(named.pressures) == [pressure]


@pytest.mark.parametrize("encoding", ["nonsense", "idna", "punycode", "ascii", "utf-8", "rot13"])
def test_an_encoding_that_does_not_fit_is_refused(encoding: str, tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_bytes("\n".join([NAMES["cp1251"][0], *lines()]).encode("cp1251"))
    with pytest.raises(sweeps.SceneError, match="encoding"):
        read_recording(path, None, ReadingChoices(encoding=encoding))


def test_bytes_of_no_text_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_bytes(b"\x01\x8071.5\n" + "\n".join(lines()).encode())
    with pytest.raises(sweeps.SceneError, match=r"a\.csv: the encoding of its letters"):
        read_recording(path, "a.csv")


def book(path: Path, **sheets: list[list[object]]) -> None:
    from openpyxl import Workbook

    made = Workbook()
    made.remove(made.active)
    for title, cells in sheets.items():
        sheet = made.create_sheet(title)
        for row in cells:
            sheet.append(row)
    made.save(path)


CYCLE: list[list[object]] = [
    ["angle [deg]", "p_cyl [bar]"],
    *([a, p] for a, p in zip(ANGLE.tolist(), PRESSURE.tolist(), strict=True)),
]
INFO: list[list[object]] = [["steady test", "bench 2"], ["speed", 1450]]
SUMMARY: list[list[object]] = [["speed", "torque"], [1450, 880], [1500, 870]]


@pytest.mark.parametrize("before", [{}, {"Info": INFO}, {"Summary": SUMMARY}, {"Number": [[12]]}])
def test_the_sheet_with_the_recording_is_read_and_named(
    before: dict[str, list[list[object]]], tmp_path: Path
) -> None:
    book(tmp_path / "a.xlsx", **before, Cycle=CYCLE, Remarks=[["none"]])
    signals = found(tmp_path / "a.xlsx")
    assert signals.angle is not None and np.array_equal(signals.angle, ANGLE)
    assert np.array_equal(signals.pressures["p_cyl"], PRESSURE)
    said = " ".join(read_recording(tmp_path / "a.xlsx").said)
    assert said.index("'Cycle'") < said.index("'Remarks'")
    assert not read_recording(tmp_path / "a.xlsx", None, ReadingChoices(sheet="Cycle")).said


def test_lines_of_marks_are_left_out_and_lines_still_counted(tmp_path: Path) -> None:
    table = lines()
    marked = [
        "angle,p_cyl",
        "deg,bar",
        "MARK 000 - start",
        *table[:100],
        "MARK 001 - key",
        *table[100:],
    ]
    (tmp_path / "a.msl").write_text("\r\n".join(marked))
    recording = read_recording(tmp_path / "a.msl")
    assert np.array_equal(recording.columns["p_cyl"].values, PRESSURE)
    assert recording.marks == (100,)
    assert "1 line MARK" in recording.said[0]
    for sample in (0, 99, 100, 719):
        place = int(recording.place(sample).removeprefix("line "))
        assert marked[place - 1] == table[sample]


@pytest.mark.parametrize("factor", [1.0, np.pi / 180.0, 1.0 / 360.0])
@pytest.mark.parametrize("turn", [360, 720])
@pytest.mark.parametrize("step", [1, -1])
def test_the_first_sample_before_an_angle_begins_again_is_one(
    factor: float, turn: int, step: int, tmp_path: Path
) -> None:
    for start in range(-3, 4):
        angle = factor * (step * np.arange(start, start + 720) % turn)
        text = "".join(f"{a:.6f},{p:g}\n" for a, p in zip(angle, PRESSURE, strict=True))
        (tmp_path / "a.csv").write_text("angle,p_cyl\n" + text)
        assert len(read_recording(tmp_path / "a.csv").columns["angle"].values) == 720


@pytest.mark.parametrize("number", [-9999, 999, -999, 99999])
def test_numbers_for_missing_values_are_refused(number: int, tmp_path: Path) -> None:
    table = lines()
    table[100] = f"-260,{number}"
    (tmp_path / "a.csv").write_text("\n".join(["angle_deg,p_bar", *table]))
    recording = read_recording(tmp_path / "a.csv")
    with pytest.raises(sweeps.SceneError, match=f"line 102: {number}"):
        recording.numbers("p_bar")
    table[100:300] = [f"{line.split(',')[0]},{number}" for line in table[100:300]]
    (tmp_path / "a.csv").write_text("\n".join(["angle_deg,level", *table]))
    assert len(read_recording(tmp_path / "a.csv").numbers("level")) == 720


def grouped(number: float, decimals: int, decimal: str, mark: str) -> str:
    return f"{number:,.{decimals}f}".translate({ord(","): mark, ord("."): decimal})


@pytest.mark.parametrize("above", [0, 700], ids=["in the head", "below the head"])
@pytest.mark.parametrize(
    ("separator", "decimal", "mark"),
    [(";", ",", "."), ("\t", ".", "'"), (";", ",", "\xa0"), (";", ",", " "), ("\t", ".", ","),
     (";", ".", "\u2019"), (",", ".", ",")],
)  # fmt: skip
@pytest.mark.parametrize("both", [False, True])
@pytest.mark.parametrize("decimals", [0, 1, 3])
def test_groups_of_digits_are_read_wherever_the_first_is(
    decimals: int, both: bool, separator: str, decimal: str, mark: str, above: int, tmp_path: Path
) -> None:
    """Pressures pass 1000 far below the first line of numbers, and so may counting angles."""
    angle = 0.5 * np.arange(-above, 2200) + (1.0 if both else -700.0)
    pressure = np.round(980.0 + 0.5 * angle**2 / 1e4 + 12.0 * np.arange(len(angle)) % 311, decimals)
    pressure[:above] = np.minimum(pressure[:above], 999.0)
    rows = zip(angle, pressure, strict=True)
    quote = '"' if mark == separator else ""
    texts = [
        f"{quote}{grouped(a, 1, decimal, mark)}{quote}{separator}"
        f"{quote}{grouped(p, decimals, decimal, mark)}{quote}" for a, p in rows
    ]  # fmt: skip
    head = f"angle [deg]{separator}p_cyl [kPa]"
    (tmp_path / "a.csv").write_text("\n".join([head, *texts]) + "\n", encoding="utf-8")
    read = read_recording(tmp_path / "a.csv", "a.csv")
    assert np.allclose(read.numbers("angle"), angle, rtol=1e-15)
    assert np.allclose(read.numbers("p_cyl"), pressure, rtol=1e-15)
    assert any("groups of three digits" in one for one in read.said)


@pytest.mark.parametrize("mark", [".", ","])
def test_groups_that_may_be_decimals_are_refused_unless_the_decimal_mark_is_given(
    mark: str, tmp_path: Path
) -> None:
    pressure = np.concatenate([np.arange(400, 1600, 3), np.arange(1600, 400, -3)])
    texts = [f"{n};{grouped(p, 0, '?', mark)}" for n, p in enumerate(pressure[:700])]
    (tmp_path / "a.csv").write_text("\n".join(["angle [deg];p_cyl [kPa]", *texts]))
    unclear = read_recording(tmp_path / "a.csv", "a.csv")
    assert np.array_equal(unclear.numbers("angle"), np.arange(700))
    first = int(np.flatnonzero(pressure >= 1000)[0])
    with pytest.raises(sweeps.SceneError) as error:
        unclear.numbers("p_cyl")
    text = grouped(pressure[first], 0, "?", mark)
    assert f"column 'p_cyl', line {first + 2}: '{text}' is {pressure[first]} in" in str(error.value)
    other = "." if mark == "," else ","
    given = read_recording(tmp_path / "a.csv", "a.csv", ReadingChoices(decimal=other))
    assert np.array_equal(given.numbers("p_cyl"), pressure[:700])
    given = read_recording(tmp_path / "a.csv", "a.csv", ReadingChoices(decimal=mark))
    assert given.numbers("p_cyl")[first] == pressure[first] / 1000.0


def test_a_text_is_named_and_no_good_number_above_it(tmp_path: Path) -> None:
    texts = [f"{a},5;{108 + a},0" for a in range(700)]
    texts[640] = "640,5;1.08,0"
    (tmp_path / "a.csv").write_text("\n".join(["angle [deg];p_cyl [kPa]", *texts]))
    with pytest.raises(sweeps.SceneError, match=r"line 642: '1\.08,0': must be a finite number"):
        read_recording(tmp_path / "a.csv", "a.csv").numbers("p_cyl")
