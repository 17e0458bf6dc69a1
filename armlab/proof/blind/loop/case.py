"""One case of the closed loop: draws until a first recording is ambiguous, second motions, and judgement."""

import json
import shutil
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.proof.blind.formats import Truth, read_model
from armlab.proof.blind.loop.recordings import (
    FirstRecording,
    draw_case,
    simulate_first_recording,
    simulate_second_recording,
    write_loop_recording,
)
from armlab.proof.blind.plan import random_stream

Place = tuple[str, int | None]
Start = Literal["ambiguous", "one name", "another class", "nothing"]
End = Literal["right", "wrong", "open"]


@dataclass(frozen=True)
class TrueNames:
    """hidden: name and joint of the hidden effect. background: what is there as well and may be named."""

    hidden: Place
    background: frozenset[Place] = frozenset()


def true_names(truth: Truth) -> TrueNames:
    """The names that are right in a case with one hidden effect."""
    hidden = truth.injected[0]
    return TrueNames((hidden.effect, hidden.joint), frozenset((each.effect, each.joint) for each in truth.beside))


def judge_start(verdict: dict[str, Any], answer: TrueNames) -> Start:
    """Whether a first verdict leaves the hidden effect among rivals."""
    groups = [(own, rivals) for own, rivals in _name_groups(verdict) if answer.hidden in {own, *rivals}]
    if any(rivals for _, rivals in groups):
        return "ambiguous"
    if groups:
        return "one name"
    return "another class" if verdict["findings"] else "nothing"


def find_suspects(verdict: dict[str, Any], answer: TrueNames) -> frozenset[Place]:
    """All names of the groups that hold the hidden effect."""
    return frozenset(
        name for own, rivals in _name_groups(verdict) if answer.hidden in {own, *rivals} for name in (own, *rivals)
    )


def judge_end(verdict: dict[str, Any], answer: TrueNames, suspected: frozenset[Place]) -> End:
    """What became of the suspects of the first verdict.

    right: the hidden effect alone is named, without rivals. wrong: another suspect is claimed, and the hidden effect
    is not among its rivals. open: everything else, a verdict without any of them too.
    """
    groups = [(own, rivals) for own, rivals in _name_groups(verdict) if own in suspected or answer.hidden in rivals]
    false = [own for own, rivals in groups if own != answer.hidden and answer.hidden not in rivals]
    if any(own not in answer.background for own in false):
        return "wrong"
    return "right" if (answer.hidden, frozenset()) in groups else "open"


def _name_groups(verdict: dict[str, Any]) -> Iterable[tuple[Place, frozenset[Place]]]:
    for finding in verdict["findings"]:
        rivals = frozenset((each["effect"], each["joint"]) for each in finding["rivals"])
        yield (finding["effect"], finding["joint"]), rivals


MOTION_KINDS = ("designed", "random", "condition")
MAX_ATTEMPTS = 25
FIRST_RECORDING = "first"
JUDGED_FAILURES = (InputError, ValueError, ArithmeticError)  # of what is judged


@dataclass(frozen=True)
class Forecast:
    """What a design expects of a motion for one question: the names, and the chances to end right, wrong and open."""

    names: frozenset[Place]
    right: float
    wrong: float
    open: float


@dataclass(frozen=True, eq=False)
class SecondMotion:
    """A second motion, (samples, 1 + joints), s and rad, and what is expected of it."""

    motion: Array
    forecasts: tuple[Forecast, ...] = ()


@dataclass(frozen=True)
class Tools:
    """What is judged, reached through functions that see the folder of a recording and never the truth.

    diagnose: (recording, out) writes out/verdict.json. suspect: (verdict, robot, recording) gives groups of names that
    are easily confused. move: (kind, verdict, robot, recording, seed) gives a second motion, None if none can help.
    """

    diagnose: Callable[[Path, Path], None]
    suspect: Callable[[Path, Path, Path], Sequence[Sequence[Any]]]
    move: Callable[[str, Path, Path, Path, int], SecondMotion | None]


@dataclass(frozen=True)
class MotionOutcome:
    """How a second motion ended. why: the error, if any. forecast: what was expected, if anything."""

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
        """Removes the files of an earlier draw."""
        for part in ("observations", "verdicts"):
            shutil.rmtree(self.out / part / self.name, ignore_errors=True)
        for path in (self.out / "truth").glob(f"{self.name}-*"):
            path.unlink()


