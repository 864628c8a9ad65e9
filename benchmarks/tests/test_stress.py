"""A small part of `make stress`: absurd designs, spoiled diagrams, and the meter of delta_error."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks import tables
from benchmarks.command import ROOT
from benchmarks.stress import (
    absurd,
    calibration,
    draw,
    driven,
    findings,
    sampled,
    shapes,
    spikes,
    strong,
    suite,
)
from benchmarks.stress.checks import VANISHING, check
from benchmarks.stress.findings import Findings
from benchmarks.stress.judging import VERDICTS
from engine_dyn import diagram_from_points
from engine_dyn.pressure.family import family_from_diagrams
from engine_dyn.speed import dispatch
from engine_dyn.speed.fields import SCALAR_NAMES
from engine_dyn.speed.torque import mean_gas_torque
from engine_dyn.status import CONVERGED, STALLED, TOLERANCE_NOT_MET
from oracle import spline
from oracle.spline import velocity

pytestmark = pytest.mark.compiled

SEED = 5
SIZE = 3000
FEW = 400
"""Designs of a chunk of which many are near a stall, where each of them takes long."""

DESIGNS = tomllib.loads(Path(__file__).with_name("designs.toml").read_text(encoding="utf-8"))
"""Designs that once failed, by names."""


def by_name(begin: str) -> Any:
    """Every design whose name begins so."""
    chosen = {name: design for name, design in DESIGNS.items() if name.startswith(begin)}
    return pytest.mark.parametrize("design", chosen.values(), ids=list(chosen))


@pytest.mark.parametrize("number", [1, 5, 10, 16])
def test_absurd_designs_break_no_rule(number: int) -> None:
    """Groups, tables of designs that share nothing and products, both closures."""
    found = absurd.one((SEED, number, FEW, 20))
    assert found.of("status") > 0
    rules = {row["rule"] for row in tables.read(ROOT / "docs" / "stability" / "rules.csv")}
    assert {key[1] for key in found.counts if key[0] == "broken"} == rules
    assert found.of("again") == absurd.AGAIN
    assert found.total(VERDICTS) == 20
    assert found.defects == 0, found.examples[:3]  # no broken rule, bit for bit, and the same
    assert found.total(("agrees", "honest")) > 10


def test_every_rule_is_broken_by_something() -> None:
    """The checks see what they are there for."""
    chunk = draw.table(SEED, 1, FEW)
    columns, bounds = chunk.flat(), draw.shapes().bounds(chunk.flat())
    found = chunk.solve()
    good = int(np.flatnonzero((found["status"] == 0) & (found["delta"] > 1e-3))[0])

    def rules(**changes: Any) -> set[str]:
        spoiled = {name: array.copy() for name, array in found.items()}
        for name, value in changes.items():
            spoiled[name][good] = value
        broken = check(columns, chunk.closure, bounds, spoiled)
        return {name for name, mask in broken.items() if mask[good]}

    high, low = found["omega_max"][good], found["omega_min"][good]
    assert rules() == set()
    assert "outcome" in rules(status=6)
    assert "numbers" in rules(delta=np.nan)
    assert "numbers" in rules(status=1)
    assert "order" in rules(omega_min=-low)
    assert "delta" in rules(delta=found["delta"][good] * (1.0 + 1e-9))
    assert "closure" in rules(omega_max=0.999 * low, omega_min=0.9 * low)
    assert "load" in rules(load_factor=1.01)
    assert "energy" in rules(omega_max=1e3 * high)
    assert "tolerance" in rules(delta_error=1e-3)
    assert "idle" in rules(status=2)
    assert "inertia" in rules(status=4)
    stalled = {name: array.copy() for name, array in found.items()}
    stalled["status"][:] = 1
    broken = check(columns, chunk.closure, bounds, stalled)["no false stall"]
    assert 0 < broken.sum() < FEW and not broken[found["status"] == 1].any()


@pytest.mark.parametrize("count", [1, 2, 5, 13, 16])
def test_the_least_inertia_of_the_rules_is_exact_enough(count: int) -> None:
    # Of many cylinders it is a high power of the crank ratio: no cubic through values follows it.
    ratios = np.random.default_rng(count).uniform(0.15, 0.9, 200)
    columns = {
        "crank_ratio": ratios, "cylinders": np.full(200, count), "row": np.zeros(200),
        "crankcase": np.full(200, 101325.0), "stroke": 1.0, "bore": 1.0, "mass": 1.0, "speed": 1.0,
    }  # fmt: skip
    phi = np.arange(4000 * count) * (shapes.CYCLE / (4000 * count))
    square = shapes.folded(velocity(phi, ratios[:, None]) ** 2, count)
    exact = square.min(axis=1) - square.mean(axis=1)
    found = draw.shapes().bounds(columns).least_square
    seen = np.abs(exact) > 1e-10  # less has not enough digits in a sum of some ten squares
    assert np.abs(found / exact - 1.0)[seen].max() < 0.5 * VANISHING


def test_a_chunk_that_hangs_is_reported_and_left() -> None:
    words: list[str] = []
    found = absurd.run(SEED, 2, 1, words.append, limit=1e-4)
    assert found.of("status") == 0 and words == []
    lost = {f"seed {SEED}, chunk {i}: no answer in 0.0005 s" for i in range(2)}
    assert {key[1] for key in found.counts if key[0] == "lost"} == lost and found.defects == 2


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")  # as in the processes where these parts run otherwise
def test_command_writes_every_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The whole of it, small; the names of the files and sentences are those of docs.

    All in this process: three others would each prepare the diagrams again. A chunk that hangs in
    a process of its own has another test.
    """

    def here(work: Any, jobs: list[Any], *_: Any) -> Any:
        return map(work, jobs)

    monkeypatch.setattr(absurd, "answers", here)
    monkeypatch.setattr(findings, "in_processes", here)
    monkeypatch.setattr(suite, "ROOT", tmp_path)
    # Other tests solve more of these.
    monkeypatch.setattr(sampled, "FEWEST", 50)
    monkeypatch.setattr(strong, "MOST_CYLINDERS", 1)
    words = "--designs 400 --sample 9 --calibrate 40 --diagrams 1 --flywheels 1 --driven 12"
    words += " --sampled 100 --checked 0 --processes 1 -o"
    assert suite.main([*words.split(), str(tmp_path)]) == 0
    assert (tmp_path / "out" / "stress.json").exists()
    made = {path.name for path in (tmp_path / "stability").iterdir()}
    for name in made:
        lines = [(f / "stability" / name).read_text("utf-8") for f in (tmp_path, ROOT / "docs")]
        assert lines[0].splitlines()[0] == lines[1].splitlines()[0]
    by_hand = {"drawn.csv", "rules.csv", "verdicts.csv", "error_ranges.csv"}
    assert made | by_hand == {path.name for path in (ROOT / "docs" / "stability").iterdir()}
    found, before = (
        [row["what"] for row in tables.read(folder / "stability" / "summary.csv")]
        for folder in (tmp_path, ROOT / "docs")
    )
    assert found == before


