"""docs/notebook.md: its blocks run one after the other, and print what the page says."""

import re
from pathlib import Path

import matplotlib
import pytest

PAGE = Path(__file__).resolve().parents[1] / "docs" / "notebook.md"


@pytest.mark.compiled
def test_blocks_print_what_the_page_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    matplotlib.use("agg")
    blocks = re.findall(
        r"```python\n(.*?)```(?:\n\n```text\n(.*?)```)?", PAGE.read_text("utf-8"), re.DOTALL
    )
    assert len(blocks) >= 8
    space: dict[str, object] = {}
    for code, told in blocks:
        exec(code, space)
        printed = "\n".join(line.rstrip() for line in capsys.readouterr().out.splitlines())
        assert printed.rstrip("\n") == told.rstrip("\n")
    for name in ("torque.png", "mine.png"):
        assert (tmp_path / name).stat().st_size > 10_000
    import matplotlib.pyplot as plt

    plt.close("all")
