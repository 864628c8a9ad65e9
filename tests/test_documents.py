"""README and docs: current, runnable, and true where they state numbers."""

import csv
import re
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import sweeps
from engine_dyn.quantities.graph import ALL_QUANTITIES, PARAMETERS
from engine_dyn.speed.fields import METHODS
from sweeps.cli.main import main as command
from sweeps.running.compute import into_archive
from sweeps.running.compute.options import Options
from sweeps.scene.engine.engine_files import catalogue, load_engine
from sweeps.scene.plan.plan import make_plan
from sweeps.scene.plan.shards import shard
from sweeps.scene.reading import built_in_scenes, read_scene
from sweeps.view.figures.kinds import KINDS, figures_of
from sweeps.view.figures.study import study_of
from tests.support.commands import invoke
from tests.support.scenes import asking
from tests.support.tools import ROOT, tool

README = (ROOT / "README.md").read_text(encoding="utf-8")
DOCS = ROOT / "docs"
ROWS = {
    path.stem: list(csv.reader(path.read_text("utf-8").splitlines()))
    for path in sorted((DOCS / "validation").glob("*.csv"))
}
"""Tables of the validation by the names of their files: heads, then rows."""
DOCUMENTS = {
    p.relative_to(DOCS).as_posix(): p.read_text("utf-8") for p in sorted(DOCS.rglob("*.md"))
}
"""Pages of the site by their path below docs, such as `tutorials/first_scene.md`."""
PAGES = {"README.md": README, **DOCUMENTS}

other_sources = tool("other_sources")
pages = tool("pages")
reliability = tool("reliability")
reference_tables = tool("reference_tables")
thesis_study = tool("thesis_study")
validation = tool("validation")


def blocks(language: str, page: str) -> list[str]:
    """Code blocks of a page in one language."""
    return re.findall(rf"```{language}\n(.*?)```", PAGES[page], re.DOTALL)


