"""Kinds of study: no code of Python runs once per design, and their measurement works."""

from __future__ import annotations

from typing import Any

import pytest

import sweeps
from benchmarks import study_rates, study_times, warm_run
from benchmarks.studies import STUDIES, Study, study
from engine_dyn.speed.mechanisms import BATCH, counted
from sweeps.scene.plan import forecast
from sweeps.scene.plan.plan import make_plan
from sweeps.scene.plan.rates import SERIAL
from sweeps.scene.reading import read_scene

FEW, MANY = 3000, 30_000
"""Numbers of designs between which calls are compared. Few are so many that they need nearly every
row of a family of diagrams."""

MOST_CALLS, MOST_OWN_CALLS, MOST_FRAMES = 12_000, 2500, 10
"""Of a warm run of two designs: other people's libraries included, of our functions, and functions
on the way to the kernel."""

ALLOWED = 0.1
"""Calls of Python that a further design may bring, because a few more rows are needed."""

solved = pytest.mark.parametrize(
    "one", [one for one in STUDIES if not one.modelled], ids=lambda one: one.name
)
"""Every kind of study but modelled cycles, which are made one by one."""


def calls_of_python(scene: dict[str, Any]) -> int:
    """Functions of Python that are called while a scene is computed in this thread."""
    return warm_run.called(lambda: sweeps.run(scene, threads=1))[0].total()


@pytest.mark.compiled
@pytest.mark.slow
def test_a_warm_run_makes_few_calls() -> None:
    calls, way = warm_run.called(warm_run.warm())
    own = sum(count for place, count in calls.items() if warm_run.ours(place))
    assert 0 < own < MOST_OWN_CALLS and own < calls.total() < MOST_CALLS
    assert 0 < len(way) < MOST_FRAMES
    assert way[0].endswith("in_memory.py: run")


@pytest.mark.compiled
@pytest.mark.slow
@solved
def test_calls_of_python_do_not_grow_with_the_number_of_designs(one: Study) -> None:
    scenes = [one.build(size) for size in (FEW, MANY)]
    designs = [sweeps.run(scene, threads=1)["delta"].size for scene in scenes]
    few, many = (calls_of_python(scene) for scene in scenes)
    assert many - few <= ALLOWED * (designs[1] - designs[0]), (few, many)


@pytest.mark.compiled
@pytest.mark.slow
def test_lists_of_designs_are_read_without_a_loop_in_python() -> None:
    """As a scene's file has them."""
    scenes = [study("sampled").build(size) for size in (FEW, MANY)]
    for scene in scenes:
        scene["designs"] = {name: column.tolist() for name, column in scene["designs"].items()}
        sweeps.run(scene, threads=1)
    few, many = (calls_of_python(scene) for scene in scenes)
    assert many - few <= ALLOWED * (MANY - FEW), (few, many)


def test_a_study_is_known_by_its_name() -> None:
    assert study("sampled").name == "sampled"
    with pytest.raises(ValueError, match="no study; there are one_table, "):
        study("unknown")


@pytest.mark.compiled
@pytest.mark.slow
@solved
def test_the_plan_names_what_solves(one: Study) -> None:
    scene = one.build(400)
    plan = make_plan(read_scene(scene))
    with counted() as tally:
        sweeps.run(scene, threads=1)
    (line,) = {line for line in forecast.text(plan).splitlines() if "solved by: " in line}
    assert set(line.split(": ", 1)[1].split(", ")) == set(tally.designs)
    assert 0.0 <= tally.general_share <= 1.0


@pytest.mark.compiled
@pytest.mark.parametrize(
    "recorded",
    study_rates.recorded_times(),
    ids=lambda recorded: f"{recorded.study}-{recorded.designs}",
)
def test_estimated_times_are_those_that_were_recorded(recorded: study_rates.Recorded) -> None:
    """The formula and the seconds in `rates`; nothing is timed here."""
    estimated = forecast.seconds_of_computing(study_rates.plan_of(recorded), recorded.cores)
    assert 0.5 < estimated / recorded.seconds < 2.0


def test_rates_are_fitted_and_written() -> None:
    known = [study_rates.Recorded("one_table", n, 2, 0.0) for n in (1000, 8000, 1_000_000)]
    known += [study_rates.Recorded("sampled_four", n, 4, 0.0) for n in (1000, 100_000)]
    times = [forecast.seconds_of_computing(study_rates.plan_of(r), r.cores) for r in known]
    known = [r._replace(seconds=t) for r, t in zip(known, times, strict=True)]
    found = study_rates.fitted(known)
    for recorded in known:
        work = forecast.work_of(study_rates.plan_of(recorded))
        again = sum(
            count * found[name] / (1 if name in SERIAL else recorded.cores)
            for name, count in work.items()
        )
        assert again == pytest.approx(recorded.seconds, rel=0.05)
    text = study_rates.written(study_rates.FILE.read_text(encoding="utf-8"), found)
    made: dict[str, Any] = {"__name__": "rates"}
    exec(compile(text, "rates.py", "exec"), made)
    assert made["SECONDS"] == pytest.approx(found, rel=0.01)
    assert made["SERIAL"] == SERIAL


@pytest.mark.compiled
@pytest.mark.slow
def test_studies_are_measured_with_their_errors() -> None:
    chosen = [study(name) for name in ("one_table", "grid_errors", "sampled", "driven")]
    found = study_times.measured(chosen, 1, 1, 0.0005, 3)
    assert [row.study for row in found.rows] == chosen
    for row in found.rows:
        assert row.converged == 1.0
        assert row.errors.delta < 1e-6
        assert row.errors.speeds < 1e-6
        assert row.timing.rate > 0.0
    assert found.rows[1].errors.honest == 1.0
    assert found.rows[3].tally.designs[BATCH] == 300
    assert found.rows[3].tally.general_share == 0.0
    lines = study_times.body(found)
    assert [line[0] for line in lines] == [one.words for one in chosen]
    assert "nan" not in str(lines)
