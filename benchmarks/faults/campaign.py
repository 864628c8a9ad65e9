"""Every system call of a run is made to fail once, and the run is killed there.

A point is one run with one fault at one of its system calls; an interrupted campaign goes on with
`--first`. A run that is not killed must end with exit status 0 and the right archive, or say in one
line why it did not; at every moment the archive must be the old one, none, or the right one; and
the same command with --resume must then end with an archive that is equal to that of an undisturbed
run, to the byte, and leave nothing beside it.
"""

from __future__ import annotations

import random
import re
import shutil
import signal
import sys
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from benchmarks import command
from benchmarks.faults import power
from benchmarks.faults.scenarios import OTHER, SCENARIOS, Command, Scenario
from benchmarks.faults.server import Outcome, Server, Unavailable
from sweeps.running.archive.partial import Damaged, Partial

_ROOM = ["ENOSPC", "EDQUOT", "EIO"]

_ERRORS = {
    "open": [*_ROOM, "EINTR", "full"],
    "write": [*_ROOM, "EINTR", "short", "full"],
    "fsync": [*_ROOM, "EINTR"],
    "rename": _ROOM,
    "link": _ROOM,
    "mkdir": [*_ROOM, "full"],
    "ftruncate": [*_ROOM, "EINTR"],
    "close": [*_ROOM, "EINTR"],
    "read": ["EIO", "EINTR", "short"],
    "unlink": ["EIO"],
    "rmdir": ["EIO"],
    "opendir": ["EIO"],
    "chmod": ["EIO"],
    "flock": ["EIO", "EINTR", "ENOLCK"],
}
"""Which errors each call is made to end with; `full`: no room from then on."""

_CLOSING = re.compile(r"(write|close) .*\.nc")

_LOST = [f"power {rule}" for rule in power.RULES]

_DEATHS = ["kill", "kill after", *_LOST]


class Point(NamedTuple):
    """One fault.

    That is an error ("EIO"), "short" (fewer bytes than asked), "full" (ENOSPC from then on),
    "kill", "kill after" (the call), or "power RULE" (killed, and what was not synced is lost).
    """

    scenario: str
    call: int  # the number of the system call
    fault: str


class Verdict(NamedTuple):
    """What became of a point.

    It ended "right", "told" (one line and a status), "killed", "library" (netCDF's library crashes
    where the last write of a file or its closing fails; no program can tell that), or "wrong".
    """

    hit: str  # the call that failed; empty where the run ended before
    ended: str
    wrong: str  # what should not be; empty where all is as promised