def test_tables_are_current() -> None:
    for path, tables in reference_tables.DOCUMENTS.items():
        text = path.read_text(encoding="utf-8")
        assert reference_tables.updated(text, tables) == text, path.name
    for path, make in reference_tables.FILES.items():
        assert path.read_text(encoding="utf-8") == make(), path.name


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Working folder with the files that the README's examples name."""
    diagram = load_engine("ntua", Path()).family.diagrams[1]
    rows = [
        f"{a:.3f},{p:.6f}"
        for a, p in zip(np.degrees(diagram.angle), diagram.pressure / 1e5, strict=True)
    ]
    text = "\n".join(["crank_angle_deg,pressure_bar", *rows]) + "\n"
    (tmp_path / "pressure.csv").write_text(text, encoding="utf-8")
    published = "rod_length,delta\n0.300,0.1\n0.450,0.09\n"
    (tmp_path / "published.csv").write_text(published, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_flywheel_of_the_readme(folder: Path) -> None:
    (text,) = blocks("toml", "README.md")
    (folder / "flywheel.toml").write_text(text, encoding="utf-8")
    archive = sweeps.run("flywheel.toml")
    conditions = re.findall(r'best flywheel.nc --least inertia --within "([^"]+)"', README)
    found = sweeps.best(archive, least="inertia", within=conditions, at_every="speed")
    assert f"both speeds, {float(found['inertia']):.2f} kg m²" in README
    assert archive.attrs["warnings"] == ""
    # "The exact one follows from wanted_delta, without the axis of inertia."
    scene = tomllib.loads(text)
    del scene["axes"]["inertia"]
    scene["set"]["wanted_delta"] = "1/150"
    scene["output"] = {"quantities": ["inertia_required"]}
    required = sweeps.run(scene)["inertia_required"]
    exact = float(required.max())
    assert f"{float(required.sel(speed=1500)):.2f} kg m² at 1500 rpm" in README
    scale = load_engine(scene["engine"]).pressure_scale
    assert scale is not None and f"from {scale[0][0]:.0f} to {scale[0][-1]:.0f} rpm" in README
    grid = archive["inertia"].values
    assert float(found["inertia"]) == grid[np.searchsorted(grid, exact)]


@pytest.mark.compiled
@pytest.mark.slow
def test_the_generating_set_of_the_page_on_transients(capsys: pytest.CaptureFixture[str]) -> None:
    (example,) = blocks("python", "transients.md")
    exec(example, {})
    *of_scenes, told = blocks("text", "transients.md")
    assert capsys.readouterr().out == told
    for text in blocks("toml", "transients.md")[::-1]:
        archive = sweeps.run(tomllib.loads(text))
    found = sweeps.best(archive, least="inertia", within="limits_kept >= 1")
    assert f"least inertia = {float(found.inertia):g} kg m²" in of_scenes[0]
    keep = archive.limits_kept
    assert f"\n{int(keep.sum())} of {keep.size} designs" in of_scenes[0]


@pytest.mark.slow
def test_the_million_designs_of_the_readme() -> None:
    (text,) = blocks("python", "README.md")
    space: dict[str, Any] = {}
    exec(text, space)
    assert space["archive"].sizes["design"] > 1_000_000
    assert float(space["light"]["delta"]) <= 1 / 50


def test_scene_with_every_table(folder: Path) -> None:
    (every_table,) = blocks("toml", "scene_files.md")
    (folder / "every_table.toml").write_text(every_table, encoding="utf-8")
    archive = sweeps.run("every_table.toml")
    assert archive["case"].values.tolist() == ["rod 300 mm", "rod 450 mm"]
    assert archive["delta_published"].values.tolist() == [0.1, 0.09]


def test_engine_file(folder: Path) -> None:
    (folder / "mine.toml").write_text(blocks("toml", "engine_files.md")[0], encoding="utf-8")
    archive = sweeps.run({"engine": "mine.toml", "output": {"quantities": ["delta", "imep"]}})
    assert int(archive["status"]) == 0
    assert float(archive["imep"]) > 0.0


def test_arrangement_of_the_page(folder: Path) -> None:
    described = tomllib.loads(blocks("toml", "keys.md")[0])
    scene = read_scene(asking(["delta"], set={"cylinders": 4, **described}))
    assert scene.own_cylinders is not None and scene.own_cylinders.arrangement is not None
    made = scene.own_cylinders.arrangement
    np.testing.assert_allclose(np.degrees(made.firing_intervals), [180, 228, 180, 132])
    assert scene.own_cylinders.along_shaft == ((0, 1), (2, 3))
    # At the top of an engine file, in front of its tables of values.
    text = blocks("toml", "engine_files.md")[0].replace("firing_order = [1, 3, 4, 2]\n", "")
    (folder / "vee.toml").write_text(text + "\n" + blocks("toml", "keys.md")[0], encoding="utf-8")
    engine = load_engine("vee.toml", folder)
    assert engine.firing_order == (1, 3, 2, 4)
    assert engine.own_cylinders == scene.own_cylinders


@pytest.mark.usefixtures("folder")
def test_python_of_the_pages(capsys: pytest.CaptureFixture[str]) -> None:
    scene = {
        "engine": "ntua",
        "axes": {"inertia": [2, 20, 60, 200], "speed": [1000, 1500], "load": [20, 50, 80]},
        "output": {"quantities": ["delta", "imep"]},
    }
    for number in (1, 2):
        piece = shard(make_plan(read_scene(scene)), number, 2)
        into_archive.run(piece, Path(f"part{number}.nc"), Options())
    spaces: list[dict[str, Any]] = []
    for block in (*blocks("python", "archives.md"), *blocks("python", "python.md")):
        spaces.append({})
        exec(block, spaces[-1])
    known = next(space for space in spaces if "light" in space)
    assert float(known["light"]["delta"]) <= 1 / 150
    assert float(known["safe"]["inertia"]) >= float(known["light"]["inertia"])
    assert len(pd.read_csv("front.csv")) == known["front"].sizes["front"]
    known["archive"].close()
    deltas, one = capsys.readouterr().out.splitlines()
    assert len(re.findall(NUMBER, deltas)) == 4
    assert one.endswith(" 0")


def test_commands_of_the_pages_exist() -> None:
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text("utf-8"), re.MULTILINE))
    lines = []
    for page, text in PAGES.items():
        lines += [line for block in blocks("console", page) for line in block.splitlines()]
        # Cells of tutorials run commands of the shell behind an exclamation mark.
        lines += re.findall(r"^!((?:engine-dyn|make) .+)$", text, re.MULTILINE)
        lines += re.findall(r"`((?:engine-dyn|make) [a-z][^`]+)`", text)
    assert len(lines) > 8
    for line in lines:
        if not line.startswith(("make ", "engine-dyn ")):
            continue
        program, name = line.split()[:2]
        known = targets if program == "make" else set(command.commands)
        assert name in known, line


