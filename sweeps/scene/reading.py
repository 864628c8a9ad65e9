"""Reading scenes: finding the file, checking its tables, and putting the `Scene` together.

A scene is a TOML file, the name of a built-in one, or a dict of the same shape. Everything that
can be seen to be wrong without computing is refused here, in one line that names the file, the
key, the value and what is allowed.
"""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import IO, Any, Unpack

from engine_dyn.engine import Engine
from engine_dyn.geometry.arrangement import TWO_STROKE
from engine_dyn.types import Floats
from sweeps.base.arguments import names_given
from sweeps.base.checks import check_structure, plain, shortened
from sweeps.base.dimensions import (
    ARRANGEMENT,
    DESIGN,
    FIRING_PATTERN,
    INERTIA_MODEL,
    METHOD,
    STATUS,
)
from sweeps.base.errors import SceneError, not_known, one_line, shown, size_text
from sweeps.base.files.regular_files import kept_files, reading, text_of_bytes
from sweeps.base.files.toml_files import MOST_BYTES, parse_toml, toml_of_text
from sweeps.catalogue import SCENES
from sweeps.scene.axes import read_axes, read_designs_table, read_settings
from sweeps.scene.consistency.features import check_tables
from sweeps.scene.consistency.outputs import check_output
from sweeps.scene.consistency.whole import check_places, check_scene
from sweeps.scene.cylinders import cylinders_along_axis, own_cylinders
from sweeps.scene.derived_quantities import elasticities_in, ordinary
from sweeps.scene.engine.cylinder_keys import read_cylinder_keys
from sweeps.scene.engine.engine_files import load_engine
from sweeps.scene.engine.silenced_warnings import read_silenced
from sweeps.scene.engine_choices import (
    EngineChoice,
    EngineChoices,
    check_engine_given,
    engine_choices,
    those_possible,
)
from sweeps.scene.features import check_asked, parts_of_scene, with_features, without_dropped
from sweeps.scene.firing_patterns import read_firing_patterns
from sweeps.scene.keywords import Tables, changed, no_scene, tables_in_signature
from sweeps.scene.model import Scene, SeveralEngines
from sweeps.scene.objects import plain_objects
from sweeps.scene.reduce import BestTable, FrontTable, Kept, Reduce, ReduceTable
from sweeps.scene.sample import read_uncertainty, with_sample
from sweeps.scene.toml_tables import SceneFile, read_solver
from sweeps.scene.values import GivenValues

MOST_DESIGNS = 10**15

WHAT = "a scene (TOML)"

LONGEST_KEPT = 1_000_000
"""Longest list that archives of reductions keep with the scene, since it has no coordinate."""


def built_in_scenes() -> dict[str, Path]:
    """Scenes that come with the package: name and file."""
    return {path.stem: path for path in sorted(SCENES.glob("*.toml"))}


def is_scene(path: Path) -> bool:
    """Whether a TOML file is a scene, and no engine file; False for a file that cannot be read."""
    try:
        raw = parse_toml(path, str(path), WHAT)
    except SceneError:
        return False
    return "engine" in raw or "output" in raw


@tables_in_signature
def read_scene(
    scene: str | Path | Mapping[str, Any] | Scene | None = None, **tables: Unpack[Tables]
) -> Scene:
    """Read and check a scene.

    Parameters
    ----------
    scene : str, Path, dict or Scene, optional
        Path of a TOML file, name of a built-in scene, "-" for the standard input, a dict of the
        same shape (paths in both are relative to the working folder), or a Scene, which comes back
        as it is.
    **tables
        Tables and keys of a scene: `engine`, `set`, `axes`, `designs`, `indicator`, `solver`,
        `output` and so on. They make a scene of their own, or replace whole tables of the one that
        is given; None leaves a table out. Axes and columns may be lists, ranges, arrays, columns
        of pandas and xarray, or quantities of pint; `designs` may be a DataFrame, and `indicator` a
        table of angle and pressure.

    Raises
    ------
    SceneError
        With one line, for everything that can be seen to be wrong without computing.

    Examples
    --------
    >>> import sweeps
    >>> scene = sweeps.read_scene(
    ...     engine="ntua",
    ...     set={"speed": 1500.0, "load": 90.0},
    ...     axes={"inertia": range(2, 6)},
    ...     output={"quantities": ["delta"]},
    ... )
    >>> scene.dimensions
    ('inertia',)
    """
    if isinstance(scene, Scene):
        if tables:
            raise SceneError(
                f"{', '.join(tables)}: a Scene cannot be changed; give its file, name or dict"
            )
        return scene
    given = given_scene(scene, **tables)
    return scene_of(given.raw, given.name, given.base, given.path, instead=given.instead)


