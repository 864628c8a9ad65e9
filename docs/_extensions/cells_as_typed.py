"""Cells of notebooks that run commands or write files, shown as a reader types them.

In the source of a page, a cell runs commands as `!engine-dyn run ...` and writes a file by the line
`%%writefile my_scene.toml`. The site shows the commands, or the file under its name.
"""

from __future__ import annotations

import re
from typing import Any

from docutils import nodes


def _named(block: nodes.literal_block, name: str) -> nodes.container:
    """Put the name of a file above what it holds, as captions of code blocks are."""
    wrapper = nodes.container("", literal_block=True, classes=["literal-block-wrapper"])
    wrapper += [nodes.caption("", name), block.deepcopy()]
    return wrapper


def _show(app: Any, tree: nodes.document) -> None:
    for block in list(tree.findall(nodes.literal_block)):
        if "cell_input" not in block.parent.get("classes", ()):
            continue
        text = block.astext()
        cell = block.parent.parent
        commands = re.sub(r"\\\n\s*", " ", text).splitlines()
        if file := re.match(r"%%writefile (\S+)\n", text):
            block["language"] = "toml" if file[1].endswith(".toml") else "text"
            block.rawsource = text[file.end() :]
            block.children = [nodes.Text(block.rawsource)]
            wrapper = _named(block, file[1])
            tree.set_id(wrapper)  # without one, Sphinx warns that the caption cannot be linked to
            block.parent.replace(block, wrapper)
            del cell.children[1:]  # "Writing my_scene.toml"
        elif text.startswith("%%bash\n") or all(line.startswith("!") for line in commands):
            block["language"] = "bash"
            block.rawsource = re.sub(r"^(%%bash\n|!)", "", text, flags=re.MULTILINE)
            block.children = [nodes.Text(block.rawsource)]


def setup(app: Any) -> dict[str, bool]:
    """Connect to Sphinx."""
    app.connect("doctree-read", _show)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