def test_which_command_has_every_command_with_options_that_exist() -> None:
    lines = re.findall(r"`engine-dyn ([^`]+)`", DOCUMENTS["which_command.md"])
    assert {line.split()[0] for line in lines} == {*command.commands, "COMMAND"}
    for line in lines:
        name, *words = line.split()
        given = [word for word in words if re.match(r"--?[a-z]", word)]
        told = set(re.findall(r"--?[a-z-]+", invoke(name, "--help").stdout)) if given else set()
        assert told.issuperset(given) or name == "COMMAND", line


@pytest.mark.parametrize("page", [page for page in PAGES if not page.endswith("index.md")])
def test_links_lead_to_files(page: str) -> None:
    folder = ROOT if page == "README.md" else (DOCS / page).parent
    prose = re.sub(r"^```.*?^```", "", PAGES[page], flags=re.DOTALL | re.MULTILINE)
    links = re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", prose)
    assert links
    for link in links:
        assert (folder / link).is_file(), link


def test_torques_beside_the_flywheel_are_current() -> None:
    table = other_sources.shaft_torque_table(sweeps.run("asgari_flywheel"))
    path = DOCS / "validation" / "asgari_table_2.csv"
    assert path.read_text(encoding="utf-8") == pages.csv_text(table)
    assert "](validation/asgari_table_2.csv)" in DOCUMENTS["flywheel.md"]


NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]\d+)?")


def unlike(one: str, other: str) -> bool:
    """Whether two numbers differ by more than two units of their last digit.

    Of those written as 3e-09, sizes of rounding and discretisation errors, only the size counts.
    """
    values = float(one), float(other)
    if "e" in one or "e" in other:
        return not 0.1 <= abs(values[0]) / max(abs(values[1]), 1e-300) <= 10.0
    unit = 10.0 ** -min(len(text.partition(".")[2]) for text in (one, other))
    return abs(values[0] - values[1]) > 2.001 * unit


@pytest.fixture(scope="module")
def study() -> Any:
    return thesis_study.run_study()


@pytest.fixture(scope="module")
def agreement() -> Any:
    return thesis_study.run_agreement()


@pytest.mark.slow
def test_validation_is_current(study: Any, agreement: Any) -> None:
    drift = thesis_study.run_drift(validation.CYCLES)
    fresh = validation.documents(study, drift, agreement)
    assert {path.stem for path in fresh} == {"validation", *ROWS} - {"items"}
    # Numbers may differ by rounding between processors, words may not.
    for path, text in fresh.items():
        kept = path.read_text(encoding="utf-8")
        for new, old in zip(text.splitlines(), kept.splitlines(), strict=True):
            assert NUMBER.sub("#", new) == NUMBER.sub("#", old)
            numbers = zip(NUMBER.findall(new), NUMBER.findall(old), strict=True)
            assert [pair for pair in numbers if unlike(*pair)] == [], old