@pytest.mark.parametrize(
    ("number", "closure", "index"),
    [(2, "cycle_time", 1701), (4, "power_mean", 2711)],
    ids=["it runs", "it stalls"],
)
def test_stiff_loads_have_true_outcomes(number: int, closure: str, index: int) -> None:
    """Designs that once had status 0 and a largest speed below the smallest."""
    columns = draw.table(SEED, number, SIZE).flat([index])
    part = draw.Chunk(columns, closure, (1,), (SEED, number))
    exact = draw.exact(columns, closure)
    assert absurd.agreement(part, part.solve(), exact, [index]).defects == 0


def pressure(row: int, phi: Any) -> Any:
    """Pressure of a whole row of the drawn diagrams [Pa]."""
    return draw.family().row(row)(phi)


def one_design(**values: float) -> draw.Chunk:
    """A chunk of one design of the drawn diagrams, power mean."""
    columns = {name: np.array([values[name]]) for name in draw.COLUMNS}
    return draw.Chunk(columns, "power_mean", (1,), (SEED, 0))


@by_name("masses far above the inertia")
def test_masses_far_above_the_inertia_leave_the_closure(design: dict[str, Any]) -> None:
    """Squares of many cylinders add up to a constant: what rounding leaves of its mean counts.

    It was 1e-13, one-sided, and grew with the nodes; masses 1e6 times the inertia made 1e-7 of it.
    With exponent 2 the mean of omega^2 is the nominal speed's, so the mean speed is below it.
    """
    found = one_design(**design).solve()
    assert found["omega_mean"][0] <= design["speed"] * (1.0 + 1e-12)
    assert found["omega_min"][0] < design["speed"] < found["omega_max"][0]


