"""Raw files of one synthetic engine in the styles of laboratories."""

import warnings
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from tests.support import recorded_engine

NOISE = 5e3
"""Standard deviation of the noise of each sample [Pa]."""

DEGREE = np.pi / 180.0


def samples(start: float, count: int = 1440, step: float = 0.5, seed: int = 1) -> tuple[Any, Any]:
    """Angles from `start` on [degree, firing dead centre = 0], and noisy pressures [bar]."""
    angle = start + step * np.arange(count)
    inside = (angle + 360.0) % 720.0 - 360.0
    noise = NOISE * np.random.default_rng(seed).standard_normal(count)
    return angle, (recorded_engine.pressure(inside * DEGREE) + noise) / 1e5


def imep(angle: Any, pressure: Any) -> float:
    """Net imep [bar] of angles [rad] and pressures [Pa] of one cycle, by trapezoids."""
    volume = recorded_engine.volume(np.append(angle, angle[0]))
    closed = np.append(pressure, pressure[0])
    work = float((0.5 * (closed[1:] + closed[:-1]) * np.diff(volume)).sum())
    return work / recorded_engine.SWEPT / 1e5


def rows(*columns: Any, separator: str = ",", comma: bool = False, form: str = ".5f") -> str:
    """Lines of numbers."""
    lines = [separator.join(format(v, form) for v in row) for row in zip(*columns, strict=True)]
    text = "\n".join(lines) + "\n"
    return text.replace(".", ",") if comma else text


def own(path: Path) -> None:
    angle, pressure = samples(-360.0, 1441)
    pressure[-1] = pressure[0]
    path.write_text("crank_angle_deg,pressure_bar\n" + rows(angle, pressure))


def avl(path: Path) -> None:
    angle, pressure = samples(-360.0, seed=2)
    head = "Measurement;Run 12\nDate;2024-05-03\n\nCA;PCYL1;PINT1\ndeg;bar;bar\n"
    path.write_text(head + rows(angle, pressure, 0 * angle + 0.98, separator=";"))


def excel_german(path: Path) -> None:
    angle, pressure = samples(0.0, seed=3)
    head = "Kurbelwinkel [°KW];Zylinderdruck [bar]\r\n"
    text = rows(angle, pressure, separator=";", comma=True).replace("\n", "\r\n")
    path.write_bytes((head + text).encode("cp1252"))


def kistler(path: Path) -> None:
    angle, pressure = samples(-180.0, seed=4)
    head = '% KiBox\n% cycles 1\n"Crank angle"\t"pCyl"\t\n"°CA"\t"kPa"\t\n'
    path.write_text(head + rows(angle, 100 * pressure, separator="\t").replace("\n", "\t\n"))


def descending(path: Path) -> None:
    angle, pressure = samples(-360.0, seed=5)
    path.write_text("angle  pressure_psi\n" + rows(angle[::-1], pressure[::-1] * 14.5037738,
                                                   separator="   "))  # fmt: skip


def xlsx(path: Path) -> None:
    import pandas as pd

    angle, pressure = samples(0.0, seed=6)  # 0 is bottom dead centre before compression: -180
    pd.DataFrame({"phi (deg)": (angle + 180.0) % 720.0, "p [bar]": pressure}).to_excel(
        path, index=False
    )


def matlab(path: Path) -> None:
    from scipy.io import savemat

    angle, pressure = samples(-360.0, 1440 * 20, seed=7)
    savemat(path, {"CA_deg": angle[:1440], "p_cyl": pressure.reshape(20, 1440) / 10.0},
            do_compression=True)  # fmt: skip


def matlab_structure(path: Path) -> None:
    from scipy.io import savemat

    angle, pressure = samples(-360.0, seed=15)
    savemat(path, {"run": {"CA": angle, "pressure": pressure}})


def tdms(path: Path) -> None:
    from nptdms import ChannelObject, TdmsWriter

    angle, pressure = samples(-360.0, seed=8)
    channels = [
        ChannelObject("run", "angle", angle * DEGREE, {"unit_string": "rad"}),
        ChannelObject("run", "kistler", (pressure + 2.0) / 20.0, {"unit_string": "V"}),
    ]
    with TdmsWriter(path) as file:
        file.write_segment(channels)


def mf4(path: Path) -> None:
    """Cycles one after the other, an encoder with one mark a turn, zero at gas exchange."""
    from asammdf import MDF, Signal

    angle, pressure = samples(-360.0, 1440 * 10, seed=9)
    times = angle / (6.0 * 1500.0)
    times -= times[0]
    with MDF(version="4.10") as file:
        file.append([
            Signal(angle % 360.0, times, name="CA", unit="deg"),
            Signal(pressure, times, name="PCYL", unit="bar"),
        ])  # fmt: skip
        file.save(path)


def parquet(path: Path) -> None:
    """Rows that fall with the angle counted backward, in time: before dead centre positive."""
    import pandas as pd

    angle, pressure = samples(-360.0, seed=10)
    pd.DataFrame(
        {"crank angle [deg]": -angle, "cylinder pressure [MPa]": pressure / 10.0}
    ).to_parquet(path)