@pytest.mark.slow
def test_predictions_are_within_the_limits_fixed_beforehand(study: Any) -> None:
    groups = thesis_study.worst_of_limits(study)
    predicted = [case for cases, _, _ in groups for case in cases]
    # All designs but the three whose swing is fitted, each in one group.
    assert sorted(predicted) == sorted(set(study.cases) - {"nominal", "load 0", "load 90"})
    for cases, limit, worst in groups:
        assert abs(worst) <= limit, cases


@pytest.mark.slow
def test_one_diagram_gives_all_rows(study: Any) -> None:
    """Issue G asks for 0.2 % with 4, 6 and 8 cylinders; `ntua` alone is up to 2.7 % off."""
    fitted = thesis_study.run_all_rows()
    assert len(fitted.cases) == 20
    for case in ("4 cylinders", "6 cylinders", "8 cylinders"):
        for name in ("delta", *thesis_study.TORQUES):
            assert abs(fitted.off("published", name, case)) <= 0.2, (case, name)
        assert max(abs(study.off("published", name, case)) for name in thesis_study.TORQUES) > 0.2
    for case in fitted.cases:
        low, high = thesis_study.range_of_delta(thesis_study.printed_rows()[case])
        middle = thesis_study.printed(case, "delta")
        within = max(high - middle, middle - low, 1e-3 * middle)
        assert abs(fitted.at("published", "delta", case) - middle) <= within, case


# Counted in the source documents: K Kakaitsas, A Asgari, R Rakopoulos, M Mosakowski, L lecture 18.
ITEMS = {"K": 84, "A": 33, "R": 31, "M": 15, "L": 19}


def anchors(text: str) -> set[str]:
    """Anchors of a page's headings, as GitHub makes them."""
    heads = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", head.lower()).replace(" ", "-") for head in heads}


def items() -> list[tuple[str, ...]]:
    """Letter, number, what the source describes, what covers it, numbers."""
    return [(name[0], name[1:], *cells) for name, *cells in ROWS["items"][1:]]


def test_every_item_of_the_sources_is_covered_by_something_that_exists() -> None:
    rows = items()
    for letter, count in ITEMS.items():
        assert [int(row[1]) for row in rows if row[0] == letter] == list(range(1, count + 1))
    known = {
        *PARAMETERS, *ALL_QUANTITIES, *METHODS, *built_in_scenes(), *catalogue(),
        *(kind.name for kind in KINDS),
        # Tables of scenes, and words that are not looked up by name.
        "[indicator]", "[characteristic]", "[shaft]", "passes", "truncation", "inertia_model",
    }  # fmt: skip
    for letter, number, _, covered, numbers in rows:
        names = re.findall(r"`([^`]+)`", covered)
        for name in names:
            if name.startswith("sweeps."):
                assert callable(getattr(sweeps, name.removeprefix("sweeps."))), name
            elif " " not in name:
                assert name in known, f"{letter}{number}: {name}"
        places = re.findall(r"\(([\w/]+\.(?:md|csv))#?([^)]*)\)", f"{covered} {numbers}")
        assert names or places, f"{letter}{number}"
        for page, anchor in places:
            assert (DOCS / page).is_file(), f"{letter}{number}: {page}"
            if anchor:
                assert anchor in anchors(DOCUMENTS[page]), f"{letter}{number}: #{anchor}"


@pytest.mark.compiled
def test_built_in_scenes_draw_the_figures_that_cover_items() -> None:
    """What stands as figure `a` of the scene `b` is drawn of what `run b` writes."""
    claimed: dict[str, dict[str, str]] = {}
    for letter, number, _, covered, _ in items():
        for named, scene in re.findall(r"figures? ([^;]*?) of the scene `(\w+)`", covered):
            for kind in re.findall(r"`(\w+)`", named):
                claimed.setdefault(scene, {})[kind] = f"{letter}{number}"
    assert {"thesis", "thesis_cylinders", "asgari_forces", "friction", "lecture18"} <= set(claimed)
    for scene, kinds in claimed.items():
        study = study_of(sweeps.run(scene), {})
        for kind, item in kinds.items():
            found = next(figures_of(study, [kind]), None)
            assert found is not None, f"{item}: scene {scene} draws no figure {kind}"