def strong_loads(count: int, exponent: float) -> dict[str, Any]:
    """Columns of designs that run, kappa 1e6 to 1e14: the load follows the torque of the moment.

    The first one is that of the ten million (chunk 76) whose mean speed came out above the asked
    one: q = 1 + work - load, and the work was 1e10 times the kinetic energy.
    """
    random = np.random.default_rng(SEED)
    columns: dict[str, Any] = {
        "crankcase": np.zeros(count), "exponent": np.full(count, exponent),
        "variable": np.zeros(count, dtype=bool),
        "row": random.choice([128.25, 0.0, 150.0], count),
        "crank_ratio": random.uniform(0.05, 0.9, count),
        "cylinders": random.integers(1, 9, count),
        "bore": 10.0 ** random.uniform(-1.0, 0.0, count),
        "stroke": 10.0 ** random.uniform(-1.5, -0.5, count),
        "speed": 10.0 ** random.uniform(-0.5, 2.0, count), "mass": np.full(count, 1e-6),
    }  # fmt: skip
    bounds = draw.shapes().bounds(columns)
    surplus = bounds.torque_most * 10.0 ** random.uniform(0.1, 3.0, count)
    kappa = 10.0 ** random.uniform(6.0, 14.0, count)
    columns |= {
        "inertia": 2.0 * surplus / (kappa * columns["speed"] ** 2),
        "mean_torque": bounds.mean_gas, "friction": np.zeros(count),
        "offset": bounds.mean_gas - surplus,
    }  # fmt: skip
    for name, value in DESIGNS["strong load"].items():
        columns[name][0] = value
    return columns


def of_the_moment(columns: dict[str, Any], i: int) -> tuple[float, float, float]:
    """Largest, smallest and mean speed at which the load takes what the torque gives just then.

    With y = u - 1 the equation y' + kappa y = kappa m is y = m - m'/kappa + ...; m is the torque's
    deviation over the load's mean.
    """
    one = {name: column[i : i + 1] for name, column in columns.items()}
    period = spline.CYCLE / int(one["cylinders"][0])
    batch = spline.Batch(
        draw.designs_of(one, "power_mean"), pressure,
        spline.pieces_of(draw.family().row(0).angle, int(one["cylinders"][0]), spline.WIDEST),
    )  # fmt: skip
    phi = np.arange(round(period * 20000)) * (period / round(period * 20000))
    torque = batch.gas[:, 0] * (batch.shapes(phi[None])[0] - batch.mean[:, 0])
    m = ((torque - batch.eta[:, 0] * batch.slopes(phi[None])) / batch.kappa[:, 0])[0]
    slope = (np.roll(m, -1) - np.roll(m, 1)) / (2.0 * phi[1])
    u = 1.0 + m - slope / batch.kappa[0, 0, 0]
    speed = one["speed"][0] * np.sqrt(u)
    return speed.max(), speed.min(), speed.mean()