@dataclass(frozen=True, eq=False)
class GivenScene:
    """A scene as it was given, before its tables are looked at: arguments of `scene_of`."""

    raw: dict[str, Any]
    name: str
    base: Path
    path: Path | None
    instead: Mapping[Path, bytes]


def given_scene(
    scene: str | Path | Mapping[str, Any] | None = None, **tables: Unpack[Tables]
) -> GivenScene:
    """Find a scene and read its tables, which are not checked yet; see `read_scene`."""
    path: Path | None = None
    if hasattr(scene, "data_vars"):
        raise SceneError("scene: is a dataset; must be a path, a name, a dict or a Scene")
    if isinstance(scene, Mapping) or (scene is None and tables):
        name, base, given = "scene", Path(), scene or {}
    elif isinstance(scene, str | Path):
        path, name, base, given = _found(scene)
    elif scene is None:
        raise no_scene()
    else:
        raise SceneError(
            f"scene = {shown(scene)}: must be a path, the name of a built-in scene, a dict or a "
            "Scene"
        )
    if tables:
        given = changed(given, tables, base)
        if path is not None:
            path, name = None, f"{name} with {', '.join(tables)}"
    given, texts = plain_objects(given, name)
    instead = {base / file: text.encode() for file, text in texts.items()}
    return GivenScene(plain(given, name), name, base, path, instead)


def with_uncertainty(scene: str | Path) -> Scene:
    """Read a scene with [uncertainty] where it has none: the engine's own ranges then."""
    path, name, base, given = _found(scene)
    raw = plain(given, name)
    return scene_of({**raw, "uncertainty": raw.get("uncertainty", {})}, name, base, path)


def scene_of(
    raw: dict[str, Any], name: str, base: Path, path: Path | None = None,
    files: Mapping[str, bytes] | None = None, instead: Mapping[Path, bytes] | None = None,
    columns: Mapping[str, Any] | None = None,
) -> Scene:  # fmt: skip
    """Check a scene that was read as a dict; errors are those of `read_scene`.

    `raw` are its tables, `name` is the scene as messages call it, `base` the folder where its paths
    start from, and `path` its file. With `files` nothing is read from a disk; `instead` are files
    that are on no disk. With `columns`, values that [sample] drew before, nothing is drawn.
    """
    with kept_files(files, base, instead) as read, _sample_named(raw):
        tables, sample = with_sample(raw, name, columns)
        check_engine_given(tables, name)
        given = check_structure(SceneFile, tables, name)
        designs, labels, results = read_designs_table(given.designs, name, base)
        choices = engine_choices(given, tables, name, base, designs, labels)
        check_tables(given, labels, choices is not None, name)
        if choices is not None:

            def read_one(one: dict[str, Any], its_name: str) -> Scene:
                return scene_of(one, its_name, base, path, files, instead)

            scene = _together(choices, given, tables, name, read_one, designs, labels)
            return replace(scene, sample=sample, source=shortened(raw), results_left_out=results)
        longest = None if given.reduce is None else LONGEST_KEPT
        source = shortened(raw, longest)
        known = {"path": path, "sample": sample, "source": source, "files": read,
                 "results_left_out": results}  # fmt: skip
        scene = _assembled(given, tables, name, base, designs, labels, known)
        check_scene(scene, name)
        if given.reference is not None:
            from sweeps.scene.reference import read_reference

            published = read_reference(given.reference.file, scene, base, name)
            scene = replace(scene, reference=published)
    reduce = read_reduce(given.reduce, scene, name)
    return scene if reduce is None else replace(scene, reduce=reduce)


