"""The tier of real recordings: `armlab proof real-concealed` makes, diagnoses and judges random cases, each in a step
of its own, and its tables are scored here.

The cases follow from the seed and the recordings alone, and the seed of a judged proof from the commit, so that nobody
has seen them before.
"""

import subprocess
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from tempfile import TemporaryFile

from armlab.common.errors import InputError
from armlab.proof.blind.folders import claim_folder
from armlab.proof.blind.plan import random_stream
from armlab.proof.blind.real.real_page import write_score
from armlab.proof.blind.real.real_score import TIER, read_tables, real_measures
from armlab.proof.blind.sealed import (
    DRAFTS,
    OBSERVATION,
    OBSERVATIONS,
    SOURCE_ROOT,
    TRUTH,
    TRUTH_FILE,
    Score,
    SealedTier,
    command_of,
    is_made,
    one_thread_environment,
)
from armlab.recordings.public import LOCAL_COPIES_VARIABLE, PUBLIC_RECORDINGS, is_available, local_recording

LOOKS_FOLDER = SOURCE_ROOT / "results" / "real"  # of the log of looks at the validation runs of real recordings
MADE = "made"  # among the drafts: cases as the command makes them, all of one recording at once


@dataclass(frozen=True)
class RealCase:
    """A random case of a recording. number: from 1; 0 is the control, in which nothing is concealed."""

    seed: int
    recording: str
    number: int

    @property
    def name(self) -> str:
        """A random name, which says nothing about the case."""
        return random_stream("real name", self.seed, self.recording, self.number).bytes(6).hex()


@dataclass(frozen=True)
class RealSet:
    """Which recordings, how many random cases of each, and the seed; seeds 1000-1999 are for development.

    A recording is a public one or a folder of the local copies.
    """

    recordings: tuple[str, ...]
    cases: int
    seed: int

    def plans(self) -> Iterator[RealCase]:
        """The cases, the control of each recording first."""
        return (RealCase(self.seed, name, number) for name in self.recordings for number in range(self.cases + 1))

    @property
    def options(self) -> list[str]:
        """The set for the command that makes and judges it."""
        only = [word for name in self.recordings for word in ("--only", name)]
        return [*only, "--seed", str(self.seed), "--cases", str(self.cases)]


def prove_real(settings: RealSet, work: Path, results: Path, jobs: int, commit: str | None = None) -> Iterator[str]:
    """Conceals, seals, diagnoses, judges and scores; yields the lines that report it.

    Recordings that are not on this machine are left out; the tier is skipped where none is. work: folder of recordings,
    cases and verdicts, where an interrupted proof continues. results: folder of page, tables and figures. commit: of a
    judged proof, which is logged once. InputError for a folder of another set.
    """
    found = tuple(name for name in settings.recordings if _is_here(name))
    for name in settings.recordings:
        if name not in found:
            yield f"{name} is left out: it is neither in the folder {LOCAL_COPIES_VARIABLE} nor in the cache"
    if not found:
        yield "tier real is skipped: no recording of a real arm is on this machine"
        return
    chosen = replace(settings, recordings=found)
    claim_folder(chosen, work)
    for name in found:
        own = replace(chosen, recordings=(name,))
        if not all(is_made(work, case.name) for case in own.plans()):
            place = work.resolve()
            made, fetched = str(place / DRAFTS / MADE), str(place / "recordings")
            folders = ["--make", made, "--recordings", fetched, "--results", str(LOOKS_FOLDER)]
            yield from _run_command(["proof", "real-concealed", *own.options, *folders])
    yield from REAL.prove(chosen, work, results, jobs, commit)


def _is_here(name: str) -> bool:
    if name in PUBLIC_RECORDINGS:
        return is_available(PUBLIC_RECORDINGS[name])
    return local_recording(name) is not None


def _make(case: RealCase, draft: Path) -> None:
    """Takes a case from those that the command made."""
    made, key = draft.parent / MADE, f"{case.recording}-{case.number}"
    (made / OBSERVATIONS / key).replace(draft / OBSERVATION)
    (made / TRUTH / f"{key}.json").replace(draft / TRUTH_FILE)


def _question(_: RealCase, observation: Path) -> list[str]:
    return ["proof", "real-concealed", "--observation", str(observation)]


def _judge(settings: RealSet, work: Path, results: Path) -> Score:
    tables = (work / "tables").resolve()
    judging = ["--judge", str(work.resolve()), "--out", str(tables)]
    lines = list(_run_command(["proof", "real-concealed", *settings.options, *judging]))
    scored = read_tables(tables)
    lines += [f"wrote {path}" for path in write_score(settings.seed, scored, results)]
    measures = real_measures(scored)
    return Score(
        [*lines, *(each.line for each in measures)], scored.number, {TIER: [asdict(each.measure) for each in measures]}
    )


REAL = SealedTier("real", RealSet.plans, _make, _question, _judge)


def _run_command(arguments: Sequence[str]) -> Iterator[str]:
    """The lines that a command of armlab prints, as they come; InputError with its last error where it fails."""
    with (
        TemporaryFile("w+", encoding="utf-8") as errors,
        subprocess.Popen(
            command_of(arguments),
            stdout=subprocess.PIPE,
            stderr=errors,
            text=True,
            env=one_thread_environment(),
            cwd=SOURCE_ROOT,
        ) as running,
    ):
        try:
            for line in running.stdout or ():
                yield line.rstrip("\n")
            if running.wait():
                errors.seek(0)
                complaint = [line.strip() for line in errors if line.strip()] or ["no error output"]
                raise InputError(f"armlab {' '.join(arguments[:2])}: {complaint[-1]}")
        finally:
            running.kill()
