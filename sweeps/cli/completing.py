"""Words that the shell completes: scenes, engines, quantities, keys.

`eval "$(_ENGINE_DYN_COMPLETE=bash_source engine-dyn)"` switches it on; docs/numbers.md has other
shells. A completion that fails says nothing: the shell would print it into the command line.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

import click
from click.shell_completion import CompletionItem

__all__ = [
    "LISTED",
    "complete_engine",
    "complete_engine_or_scene",
    "complete_keys",
    "complete_list",
    "complete_quantities",
    "complete_scene",
]

LISTED = ("quantities", "engines", "scenes", "shafts", "keys", "classes", "sources")
"""Lists of `engine-dyn list`."""

Completer = Callable[[click.Context, click.Parameter, str], list[CompletionItem]]


def _words(
    words: Callable[[], Iterable[tuple[str, str]]], *, several: bool = False, files: bool = False
) -> Completer:
    """Complete a word, or the last of several with commas; files where no word begins so."""

    def complete(
        context: click.Context, parameter: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        del context, parameter
        before, comma, last = incomplete.rpartition(",") if several else ("", "", incomplete)
        try:
            matching = [(word, text) for word, text in words() if word.startswith(last)]
        except Exception:
            matching = []
        items = [CompletionItem(f"{before}{comma}{word}", help=text) for word, text in matching]
        # The shell completes files itself.
        return items or ([CompletionItem(incomplete, type="file")] if files else [])

    return complete


def _scenes() -> list[tuple[str, str]]:
    from sweeps.scene.reading import built_in_scenes

    return [(name, "built-in scene") for name in built_in_scenes()]


def _engines() -> list[tuple[str, str]]:
    from sweeps.scene.engine.engine_files import catalogue

    return [(name, "engine of the catalogue") for name in catalogue()]


def _keys() -> list[tuple[str, str]]:
    from engine_dyn.quantities.graph import PARAMETERS

    return [(name, node.long_name) for name, node in PARAMETERS.items()]


def _quantities() -> list[tuple[str, str]]:
    from engine_dyn.quantities.graph import ALL_QUANTITIES

    return [(name, node.long_name) for name, node in ALL_QUANTITIES.items()]


complete_scene = _words(_scenes, files=True)
complete_engine = _words(_engines, files=True)
complete_engine_or_scene = _words(lambda: [*_scenes(), *_engines()], files=True)
complete_keys = _words(_keys, several=True)
complete_quantities = _words(_quantities, several=True)
complete_list = _words(lambda: [(name, "list") for name in LISTED])