@contextmanager
def _sample_named(raw: Mapping[str, Any]) -> Iterator[None]:
    """Make messages about values drawn by [sample] name [sample], where the user finds them."""
    try:
        yield
    except SceneError as error:
        if raw.get("sample") is None or raw.get("designs") is not None:
            raise
        raise SceneError(str(error).replace("[designs]", "[sample]")) from None


def _found(scene: str | Path) -> tuple[Path | None, str, Path, dict[str, Any]]:
    """Path of a scene, its name in messages, its folder and its tables."""
    # A scene from the standard input or a pipe has no path: its folder is the working folder.
    known = built_in_scenes()
    text = str(scene)
    if isinstance(scene, str) and text in known:
        path, name = known[text], f"{text}.toml"
        return path, name, path.parent, parse_toml(path, name, WHAT)
    if text == "-":  # The sign for the standard input, where a file may be named
        return None, "standard input", Path(), _of_stream(sys.stdin.buffer, "standard input")
    if not os.path.exists(scene):  # False also for names too long or with nulls
        raise SceneError(
            f"scene {shown(text, 300)}: no such file and no built-in scene{not_known(text, known)}"
        )
    path = Path(scene)
    if path.is_fifo() and path.is_relative_to("/dev"):  # A shell's pipe has a writer, and so an end
        with reading(text, WHAT), path.open("rb") as stream:
            return None, text, Path(), _of_stream(stream, text)
    return path, text, path.parent, parse_toml(path, text, WHAT)


def _of_stream(stream: IO[bytes], name: str) -> dict[str, Any]:
    """Tables of a scene that comes through a pipe."""
    data = stream.read(MOST_BYTES + 1)
    if len(data) > MOST_BYTES:
        raise SceneError(f"{name}: larger than {size_text(MOST_BYTES)}; expected {WHAT}")
    return toml_of_text(text_of_bytes(data, name, WHAT), name)


def _together(
    choices: EngineChoices, given: SceneFile, raw: Mapping[str, Any], name: str,
    read_one: Callable[[dict[str, Any], str], Scene],
    designs: dict[str, Floats], labels: dict[str, tuple[str, ...]],
) -> Scene:  # fmt: skip
    """Scene of several engines or arrangements: an ordinary scene for each, and the axes of all."""
    each: list[Scene] = []
    refused: dict[str, SceneError] = {}
    for choice in choices.each:

        def read(asked: Sequence[str], choice: EngineChoice = choice) -> Scene:
            output = {**choice.raw["output"], "quantities": list(asked)}
            return read_one({**choice.raw, "output": output}, choice.name)

        scene, missing = those_possible(given.output.quantities, read)
        refused = {**missing, **refused}
        each.append(scene)
    for quantity, error in refused.items():
        if not any(quantity in one.quantities for one in each):
            raise error
    each = _named_apart(each)
    first = each[0]
    axes = {key: first.axes[key] if words is None else words for key, words in choices.axes.items()}
    of_solver = {key: first.axes[key] for key in (METHOD, INERTIA_MODEL) if key in first.axes}
    engines = {one.engine.title: None for one in each}
    known = {one.name: getattr(first, one.name) for one in fields(first)}
    joined: dict[str, Any] = {
        "title": one_line(given.title or f"Scene on {'; '.join(engines)}"),
        "settings": {key: value for key, value in first.settings.items() if key in given.set},
        "axes": {**axes, **of_solver},
        "dimensions": _dimensions(axes, raw, of_solver),
        "designs": designs,
        "labels": labels,
        "quantities": tuple(given.output.quantities),
        "files": {key: data for one in each for key, data in one.files.items()},
        "own_cylinders": None,
        "each": tuple(each),
        "places": tuple(choice.places for choice in choices.each),
    }
    return SeveralEngines(**{**known, **joined})