def play_case(seed: int, number: int, out: Path, tools: Tools) -> dict[str, Any]:
    """The result of a case as plain data; `ends` is empty if no draw was ambiguous."""
    folders = Folders(out, random_stream("loop case", seed, number).bytes(6).hex())
    passed: list[dict[str, Any]] = []
    for attempt in range(MAX_ATTEMPTS):
        folders.clear()
        drawn = draw_case(seed, number, attempt)
        try:
            recorded = simulate_first_recording(drawn)
        except FloatingPointError:
            passed.append({"pair": drawn.pair, "start": "ran away"})
            continue
        try:
            verdict, answer = _diagnose_first(recorded, folders, tools)
            start, suspected = _find_ambiguity(verdict, answer, folders, tools)
        except JUDGED_FAILURES as error:
            passed.append({"pair": drawn.pair, "start": "failed", "why": str(error)})
            continue
        if not suspected:
            passed.append({"pair": drawn.pair, "start": start})
            continue
        found = {
            kind: _play_second(kind, recorded, folders, tools, answer, suspected, seed + number)
            for kind in MOTION_KINDS
        }
        about = {"tier": drawn.plan.tier, "pair": drawn.pair, "multiple": recorded.simulated.multiples[0]}
        return {
            "case": number,
            "name": folders.name,
            "attempt": attempt,
            "hidden": list(answer.hidden),
            **about,
            "start": start,
            "suspected": sorted(suspected, key=str),
            **_result_fields(found),
            "passed": passed,
        }
    return {"case": number, "name": folders.name, "ends": {}, "passed": passed}


def _result_fields(found: dict[str, MotionOutcome]) -> dict[str, Any]:
    """The ends, what failed, and what was expected: chances to end right, wrong and open."""
    expected = {kind: each.forecast for kind, each in found.items()}
    return {
        "ends": {kind: each.end for kind, each in found.items()},
        "failed": {kind: each.why for kind, each in found.items() if each.why},
        "forecast": {kind: [each.right, each.wrong, each.open] for kind, each in expected.items() if each},
    }


def _diagnose_first(recorded: FirstRecording, folders: Folders, tools: Tools) -> tuple[dict[str, Any], TrueNames]:
    write_loop_recording(recorded.simulated, folders.observation(FIRST_RECORDING), folders.truth(FIRST_RECORDING))
    tools.diagnose(folders.observation(FIRST_RECORDING), folders.verdict(FIRST_RECORDING))
    verdict = _read_json(folders.verdict(FIRST_RECORDING) / "verdict.json")
    return verdict, true_names(read_model(Truth, folders.truth(FIRST_RECORDING)))


def _find_ambiguity(
    verdict: dict[str, Any], answer: TrueNames, folders: Folders, tools: Tools
) -> tuple[str, frozenset[Place]]:
    """How a case begins, and the suspected names, the hidden one among them; none if nothing is in doubt.

    told: the verdict lists the hidden effect among rivals. mistaken: it names another effect alone, which the first
    recording does not separate from the hidden one.
    """
    start = judge_start(verdict, answer)
    if start == "ambiguous":
        return "told", find_suspects(verdict, answer)
    if start == "another class":
        first = folders.observation(FIRST_RECORDING)
        groups = tools.suspect(folders.verdict(FIRST_RECORDING) / "verdict.json", first / "limits.yaml", first)
        names = [frozenset((name.effect, name.joint) for name in group) for group in groups]
        near = [group for group in names if answer.hidden in group]
        if near:
            return "mistaken", near[0]
    return start, frozenset()


def _play_second(
    kind: str,
    recorded: FirstRecording,
    folders: Folders,
    tools: Tools,
    answer: TrueNames,
    suspected: frozenset[Place],
    seed: int,
) -> MotionOutcome:
    """How a second motion ended; if the diagnosis or the design fails, the question stays open."""
    first = folders.observation(FIRST_RECORDING)
    try:
        moved = tools.move(kind, folders.verdict(FIRST_RECORDING) / "verdict.json", first / "limits.yaml", first, seed)
    except JUDGED_FAILURES as error:
        return MotionOutcome("open", str(error))
    if moved is None:
        return MotionOutcome("open")  # the design says that no motion helps
    forecast = next((each for each in moved.forecasts if answer.hidden in each.names), None)
    try:
        both = simulate_second_recording(recorded, moved.motion, kind)
    except FloatingPointError:
        return MotionOutcome("ran away")
    write_loop_recording(both, folders.observation(kind), folders.truth(kind))
    try:
        tools.diagnose(folders.observation(kind), folders.verdict(kind))
    except JUDGED_FAILURES as error:
        return MotionOutcome("open", str(error), forecast)
    return MotionOutcome(judge_end(_read_json(folders.verdict(kind) / "verdict.json"), answer, suspected), "", forecast)


def _read_json(path: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return content
