"""Optional libraries, imported where they are used."""

from __future__ import annotations

import gc
import importlib
import logging
import re
import sys
import traceback
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from sweeps.base import array_libraries
from sweeps.base.errors import SceneError, one_line


def library(module: str, package: str, label: str, extra: str = "lab") -> Any:
    """Import a module of an optional package; `extra` is the extra of ours that installs it.

    Where it is not installed, the message begins with `label`: the file, or what else needs it.
    """
    array_libraries.let_in(module.partition(".")[0])
    try:
        return importlib.import_module(module)
    except ImportError:
        raise SceneError(
            f"{label}: needs {package}, which is not installed: pip install 'engine-dyn[{extra}]'"
        ) from None


@contextmanager
def library_reading(label: str, kind: str) -> Iterator[None]:
    """Turn whatever a library raises for a damaged file into one line; it prints nothing.

    `kind` is what the file should be, such as "a TDMS file".
    """
    before, hook = logging.root.manager.disable, sys.unraisablehook
    logging.disable(logging.CRITICAL)
    sys.unraisablehook = lambda _: None  # A library's half-made objects raise errors when freed
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    except (SceneError, MemoryError):
        raise
    except Exception as error:
        traceback.clear_frames(error.__traceback__)
        gc.collect()  # Objects are freed now, while errors in freeing them are not printed
        # Messages of libraries may hold the printed form of the stream that they read, such as
        # <_io.BytesIO object at 0x7f3a>.
        said = re.sub(
            r"""['"]?<[\w. ]+ object at 0x[0-9a-fA-F]+>['"]?""",
            "the file",
            str(getattr(error, "strerror", None) or error),
        )
        reason = one_line(said, 160) or type(error).__name__
        raise SceneError(f"{label}: not {kind}, or a damaged one ({reason})") from None
    finally:
        sys.unraisablehook = hook
        logging.disable(before)