def test_overwhelming_square_loads_keep_their_digits() -> None:
    """Once 6 % off with status 5, and from kappa = 1e12 on stalled."""
    columns = strong_loads(24, 2.0)
    for wanted in (draw.WITHOUT_ERROR, SCALAR_NAMES):
        part = draw.Chunk(columns, "power_mean", (24,), (SEED, 0), wanted)
        found = part.solve()
        broken = check(columns, "power_mean", draw.shapes().bounds(columns), found)
        assert {name for name, mask in broken.items() if mask.any()} == set()
        assert (found["status"] == CONVERGED).sum() > 20
        for i in range(24):
            assert found["status"][i] in (CONVERGED, TOLERANCE_NOT_MET)
            high, low, mean = of_the_moment(columns, i)
            misses = [
                abs(found["delta"][i] * mean / (high - low) - 1.0),
                abs(found["omega_min"][i] / low - 1.0), abs(found["omega_mean"][i] / mean - 1.0),
            ]  # fmt: skip
            error = max(1e-6, found["delta_error"][i]) if "delta_error" in found else 1e-6
            assert max(misses) <= error or found["status"][i] == TOLERANCE_NOT_MET


@pytest.mark.parametrize(
    ("closure", "exponent"), [("cycle_time", 1.0), ("cycle_time", 2.0), ("power_mean", 3.3)]
)
def test_overwhelming_loads_do_not_stall(closure: str, exponent: float) -> None:
    """The mean torque is above the torque's range, and the load follows: none comes near a stop.

    Newton's method kept work and load apart, whose sum had no digits from kappa = 1e10 on.
    """
    columns = strong_loads(24, exponent)
    found = draw.Chunk(columns, closure, (24,), (SEED, 0), draw.WITHOUT_ERROR).solve()
    assert not (found["status"] == STALLED).any()
    assert np.isin(found["status"], (CONVERGED, TOLERANCE_NOT_MET)).sum() >= 12


def test_curve_of_an_overwhelming_square_load() -> None:
    """At the first node and between nodes: the speed, and its acceleration by differences."""
    columns = {name: column[:1] for name, column in strong_loads(1, 2.0).items()}
    at = np.radians(np.array([20.0, 20.0 + 1e-3, 20.0 - 1e-3, 33.37, 33.37 + 1e-3, 33.37 - 1e-3]))
    part = draw.Chunk(columns, "power_mean", (1,), (SEED, 0), ("omega", "angular_acceleration"))
    found = part.solve(crank_angle=at)
    omega, rate = found["omega"][0], found["angular_acceleration"][0]
    for k in (0, 3):
        slope = (omega[k + 1] - omega[k + 2]) / (at[k + 1] - at[k + 2])
        assert rate[k] == pytest.approx(omega[k] * slope, rel=1e-3)


def test_status_tells_of_the_smallest_speed_too() -> None:
    """Near a stall delta can be good where omega_min is not: once status 0, off by 2e-6.

    A third method (Radau's by SciPy, between the knots, to 1e-11) gave 0.80331920996 rad/s.
    """
    part = one_design(**DESIGNS["smallest speed"])
    asked = part.solve()
    without = replace(part, wanted=("omega_min",)).solve()
    for found in (asked, without):
        assert found["status"][0] == CONVERGED
        assert found["omega_min"][0] == pytest.approx(0.80331920996, rel=1e-6)
    error = abs(asked["omega_min"][0] / 0.80331920996 - 1.0)
    assert error <= asked["delta_error"][0]
    coarse = part.solve(finer=4, iterated=1e-8)  # is not solved again
    assert abs(coarse["omega_min"][0] / 0.80331920996 - 1.0) > 5e-7
    assert coarse["status"][0] == TOLERANCE_NOT_MET


@by_name("the finer solution is finer")
def test_the_finer_solution_is_finer(design: dict[str, Any]) -> None:
    """Designs whose error was above `delta_error`: both solutions had nearly the same one.

    One was left to the general method by the coarser solution only; of the other both stopped
    iterating after the same pass.
    """
    diagrams = calibration.diagrams()[design["diagrams"]]
    part = replace(one_design(**design), diagrams=diagrams)
    exact, found = part.exact(), part.solve()
    error = abs(found["delta"][0] / exact.delta[0] - 1.0)
    assert 1e-11 < error <= found["delta_error"][0] <= 1e-6