def _named_apart(each: list[Scene]) -> list[Scene]:
    """Scenes whose engines have different names: equal names are replaced by those of the files."""
    files: dict[str, set[str]] = {}
    for scene in each:
        files.setdefault(scene.engine.name, set()).add(scene.source["engine"])
    return [
        scene if len(files[scene.engine.name]) == 1 else
        replace(scene, engine=replace(scene.engine, name=one_line(scene.source["engine"])))
        for scene in each
    ]  # fmt: skip


def _assembled(
    given: SceneFile, raw: Mapping[str, Any], name: str, base: Path,
    designs: dict[str, Floats], labels: dict[str, tuple[str, ...]], known: dict[str, Any],
) -> Scene:  # fmt: skip
    """Read the tables one by one and put them together, without references to published values."""
    # `known` has the fields of the scene that do not come from its tables.
    assert isinstance(given.engine, str)
    engine = load_engine(given.engine, base, f"{name}: engine")
    engine = with_features(engine, given, base, f"{name}: ")
    settings = read_settings(given.set, name)
    cylinder_keys = read_cylinder_keys(given.set, f"{name}: [set] ")
    axes, words = read_axes(given.axes, cylinder_keys, name)
    solver = read_solver(given.solver, name)
    values = GivenValues(
        engine=engine, settings=settings, axes={**axes, **solver.axes}, designs=designs
    )
    check_places(values, solver.start, name)
    engine = without_dropped(values)
    dimensions = _dimensions(axes, raw, solver.axes)
    _check_size(values, dimensions, name)
    check_output(given.output, engine, name)
    passes = solver.start.get("passes")
    values = replace(values, parts=parts_of_scene(given, values, base, f"{name}: "))
    check_asked(values, given.output.quantities, name)
    return Scene(
        engine=engine,
        settings=settings,
        axes=values.axes,
        designs=designs,
        parts=values.parts,
        title=one_line(given.title or f"Scene on {engine.title}"),
        dimensions=dimensions,
        labels=labels,
        own_cylinders=own_cylinders(cylinder_keys, values, f"{name}: [set] "),
        arrangements=cylinders_along_axis(words.get(ARRANGEMENT, ()), cylinder_keys, values, name),
        firing_patterns=read_firing_patterns(
            given.set.get(FIRING_PATTERN),
            words.get(FIRING_PATTERN, ()),
            labels,
            values.counts,
            name,
        ),
        methods=solver.methods,
        inertia_models=solver.inertia_models,
        tolerance=given.solver.tolerance,
        closure=given.solver.closure,
        passes=None if passes is None else int(passes),
        start_speed=solver.start.get("start_speed"),
        start_angle=solver.start.get("start_angle"),
        quantities=ordinary(given.output.quantities, f"{name}: [output] quantities"),
        elasticities=elasticities_in(given.output.quantities),
        fail_on=tuple(given.output.fail_on),
        silenced_warnings=read_silenced(given.silenced_warnings, name),
        angle_step=given.output.angle_step,
        highest_order=_highest_order(given, engine),
        modes=given.output.modes,
        modes_below=given.output.modes_below,
        reference=None,
        uncertainty=read_uncertainty(given.uncertainty, values, name),
        folder=str(base),
        **known,
    )


def _dimensions(
    axes: Iterable[str], raw: Mapping[str, Any], of_solver: Iterable[str]
) -> tuple[str, ...]:
    """Dimensions of a scene, the slowest first; those of the solver vary fastest."""
    dimensions = list(axes)
    if raw.get("designs") is not None:
        # The order of the tables in the file decides which axis varies slowest.
        first = "axes" in raw and list(raw).index("axes") < list(raw).index("designs")
        dimensions.insert(len(dimensions) if first else 0, DESIGN)
    return (*dimensions, *of_solver)