class Campaign:
    """The points of all scenarios, tried one after the other in processes of a server.

    Parameters
    ----------
    server : Server
        It runs.
    """

    def __init__(self, server: Server) -> None:
        self.server = server
        self.work, self.shadows = server.folder / "work", server.folder / "shadows"
        self.expected: dict[str, bytes] = {}
        self.names: dict[str, set[str]] = {}
        self.old: dict[str, bytes | None] = {}
        self.points = self._points()

    # --- which points there are ---------------------------------------------------------------

    def _points(self) -> list[Point]:
        """All points: first one of every kind, then a second one of every kind, and so on.

        Of one kind are the points of a scenario with the same call, on the same file, and fault.
        """
        kinds: dict[tuple[str, str, str], list[Point]] = defaultdict(list)
        for scene in SCENARIOS:
            calls = self._undisturbed(scene)
            for number, call in enumerate([*calls, "end"], 1):
                name = call.split(" ")[0]
                faults = [*_ERRORS[name], *_DEATHS] if name != "end" else _LOST
                kind = " ".join(part.split(".new")[0][:40] for part in call.split("/"))
                for fault in faults:
                    kinds[scene, kind, fault].append(Point(scene, number, fault))
        chance = random.Random(1)
        for points in kinds.values():
            chance.shuffle(points)
        # The shuffled kinds are dealt out in turn, so any number of points is spread over all.
        order = list(kinds.values())
        chance.shuffle(order)
        longest = max(map(len, order))
        return [points[i] for i in range(longest) for points in order if i < len(points)]

    def _undisturbed(self, name: str) -> list[str]:
        """Run a scenario twice without a fault: its calls, its archive and what lies beside it."""
        output = self.work / SCENARIOS[name].output
        for _ in range(2):
            self._prepare(name)
            self.old[name] = output.read_bytes() if output.exists() else None
            done = self._run(SCENARIOS[name].command)
            found = output.read_bytes()
            if self.expected.setdefault(name, found) != found:
                raise RuntimeError(f"{name}: two undisturbed runs differ")
            self.names[name] = self._listed()
        return done.calls

    def _run(self, words: Command) -> Outcome:
        """Run a command without a fault."""
        done = self.server.run(words, self.work)
        if done.status or done.errors:
            raise RuntimeError(f"{' '.join(words)}: {done.errors}")
        return done

    def _prepare(self, name: str) -> Scenario:
        """Make what is there before a run."""
        scenario = SCENARIOS[name]
        shutil.rmtree(self.work, ignore_errors=True)
        kept = self._before(name)
        if kept.exists():
            shutil.copytree(kept, self.work)
            return scenario
        self.work.mkdir()
        (self.work / "scene.toml").write_text(scenario.scene)
        (self.work / "other.toml").write_text(OTHER)
        for words in scenario.before:
            self._run(words)
        if scenario.cut:
            calls = self._run(scenario.command).calls
            (self.work / scenario.output).unlink()
            blocks = [
                i for i, call in enumerate(calls) if call.startswith("rename") and "block" in call
            ]
            # Killed behind the second block, which is synced by then.
            self.server.run(scenario.command, self.work, call=blocks[1] + 6, fault="kill")
        shutil.copytree(self.work, kept)
        return scenario

    def _before(self, name: str) -> Path:
        """Folder of what is there before a run."""
        return self.server.folder / f"before {name}"

    def _listed(self) -> set[str]:
        return {str(path.relative_to(self.work)) for path in self.work.rglob("*")}

    # --- what becomes of them -----------------------------------------------------------------

    def attempt(self, point: Point) -> Verdict:
        """Try one point; what became of it."""
        scenario = self._prepare(point.scenario)
        loses = point.fault.startswith("power")
        if loses:
            power.all_synced(self.work, self.shadows)
        done = self.server.run(
            scenario.command, self.work, call=point.call,
            fault="kill" if loses else point.fault, shadows=self.shadows if loses else None,
        )  # fmt: skip
        deadly = point.fault in _DEATHS and bool(done.hit)
        ended, wrong = "killed" if deadly else "right" if done.status == 0 else "told", ""
        if done.status == -signal.SIGSEGV and _CLOSING.fullmatch(done.hit):
            ended = "library"
        elif not (deadly and done.status == -signal.SIGKILL):
            wrong = _badly_ended(done)
        if loses:
            power.lose(self.work, self.shadows, point.fault.split(" ")[1], point.call)
        wrong = wrong or self._badly_left(point.scenario, done)
        wrong = wrong or self._badly_completed(point.scenario)
        return Verdict(done.hit, "wrong" if wrong else ended, wrong)

    def _badly_left(self, name: str, done: Outcome) -> str:
        """What is wrong with the files that a run has left; empty where nothing is."""
        output = self.work / SCENARIOS[name].output
        found = output.read_bytes() if output.exists() else None
        if found == self.expected[name]:
            return ""
        if done.status == 0:
            return f"exit status 0, and the archive is {_described(found)}"
        if found != self.old[name]:
            return f"the archive is neither the old nor the new one: {_described(found)}"
        partial = Partial.of(output)
        partial.header()
        before = Partial.of(self._before(name) / SCENARIOS[name].output).finished()
        for number in (*before, *done.done):
            try:
                partial.read(number)
            except Damaged as error:
                if partial.adding().header() is None:  # `extend` has blocks of its own
                    return f"block {number} was reported finished, and is lost ({error})"
        return ""

    def _badly_completed(self, name: str) -> str:
        """Complete a run without a fault; what is wrong then, empty where nothing is."""
        scenario = SCENARIOS[name]
        done = self.server.run(scenario.again, self.work)
        said = scenario.afterwards
        if done.status and not (said and done.status == 2 and said in done.errors):
            return f"not completed: status {done.status}, {done.errors.strip()}"
        if (self.work / scenario.output).read_bytes() != self.expected[name]:
            return "completed, and other bytes than without a fault"
        extra = self._listed() - self.names[name]
        return f"completed, and left over: {', '.join(sorted(extra))}" if extra else ""


def _badly_ended(done: Outcome) -> str:
    """What is wrong with how a run ended that was not killed; empty where nothing is."""
    if done.status == 0:
        return f"exit status 0, and on stderr: {done.errors.strip()}" if done.errors else ""
    if done.status is None:
        return "does not end"
    if done.status not in (1, 2):
        return f"ended with status {done.status}: {done.errors.strip()[-300:]}"
    line = done.errors
    if line.count("\n") != 1 or not line.startswith("engine-dyn: ") or "--debug shows" in line:
        return f"status {done.status}, not told in one line: {line.strip()[-600:]}"
    return ""


def _described(data: bytes | None) -> str:
    return "missing" if data is None else f"another one of {len(data)} bytes"


def summary(tried: Mapping[Point, Verdict], every: int) -> dict[str, Any]:
    """Figures of the points that were tried, of so many."""
    reached = {p: v for p, v in tried.items() if v.hit or p.fault.startswith("power")}

    def by(kinds: Iterable[str]) -> dict[str, int]:
        return dict(sorted(Counter(kinds).items()))

    return {
        "points": len(reached),
        "of": every,
        "not_reached": len(tried) - len(reached),
        "ended": by(v.ended for v in reached.values()),
        "faults": by(p.fault for p in reached),
        "calls": by(v.hit.split(" ")[0] or "end" for v in reached.values()),
        "scenarios": by(p.scenario for p in reached),
        "wrong": [
            f"{p.scenario}, call {p.call}, {p.fault} ({v.hit}): {v.wrong}"
            for p, v in tried.items() if v.wrong
        ],
    }  # fmt: skip


def work(_: Path, given: Any) -> dict[str, Any]:
    """Try some of the points."""
    tried: dict[Point, Verdict] = {}
    with Server() as server:
        campaign = Campaign(server)
        chosen = campaign.points[given.first : given.first + given.points]
        for number, point in enumerate(chosen, given.first):
            verdict = tried[point] = campaign.attempt(point)
            if verdict.wrong:
                print(f"{number}, {point}: {verdict.hit}: {verdict.wrong}", flush=True)
            if number % 100 == 0:
                command.log(f"point {number} of {len(campaign.points)}")
    return summary(tried, len(campaign.points))


def main(arguments: Sequence[str]) -> int:
    """Run the campaign."""
    try:
        return command.campaign("faults", __doc__, arguments, work, first=0, points=2500)
    except Unavailable as error:
        sys.exit(f"{error}")