def netcdf(path: Path) -> None:
    import netCDF4

    angle, pressure = samples(-360.0, 1440 * 3, seed=11)
    with netCDF4.Dataset(path, "w") as file:
        file.createDimension("sample", len(angle))
        for name, unit, values in (("angle", "degree", angle), ("pressure", "hPa", pressure * 1e3)):
            variable = file.createVariable(name, "f8", ("sample",))
            variable.units = unit
            variable[:] = values


def universal(path: Path, binary: int = 0) -> None:
    """A data set that is no curve, and two curves over the same angles."""
    import pyuff

    angle, pressure = samples(-360.0, seed=16)
    same = {"type": 58, "binary": binary, "func_type": 0, "rsp_node": 0, "rsp_dir": 0,
            "ref_node": 0, "ref_dir": 0, "abscissa_spacing": 1, "orddenom_spec_data_type": 0,
            "x": angle, "abscissa_axis_lab": "CA", "abscissa_axis_units_lab": "deg"}  # fmt: skip
    curve = {"ordinate_axis_lab": "PCYL1", "ordinate_axis_units_lab": "bar", "data": pressure}
    path.write_text("    -1\n   151\nengine\n    -1\n")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)  # pyuff leaves binary files open
        pyuff.UFF(str(path)).write_sets(
            [{**same, "id1": "level", "data": 0.5 * angle}, {**same, **curve}]
        )


def rows_of_cycles(path: Path) -> None:
    angle, pressure = samples(-360.0, 720 * 5, 1.0, seed=12)
    head = "cycle;" + ";".join(f"{a:g}" for a in angle[:720]) + "\n"
    lines = [f"{k};" + rows(*[[v] for v in row], separator=";") for k, row in
             enumerate(pressure.reshape(5, 720), start=1)]  # fmt: skip
    path.write_text(head + "".join(lines))


def four_cylinders(path: Path, late: float = 0.0) -> None:
    """In-line four, order 1-3-4-2; cylinder 2 with 5 % more pressure rise."""
    angle, _ = samples(0.0)
    columns = [angle]
    for number, fires in enumerate((0.0, 540.0, 180.0, 360.0), start=1):
        inside = (angle - fires - late + 360.0) % 720.0 - 360.0
        p = recorded_engine.pressure(inside * DEGREE) / 1e5
        columns.append(p * (1.05 if number == 2 else 1.0))
    head = "CA [deg],PCYL1 [bar],PCYL2 [bar],PCYL3 [bar],PCYL4 [bar]\n"
    path.write_text(head + rows(*columns))


def fixed_width(path: Path) -> None:
    """Columns of eight characters without a separator; the second one is often blank."""
    angle, pressure = samples(-360.0, seed=7)
    torques = [f"{place:8.2f}" if place % 100 == 0 else " " * 8 for place in range(len(angle))]
    lines = [f"{a:8.2f}{t}{p:9.4f}" for a, t, p in zip(angle, torques, pressure, strict=True)]
    head = "Run 12 of 2024-05-03\n\nCA [deg]  M [Nm]  p [bar]\n"
    path.write_text(head + "\n".join(lines) + "\n")


def before_dead_centre(path: Path) -> None:
    """Angles that count down to dead centre, in the order of time, and a row of odd units."""
    angle, pressure = samples(-360.0, seed=13)
    head = "Crank angle;Trigger;p_cyl;Mode\ndeg BTDC;Flag;bar;Flag\n"
    text = rows(-angle, 0 * angle, pressure, 0 * angle, separator=";")
    path.write_bytes((head + text + "\n\x1a").encode())


def named_before(path: Path) -> None:
    """The name, not the unit, says how the angles count; rows against the order of time."""
    angle, pressure = samples(-360.0, seed=14)
    path.write_text("CAD BTDC [deg],p [bar]\n" + rows(-angle[::-1], pressure[::-1]))


STYLES: dict[str, tuple[Callable[[Path], None], str, dict[str, Any]]] = {
    "own format": (own, "own.csv", {}),
    "AVL": (avl, "avl.csv", {}),
    "Excel, German": (excel_german, "excel.csv", {}),
    "Kistler, kPa": (kistler, "kistler.txt", {}),
    "descending, psi": (descending, "descending.dat", {}),
    "xlsx from bottom dead centre": (xlsx, "sheet.xlsx", {"zero": "BDC"}),
    "mat, rows of cycles": (matlab, "run.mat", {"unit": "MPa", "average": True}),
    "mat, structure": (matlab_structure, "run.mat", {"unit": "bar"}),
    "tdms, volts": (tdms, "run.tdms", {"pressure_column": "kistler",
                                       "calibration": [20.0, -2.0]}),
    "mf4, one mark a turn": (mf4, "run.mf4", {"average": True}),
    "parquet, backward": (parquet, "run.parquet", {"direction": "backward"}),
    "universal file": (universal, "run.unv", {}),
    "universal file, binary": (partial(universal, binary=1), "run.uff", {}),
    "netCDF, several cycles": (netcdf, "run.nc", {"average": True}),
    "fixed width, with blank fields": (fixed_width, "run12.txt", {"format": "fixed_width"}),
    "text, of another ending": (avl, "run12.ind", {}),
    "angles before dead centre": (before_dead_centre, "before.csv", {}),
    "angles named so": (named_before, "named.csv", {}),
    "text, rows of cycles": (rows_of_cycles, "rows.csv", {"unit": "bar", "average": True}),
}  # fmt: skip
"""Style: what writes the file, its name, and the options that it needs."""