@pytest.mark.slow
def test_solver_agrees_with_the_independent_one(agreement: Any) -> None:
    for group in agreement:
        assert group.same_outcome == group.designs, group.group
        for quantity, limit in thesis_study.AGREEMENT.items():
            assert group.worst[quantity] < limit, (group.group, quantity)


@pytest.mark.slow
def test_what_the_readme_says_about_accuracy(study: Any, agreement: Any) -> None:
    assert "differ by less than 1e-7, relative" in README
    assert max(max(group.worst.values()) for group in agreement) < 1e-7
    assert max(group.worst["omega_mean"] for group in agreement) < 1e-8
    assert "within 0.3 % for one cylinder, and within 3 % for 2 to 8 cylinders" in README
    for one in thesis_study.differences(study):
        if one.quantity == "delta" and not one.fitted:
            assert abs(one.percent) < (3.0 if one.case in study.several() else 0.3), one
    assert "has delta 0.103 instead of 0.1046, and 0.094 with gauge pressure" in README
    assert f"{study.at('periodic', 'delta', 'nominal'):.3f}" == "0.103"
    assert f"{study.at('gauge', 'delta', 'nominal'):.3f}" == "0.094"


def test_scene_compares_with_the_same_numbers() -> None:
    # The scene has its own file of published values, with delta from the printed omegas.
    text = (ROOT / "sweeps/catalogue/scenes/kakaitsas_tables_5_3_and_5_4.csv").read_text(
        encoding="utf-8"
    )
    lines = [line for line in text.splitlines() if not line.startswith("#")]
    heads = lines[0].split(",")
    compared = 0
    for line in lines[1:]:
        cells = re.findall(r'"[^"]*"|[^,]+|(?<=,)(?=,|$)', line)
        row = dict(zip(heads, cells, strict=True))
        case = row["case"].strip('"')
        for name in ("omega_max", "omega_min", "omega_mean", "torque_ratio", "torque_range"):
            if row[name]:
                assert float(row[name]) == thesis_study.printed(case, name), (case, name)
                compared += 1
        assert float(row["delta"]) == pytest.approx(thesis_study.printed(case, "delta"), abs=6e-6)
        assert float(row["delta"]) == float(thesis_study.printed_rows()[case]["delta_from_omegas"])
    assert compared == 22 * 3 + 2 * 5


@pytest.mark.slow
def test_numbers_that_are_marked_as_fitted_are_met(study: Any) -> None:
    cases = {case for case, _ in thesis_study.FITTED}
    assert cases == {"nominal", "load 0", "load 90"}
    assert ("nominal", "omega_max") not in thesis_study.FITTED
    off = {one[:2]: one.percent for one in thesis_study.differences(study)}
    other, ours = thesis_study.other_numbers(), thesis_study.other_values(study)
    off |= {("nominal", name): thesis_study.percent(ours[name], other[name]) for name in other}
    for one in thesis_study.FITTED:
        assert abs(off[one]) < 0.05, one


def test_every_promise_has_tests_that_exist() -> None:
    for row in reliability.promises():
        assert row["tests"].split()
        for test in row["tests"].split():
            path, _, name = test.partition("::")
            assert f"def {name}(" in (ROOT / path).read_text(encoding="utf-8"), test
        for name in row["figure"].split():
            assert name in reliability.FIGURES or name in reliability.OF_STABILITY


def test_the_page_of_trust_is_made_from_its_parts() -> None:
    for path, text in reliability.files().items():
        assert path.read_text(encoding="utf-8") == text, path.name
    assert "not measured yet" not in DOCUMENTS["trust.md"]
