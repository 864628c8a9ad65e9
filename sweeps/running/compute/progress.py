"""The progress bar of a terminal or a notebook."""

from __future__ import annotations

import os
import sys
import threading
import warnings
from typing import Any

FIRST, BEAT = 2.0, 1.0  # Seconds until a bar is shown, and between updates without progress


def progress_bar(**options: Any) -> Any:
    """Return a bar of tqdm: a widget in a notebook that has ipywidgets, otherwise text.

    It shows after `FIRST` seconds, and its time goes on where what it counts takes long.
    """
    with warnings.catch_warnings():
        # tqdm warns where ipywidgets is missing; a bar of text does as well.
        warnings.filterwarnings("ignore", message="IProgress not found")
        from tqdm.auto import tqdm

    class Bar(tqdm):
        """One that a thread of its own keeps going."""

        beats: tuple[threading.Event, threading.Thread] | None = None
        shown = False

        def close(self) -> None:
            if self.beats is not None:
                ended, thread = self.beats
                ended.set()
                thread.join()  # The thread would draw once more what is cleared here
                if self.shown:  # Makes tqdm clear the bar, which was drawn
                    self.last_print_t = self._time()
            super().close()

        def beat(self, ended: threading.Event, wait: float) -> None:
            while not ended.wait(wait):
                wait, self.shown = BEAT, True
                self.refresh()

    bar = Bar(delay=FIRST, leave=False, **_size(options.get("file")), **options)
    if not bar.disable:
        ended = threading.Event()
        thread = threading.Thread(target=bar.beat, args=(ended, FIRST), daemon=True)
        bar.beats = ended, thread
        thread.start()
    return bar


def _size(file: Any) -> dict[str, int]:
    """Size of a bar where the terminal reports none: tqdm shows no bar on a terminal of 0 rows.

    Terminals that a program makes, such as those of `script`, often know neither number.
    """
    try:
        columns, rows = os.get_terminal_size((file or sys.stderr).fileno())
    except (OSError, ValueError, AttributeError):
        return {}
    return ({} if columns else {"ncols": 79}) | ({} if rows else {"nrows": 24})