def speeds_with(exponent: float) -> Any:
    """Mean speeds of designs of a drawn table, all with one exponent."""
    count = 80
    columns = draw.table(SEED, 4, SIZE).flat(slice(0, count)) | {
        "exponent": np.full(count, exponent)
    }
    return draw.Chunk(columns, "power_mean", (count,), (SEED, 4)).solve()["omega_mean"]


@pytest.fixture(scope="module")
def geometric() -> Any:
    return speeds_with(0.0)


@pytest.mark.parametrize("exponent", [1.1e-8, 5.1e-8, 1e-7, 1e-6])
def test_tiny_exponents_keep_the_digits_of_the_speed(exponent: float, geometric: Any) -> None:
    """The power mean of such an order is the geometric mean but for alpha/2 var(log omega)."""
    found = speeds_with(exponent)
    both = np.isfinite(geometric) & np.isfinite(found)
    assert both.sum() > 10
    np.testing.assert_allclose(found[both], geometric[both], rtol=1e-8 + exponent)


@pytest.mark.parametrize("group", [2, 4])
def test_driven_machines(group: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """A motor, and a driver table: deviations shrink by up to e^-9000 in a cycle."""
    monkeypatch.setattr(driven, "GROUP", 4)
    result = driven.compare((1, group))
    assert result.total(driven.VERDICTS) == 4
    assert result.defects == 0, result.examples
    assert max(value for what, value in result.worst.items() if isinstance(what, tuple)) > 500.0


def test_what_is_said_of_driven_machines_is_judged() -> None:
    """A false stall, false numbers and a false claim of accuracy are seen."""
    chosen = driven.machine(1, 4)
    _, family = driven.diagram(chosen.fired)
    found = dispatch.solve(
        wanted=("delta", "omega_max", "omega_min", "omega_mean", "delta_error", "omega"),
        family=family, driven=chosen.driven, crank_angle=np.zeros(1), threads=1, **chosen.inputs,
    )  # fmt: skip
    found["load_factor"] = np.ones(driven.GROUP)

    def verdict(**changes: Any) -> str:
        spoiled = {name: array.copy() for name, array in found.items()}
        for name, value in changes.items():
            spoiled[name][0] = value
        return driven.judge(chosen, 0, spoiled)[0]

    assert verdict() == "agrees"
    assert verdict(status=STALLED) == "outcome"
    assert verdict(status=3) == "outcome"
    assert verdict(delta=1.00001 * found["delta"][0]) == "off"
    assert verdict(status=TOLERANCE_NOT_MET) == "honest"
    wrong = 1.00001 * found["omega_min"][0]
    assert verdict(status=TOLERANCE_NOT_MET, omega_min=wrong) == "off"


def test_light_flywheels(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(strong, "EXPONENTS", {"0.1 to 4": (0.1, 4.0), "2": (2.0, 2.0)})
    monkeypatch.setattr(strong, "MOST_CYLINDERS", 2)
    result = strong.run(SEED, 2, lambda words: None)
    assert result.defects == 0, result.examples
    assert min(result.of("agrees", *key) for key in result.worst) > 1000


@pytest.mark.parametrize("kind", spikes.KINDS)
def test_spoiled_diagrams(kind: str) -> None:
    """A spike, noise or steps are solved as the spline that they make, or refused."""
    result = Findings()
    random = np.random.default_rng([SEED, spikes.KINDS.index(kind)])
    for _ in range(6):
        spikes.one(kind, random, result)
    assert result.defects == 0, result.examples
    assert result.of("agrees") > 0


@pytest.mark.parametrize(
    ("kind", "seed", "designs"),
    [
        ("spike", 19, 30), ("spike", 21, 70), ("noise", 13, 30), ("noise", 20, 70),
        ("steps", 2, 30), ("steps", 2, 70),
    ],
)  # fmt: skip
def test_status_of_spoiled_diagrams_without_delta_error(kind: str, seed: int, designs: int) -> None:
    """Status 0 is true by the estimate of the kernels alone, with one table and with many.

    Against Newton's method with eight times the nodes. Of each draw one design was off by 2e-6 to
    3e-3 under status 0, when the kernels took every diagram for a smooth one.
    """
    random = np.random.default_rng([11, seed, spikes.KINDS.index(kind)])
    family = family_from_diagrams([0.0], [diagram_from_points(*spikes.spoiled(kind, random))])
    bore = random.uniform(0.05, 0.25, designs)
    stroke = bore * random.uniform(0.7, 1.6, designs)
    crank_ratio = random.uniform(0.05, 0.9, designs if designs > 64 else 1)
    cylinders = int(random.integers(1, 9))
    lever = 0.125 * np.pi * np.square(bore) * stroke
    given = {
        "family": family, "cylinders": cylinders, "crank_ratio": crank_ratio, "row": 0.0,
        "scale": 1.0, "crankcase_pressure": 101325.0, "bore": bore, "double_radius": stroke,
        "mass": random.uniform(0.1, 3.0, designs) * (bore / 0.1) ** 3,
        "inertia": 10.0 ** random.uniform(-1.5, 1.5, designs) * (bore / 0.1) ** 5,
        "speed": 10.0 ** random.uniform(2.5, 3.7, designs) * np.pi / 30.0,
        "exponent": random.choice([0.0, 1.0, 2.0, 1.6], designs), "offset": 0.0,
        "inertia_model": random.choice(["constant", "variable"], designs),
        "mean_torque": cylinders * lever * mean_gas_torque(crank_ratio, 0.0, family),
        "friction_torque": 0.0,
    }  # fmt: skip
    names = ("delta", "omega_min", "omega_max", "omega_mean")
    found = dispatch.solve(wanted=names, **given)
    exact = dispatch.solve(wanted=names, method="newton", finer=8, iterated=1e-13, **given)
    met = found["status"] == CONVERGED
    assert met.sum() > 0.5 * designs
    for name in names:
        np.testing.assert_allclose(found[name][met], exact[name][met], rtol=1e-6)


@pytest.fixture(scope="module")
def reading() -> Findings:
    total = Findings()
    for job in calibration.jobs_of(SEED, 200):
        total.add(calibration.measure(job))
    return total


def test_tolerance_is_met_on_sane_designs(reading: Findings) -> None:
    true, good = reading.array("true"), reading.array("status") == 0
    assert true.size >= 0.95 * reading.of("asked")
    assert good.mean() > 0.99
    assert true[good].max() <= 1e-6


def test_delta_error_is_calibrated(reading: Findings) -> None:
    """Of so few designs none may be above the estimate."""
    numbers = calibration.Numbers.of(reading.array("true"), reading.array("estimate"))
    assert numbers.covered >= calibration.COVERAGE
    assert numbers.median <= calibration.MEDIAN
    assert numbers.tail <= calibration.TAIL
    assert numbers.met


def test_peaks_where_the_inertia_nearly_vanishes() -> None:
    """Theta(phi) falls to 2e-4 of its mean; the load is weak but for the peak of the speed there.

    A design of the stress suite's ten million (chunk 31). With pieces of half a degree alone delta
    would be off by 9e-6, and without doubt.
    """
    designs = spline.Designs.of(**DESIGNS["peaks where the inertia nearly vanishes"])
    one, four = (
        spline.solve(designs, pressure, draw.family().row(0).angle, splits) for splits in (1, 4)
    )
    assert one.least_inertia[0] < 3e-4
    assert one.delta[0] == pytest.approx(four.delta[0], rel=1e-8)
    assert one.omega_mean[0] == pytest.approx(four.omega_mean[0], rel=1e-8)
    assert 1e-6 < one.doubt[0] < 1e-4
