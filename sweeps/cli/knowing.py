"""Commands that tell before anything is computed: plan, list, schema, new."""

from __future__ import annotations

from pathlib import Path

import click

from sweeps.cli.arguments import PATH, untrusted_option
from sweeps.cli.exits import guarded, say, warn
from sweeps.cli.files import not_written
from sweeps.errors import SceneError

__all__ = ["list_", "new", "plan", "schema"]


@click.command()
@click.argument("scene")
@untrusted_option
@guarded
def plan(scene: str) -> None:
    """Show what SCENE would compute, what it would skip, and its time and memory.

    Nothing is computed.
    """
    from sweeps.planning.forecast import text
    from sweeps.planning.plan import make_plan
    from sweeps.planning.plausibility import plausibility_warnings
    from sweeps.scene.reading import read_scene

    planned = make_plan(read_scene(scene))
    say(text(planned))
    warn(plausibility_warnings(planned))


@click.command(name="list")
@click.argument(
    "what", required=False, type=click.Choice(["quantities", "engines", "scenes", "keys"])
)
@guarded
def list_(what: str | None) -> None:
    """List quantities, engines, built-in scenes or keys of a scene. Default: all of them.

    The first word of each line is the name.
    """
    from sweeps.presenting.lists import LISTS

    lines = [line for kind, make in LISTS.items() if what in (None, kind) for line in make()]
    width = max(len(name) for name, _ in lines)
    for name, text in lines:
        click.echo(f"{name:<{width}}  {text}")


@click.command()
@guarded
def schema() -> None:
    """Print the JSON schema of scenes, for editors and for programs that write scenes."""
    import json

    from sweeps.scene.json_schema import scene_schema

    click.echo(json.dumps(scene_schema(), indent=2, ensure_ascii=False))


@click.command()
@click.argument("file", required=False, type=PATH)
@guarded
def new(file: Path | None) -> None:
    """Write a commented scene to start from, which runs as it is.

    It is written to FILE, or to the terminal if no FILE is given.
    """
    from sweeps.scene.reading import built_in_scenes

    text = built_in_scenes()["first"].read_text(encoding="utf-8")
    if file is None:
        click.echo(text, nl=False)
        return
    try:
        with file.open("x", encoding="utf-8") as stream:
            stream.write(text)
    except FileExistsError:
        raise SceneError(f"{file}: exists; it is not overwritten") from None
    except (OSError, ValueError) as error:
        raise not_written(file, error) from None
    say(f"{file}: run it with `engine-dyn run {file} -o out.nc`")
