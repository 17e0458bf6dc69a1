"""One case of the closed loop: draws until the first recording is ambiguous, then three second motions."""

import json
import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from concealed.loop.draw import draw
from concealed.loop.judge import Place, Truth, end_of, start_of, suspects, truth_of
from concealed.loop.second import Recorded, first_recording, second_recording, write_recording
from concealed.streams import stream
from problem.errors import InputError
from recordings.run import Array

KINDS = ("designed", "random", "condition")
ATTEMPTS = 25
FIRST = "first"
FAILURES = (InputError, ValueError, ArithmeticError)  # of what is judged


@dataclass(frozen=True)
class Forecast:
    """What a design expects of a motion for one question: the names, and the chances to end right, wrong and open."""

    names: frozenset[Place]
    right: float
    wrong: float
    open: float


@dataclass(frozen=True, eq=False)
class Moved:
    """A second motion, (samples, 1 + joints), s and rad, and what is expected of it."""

    motion: Array
    forecasts: tuple[Forecast, ...] = ()


@dataclass(frozen=True)
class Tools:
    """What is judged, reached through functions that see the folder of a recording and never the truth.

    diagnose: (recording, out) writes out/verdict.json. suspect: (verdict, robot, recording) tells groups of names that
    may be taken for each other. move: (kind, verdict, robot, recording, seed) gives a second motion, None where none
    can help.
    """

    diagnose: Callable[[Path, Path], None]
    suspect: Callable[[Path, Path, Path], Sequence[Sequence[Any]]]
    move: Callable[[str, Path, Path, Path, int], Moved | None]


@dataclass(frozen=True)
class Ended:
    """How a second motion ended; why: what went wrong, if anything; forecast: what was expected, where anything was."""

    end: str
    why: str = ""
    forecast: Forecast | None = None


@dataclass(frozen=True)
class Folders:
    """Where the parts of a case stand, by its name."""

    out: Path
    name: str

    def observation(self, what: str) -> Path:
        """A recording that a diagnosis may see."""
        return self.out / "observations" / self.name / what

    def verdict(self, what: str) -> Path:
        """Where its verdict goes."""
        return self.out / "verdicts" / self.name / what

    def truth(self, what: str) -> Path:
        """The sealed answer."""
        return self.out / "truth" / f"{self.name}-{what}.json"

    def clear(self) -> None:
        """Removes what an earlier draw left."""
        for part in ("observations", "verdicts"):
            shutil.rmtree(self.out / part / self.name, ignore_errors=True)
        for path in (self.out / "truth").glob(f"{self.name}-*"):
            path.unlink()


def play_case(seed: int, number: int, out: Path, tools: Tools) -> dict[str, Any]:
    """The result of a case as plain data; ends is empty where no draw was ambiguous."""
    folders = Folders(out, stream("loop case", seed, number).bytes(6).hex())
    passed: list[dict[str, Any]] = []
    for attempt in range(ATTEMPTS):
        folders.clear()
        drawn = draw(seed, number, attempt)
        try:
            recorded = first_recording(drawn)
        except FloatingPointError:
            passed.append({"pair": drawn.pair, "start": "ran away"})
            continue
        try:
            verdict, truth = _first(recorded, folders, tools)
            start, suspected = _ambiguity(verdict, truth, folders, tools)
        except FAILURES as error:
            passed.append({"pair": drawn.pair, "start": "failed", "why": str(error)})
            continue
        if not suspected:
            passed.append({"pair": drawn.pair, "start": start})
            continue
        found = {kind: _second(kind, recorded, folders, tools, truth, suspected, seed + number) for kind in KINDS}
        about = {"tier": drawn.plan.tier, "pair": drawn.pair, "multiple": recorded.simulated.multiples[0]}
        return {"case": number, "name": folders.name, "attempt": attempt, "hidden": list(truth.hidden), **about,
                "start": start, "suspected": sorted(suspected, key=str), **_told(found), "passed": passed}  # fmt: skip
    return {"case": number, "name": folders.name, "ends": {}, "passed": passed}


def _told(found: dict[str, Ended]) -> dict[str, Any]:
    """The ends, what failed, and what was expected: chances to end right, wrong and open."""
    expected = {kind: each.forecast for kind, each in found.items()}
    return {
        "ends": {kind: each.end for kind, each in found.items()},
        "failed": {kind: each.why for kind, each in found.items() if each.why},
        "forecast": {kind: [each.right, each.wrong, each.open] for kind, each in expected.items() if each},
    }


def _first(recorded: Recorded, folders: Folders, tools: Tools) -> tuple[dict[str, Any], Truth]:
    write_recording(recorded.simulated, folders.observation(FIRST), folders.truth(FIRST))
    tools.diagnose(folders.observation(FIRST), folders.verdict(FIRST))
    return _read(folders.verdict(FIRST) / "verdict.json"), truth_of(_read(folders.truth(FIRST)))


def _ambiguity(verdict: dict[str, Any], truth: Truth, folders: Folders, tools: Tools) -> tuple[str, frozenset[Place]]:
    """How a case begins, and the names that are suspected beside the hidden one; none where there is no doubt.

    told: the verdict lists the hidden effect among rivals. mistaken: it names another one alone, which the first
    recording does not tell from the hidden effect.
    """
    start = start_of(verdict, truth)
    if start == "ambiguous":
        return "told", suspects(verdict, truth)
    if start == "another class":
        first = folders.observation(FIRST)
        groups = tools.suspect(folders.verdict(FIRST) / "verdict.json", first / "limits.yaml", first)
        names = [frozenset((name.effect, name.joint) for name in group) for group in groups]
        near = [group for group in names if truth.hidden in group]
        if near:
            return "mistaken", near[0]
    return start, frozenset()


def _second(
    kind: str,
    recorded: Recorded,
    folders: Folders,
    tools: Tools,
    truth: Truth,
    suspected: frozenset[Place],
    seed: int,
) -> Ended:
    """How it ended: where the diagnosis or the design fails, the question stays open."""
    first = folders.observation(FIRST)
    try:
        moved = tools.move(kind, folders.verdict(FIRST) / "verdict.json", first / "limits.yaml", first, seed)
    except FAILURES as error:
        return Ended("open", str(error))
    if moved is None:
        return Ended("open")  # the design says that no motion helps
    forecast = next((each for each in moved.forecasts if truth.hidden in each.names), None)
    try:
        both = second_recording(recorded, moved.motion, kind)
    except FloatingPointError:
        return Ended("ran away")
    write_recording(both, folders.observation(kind), folders.truth(kind))
    try:
        tools.diagnose(folders.observation(kind), folders.verdict(kind))
    except FAILURES as error:
        return Ended("open", str(error), forecast)
    return Ended(end_of(_read(folders.verdict(kind) / "verdict.json"), truth, suspected), "", forecast)


def _read(path: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return content
