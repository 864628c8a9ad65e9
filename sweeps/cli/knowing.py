"""Commands that tell before anything is computed: plan, list, schema, new."""

from __future__ import annotations

from pathlib import Path

import click

from sweeps.base.errors import SceneError, not_known, shown
from sweeps.cli.arguments import (
    LISTED,
    PATH,
    complete_engine,
    complete_list,
    complete_scene,
    untrusted_option,
)
from sweeps.cli.exits import guarded, say, tell, warn
from sweeps.cli.files import not_written


@click.command()
@click.argument("scene", shell_complete=complete_scene)
@untrusted_option
@guarded
def plan(scene: str) -> None:
    """Show what SCENE would compute and skip, with estimated time and memory.

    No design is solved; whatever `run` would refuse is refused.
    """
    from sweeps.running.compute.computation import plan as planned_scene
    from sweeps.scene.plan.forecast import text
    from sweeps.scene.plan.plausibility import plausibility_warnings

    planned = planned_scene(scene)
    say(text(planned))
    warn(plausibility_warnings(planned))


@click.command(name="list")
@click.argument(
    "what", required=False, metavar=f"[{'|'.join(LISTED)}]", shell_complete=complete_list
)
@click.argument("words", nargs=-1)
@guarded
def list_(what: str | None, words: tuple[str, ...]) -> None:
    """List quantities, engines, scenes, shafts, keys, classes of cyclic irregularity or sources.

    Without WHAT, all of them.

    The first word of each line is the name; quantities are grouped by subject. WORDS filter the
    list. Names, descriptions and synonyms are searched: `engine-dyn list quantities cyclic
    irregularity` finds delta, and `engine-dyn list keys conrod` the keys of the connecting rod.
    """
    from sweeps.view.texts.lists import list_lines, quantity_lines

    if what not in (None, *LISTED):
        raise SceneError(
            f"list {shown(what)}: unknown list{not_known(what, LISTED)}; units stand in the lists "
            "of quantities and keys"
        )
    text = " ".join(words)
    for number, name in enumerate(LISTED if what is None else (what,)):
        if number:
            say("")
        for line in quantity_lines(text) if name == "quantities" else list_lines(name, text):
            say(line)


@click.command()
@click.option(
    "--engine", "of_engine", is_flag=True, help="Print the schema of engine files instead."
)
@guarded
def schema(of_engine: bool) -> None:
    """Print the JSON schema of scenes, for editors and for programs that write scenes."""
    import json

    if of_engine:
        from sweeps.scene.json_schema import engine_schema

        made = engine_schema()
    else:
        from sweeps.scene.json_schema import scene_schema

        made = scene_schema()
    click.echo(json.dumps(made, indent=2, ensure_ascii=False))


@click.command()
@click.argument("file", required=False, type=PATH)
@click.option(
    "--engine",
    "of_engine",
    is_flag=True,
    help="Write an engine file instead: a data sheet, with other ways to a diagram as comments.",
)
@click.option(
    "--for",
    "engine",
    shell_complete=complete_engine,
    metavar="ENGINE",
    help="Engine of the scene: a name from the catalogue, or an engine file.",
)
@guarded
def new(file: Path | None, of_engine: bool, engine: str | None) -> None:
    """Write a commented scene to start from, which runs as it is.

    It is written to FILE, or to the terminal if no FILE is given.
    """
    if of_engine and engine is not None:
        raise SceneError(
            "--for: not allowed together with --engine; it names the engine of a scene"
        )
    if of_engine:
        from sweeps.catalogue import ENGINE_TEMPLATE

        text = ENGINE_TEMPLATE.read_text(encoding="utf-8")
    else:
        text = _starting_scene(engine, file)
    if file is None:
        click.echo(text, nl=False)
        return
    try:
        with file.open("x", encoding="utf-8") as stream:
            stream.write(text)
    except FileExistsError:
        raise SceneError(f"{file}: exists and is not overwritten") from None
    except (OSError, ValueError) as error:
        raise not_written(file, error) from None
    if of_engine:
        tell(f"{file}: fill it in, then run `engine-dyn calibrate {file} -o fitted.toml`")
    else:
        tell(f"{file}: run it with `engine-dyn run {file} -o out.nc`")


def _starting_scene(engine: str | None, file: Path | None) -> str:
    """Text of a scene about an engine, with the path as a scene in `file` writes it."""
    from sweeps.scene.starting import balance_scene, starting_scene

    if engine is None:
        return starting_scene()
    from sweeps.scene.engine.engine_files import catalogue, load_engine
    from sweeps.scene.engine.engine_tables import DIAGRAMS

    read = load_engine(engine, None, "--for")
    named = engine
    if engine not in catalogue() and file is not None:
        # A relative path names an engine file below the scene's folder, an absolute one any other.
        path, folder = Path(engine).resolve(), file.parent.resolve()
        inside = path.is_relative_to(folder)
        named = path.relative_to(folder).as_posix() if inside else str(path)
    if not read.family.diagrams and read.torque is None:
        try:
            return balance_scene(read, engine, named)
        except SceneError:
            raise SceneError(
                f"--for {engine}: diagram: missing; must be {DIAGRAMS} (`engine-dyn calibrate` "
                "makes them from [data_sheet])"
            ) from None
    return starting_scene(read, named)
