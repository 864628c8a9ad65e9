"""Processes that are forked while another thread holds a lock: the lock is new in them."""

import os
from pathlib import Path

import pytest

from tests.support.archives import sound_archive
from tests.sweeps.processes import python

FORK = """
import os, signal, sys
from pathlib import Path
from engine_dyn.pressure import memory
from sweeps.reading import netcdf_child

class Family:
    pass

family = Family()

def remember():
    return memory.remembered(family, "key", tuple)

def read():
    return netcdf_child.read_apart(Path(sys.argv[1]))

def held(lock, wanted):
    with lock:  # as another thread holds it; the child has only the thread that forks
        child = os.fork()
        if not child:
            signal.alarm(20)
            wanted()
            os._exit(0)
        return os.waitpid(child, 0)[1]

lock = memory._making[id(family), "key"] = memory.threading.Lock()
print(held(memory._lock, remember), held(lock, remember), held(netcdf_child._LOCK, read))
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs forks")
def test_locks_are_free_in_a_fork(tmp_path: Path) -> None:
    (tmp_path / "sound.nc").write_bytes(sound_archive())
    told = python(FORK, tmp_path / "sound.nc", timeout=120)
    assert told.stdout == "0 0 0\n", told.stderr