def _highest_order(given: SceneFile, engine: Engine) -> float:
    """Highest order in the scene; by default 15 for shafts of two-stroke engines."""
    asked = "highest_order" in given.output.model_fields_set
    two_stroke = engine.period == TWO_STROKE
    if engine.shaft is not None and two_stroke and not asked:
        # Lloyd's Register asks for the vibration of two-stroke engines up to this order
        return 15.0
    return given.output.highest_order


def _check_size(values: GivenValues, dimensions: tuple[str, ...], name: str) -> None:
    """Check that the designs of a scene are not too many."""
    columns = values.designs.values()
    count = math.prod(map(len, values.axes.values())) * (len(next(iter(columns))) if columns else 1)
    if count > MOST_DESIGNS:
        raise SceneError(
            f"{name}: {' x '.join(dimensions)}: {count:.3g} designs; must be at most "
            f"{MOST_DESIGNS:g}"
        )


def read_reduce(table: ReduceTable | None, scene: Scene, name: str) -> Reduce | None:
    """Check what a table [reduce] asks for: axes, quantities and quantiles of the scene."""
    if table is None:
        return None
    where = f"{name}: [reduce]"
    over = scene.dimensions if table.over is None else _axes(table.over, scene, f"{where} over")
    every = tuple(name for name in scene.quantities if name != STATUS)  # Outcomes have no mean
    statistics = every if table.statistics is None else tuple(table.statistics)
    for quantity in statistics:
        _check_known(quantity, scene.quantities, f"{where} statistics")
    quantiles = tuple(sorted(set(table.quantiles)))
    for share in quantiles:
        if not 0.0 < share < 1.0:
            raise SceneError(f"{where} quantiles = {shown(share)}: must be between 0 and 1")
    names = (*scene.quantities, *scene.dimensions, *scene.designs)
    kept = []
    for number, best in enumerate(table.best):
        here = f"{where} best {number + 1}"
        if (best.least is None) == (best.most is None):
            both = "least and most are both given; must be one of them ([[reduce.front]] has more)"
            raise SceneError(f"{here}: {both if best.least else 'needs least or most'}")
        one = best.least if best.most is None else best.most
        assert one is not None
        _check_known(one, names, here)
        kept.append(_kept(((one, 1.0 if best.most is None else -1.0),), best.number, best))
    for number, front in enumerate(table.front):
        here, most = f"{where} front {number + 1}", names_given(front.most, "most")
        for key in (*front.of, *most):
            _check_known(key, front.of if key in most else names, here)
        if len(set(front.of)) < len(front.of):
            raise SceneError(f"{here} of = {shown(front.of)}: names must differ")
        wanted = tuple((key, -1.0 if key in most else 1.0) for key in front.of)
        kept.append(_kept(wanted, 0, front))
    at_every = _axes(table.at_every, scene, f"{where} at_every")
    if any(one.not_counted for one in kept) and not at_every:
        raise SceneError(
            f"{where} not_counted: only used with at_every; failed designs never count"
        )
    within = tuple(names_given(table.within, "within"))
    return Reduce(statistics, over, quantiles, within, at_every, tuple(kept))


def _kept(
    wanted: tuple[tuple[str, float], ...], number: int, table: BestTable | FrontTable
) -> Kept:
    within = tuple(names_given(table.within, "within"))
    return Kept(wanted, number, within, tuple(names_given(table.not_counted, "not_counted")))


def _axes(raw: str | Sequence[str], scene: Scene, where: str) -> tuple[str, ...]:
    """Axes named by a key, in the order of the scene."""
    names = names_given(raw, where)
    for axis in names:
        if axis in scene.designs and axis not in scene.dimensions:
            table = "sample" if scene.sample is not None else "designs"
            raise SceneError(f"{where}: '{axis}': is given by [{table}]; use 'design'")
        _check_known(axis, scene.dimensions, where)
    return tuple(d for d in scene.dimensions if d in names)


def _check_known(name: str, known: Sequence[str], where: str) -> None:
    if name not in known:
        raise SceneError(f"{where}: {shown(name)}: not in the scene{not_known(name, list(known))}")
