"""The site of the documentation: `make docs` builds it into out/docs, without a network."""

from __future__ import annotations

import hashlib
import importlib.metadata
import os
import re
import shutil
import sys
from pathlib import Path
from typing import Any

from pygments.lexers.special import TextLexer

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE / "_extensions"), str(HERE.parent), str(HERE.parent / "tools")]

import reference_tables  # noqa: E402  (found by the line above)

project = "engine-dyn"
author = copyright = "engine-dyn contributors"
version = release = importlib.metadata.version("engine-dyn")

extensions = [
    "cells_as_typed",
    "mathml",
    "myst_nb",
    "numpydoc",
    "sphinx.ext.autodoc",
    "sphinx_click",
    "sphinx_copybutton",
    "sphinx_design",
]
exclude_patterns = ["_extensions", "reliability"]
nitpicky = False

# Help texts hold commands that are copied: dashes, quotes and `single` backticks stay as typed.
smartquotes = False
default_role = "code"

myst_enable_extensions = ["colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 4
suppress_warnings = ["myst.strikethrough"]


def _code() -> str:
    """Hash of all that notebooks depend on besides themselves: the program and its libraries."""
    found = hashlib.sha256(sys.version.encode())
    for folder in (HERE / "_extensions", HERE.parent / "engine_dyn", HERE.parent / "sweeps"):
        for path in sorted(folder.rglob("*.*")):
            if path.is_file() and path.suffix != ".pyc":
                found.update(str(path.relative_to(HERE.parent)).encode() + path.read_bytes())
    for name in ("matplotlib", "netCDF4", "numba", "numpy", "pandas", "xarray"):
        found.update(f"{name} {importlib.metadata.version(name)}".encode())
    return found.hexdigest()[:16]


# Notebooks are executed while the site is built, each in a folder of its own that is removed
# afterwards; a cell or a command that fails ends the build. What they printed and drew is kept in
# out/notebooks, and taken from there as long as neither the notebook nor the program has changed.
NOTEBOOKS = HERE.parent / "out" / "notebooks"
nb_execution_mode = "cache"
nb_execution_cache_path = str(NOTEBOOKS / _code())
for old in NOTEBOOKS.glob("*"):
    if str(old) != nb_execution_cache_path:
        shutil.rmtree(old)
nb_execution_in_temp = True
nb_execution_raise_on_error = True
nb_execution_timeout = 600
nb_merge_streams = True
os.environ |= {
    "COLUMNS": "110",
    "PATH": os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]]),
    "PYTHONSTARTUP": str(HERE / "_extensions" / "failing_commands.py"),
    "TERM": "dumb",
}

autodoc_typehints = "none"
numpydoc_show_class_members = False

html_theme = "furo"
html_title = f"engine-dyn {version}"
html_math_renderer = "mathml"
html_show_sphinx = False
html_copy_source = False
html_static_path = ["_static"]
html_css_files = ["tables.css"]

FROM_ABOVE = {
    "changelog": "CHANGELOG.md",
    "code_of_conduct": "CODE_OF_CONDUCT.md",
    "contributing": "CONTRIBUTING.md",
    "security": "SECURITY.md",
}
"""Pages whose text stands beside this folder, where readers of the repository look for it."""


def _read(app: Any, name: str, source: list[str]) -> None:
    """Let links lead to the pages of the site, and put in the tables that only the site has."""
    text = source[0]
    if name in FROM_ABOVE:
        text = (HERE.parent / FROM_ABOVE[name]).read_text(encoding="utf-8")
        text = re.sub(
            r"\]\((?!#|https?:)(?:docs/)?", lambda m: "](" if "docs/" in m[0] else "](../", text
        )
    for page, file in {"index": "README.md", **FROM_ABOVE}.items():
        text = text.replace(f"](../{file}", f"]({page}.md")
    if tables := reference_tables.OF_THE_SITE.get(name):
        text = reference_tables.updated(text, tables)
    source[0] = text


def setup(app: Any) -> None:
    """Connect to Sphinx."""
    app.connect("source-read", _read)
    app.connect("env-get-outdated", lambda *_: list(reference_tables.OF_THE_SITE))
    app.add_lexer("csv", TextLexer)  # Pygments has none
