"""Random cases of public recordings in steps: identify, draw and conceal; diagnose; judge; and the tables of that.

`armlab proof run --tier real` takes the steps, with the seal between them, and scores the tables; `armlab proof
calibrate-names --real` learns from the names that were weighed.
"""

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import pandas as pd
from pydantic import TypeAdapter

from armlab.common.errors import InputError
from armlab.common.files import write_texts
from armlab.common.settings import read_json, suggest_name
from armlab.effects.library import EFFECT_IDS, effect_named
from armlab.proof.open.real_concealed.claims import (
    DrawnVerdict,
    LabelledFinding,
    judge_drawn,
    label_weighed,
    with_own_findings,
)
from armlab.proof.open.real_concealed.conceal import ReferenceModel, SoughtEffect, identify_reference
from armlab.proof.open.real_concealed.concealed_case import Case
from armlab.proof.open.real_concealed.draw import DrawnCase, draw_cases
from armlab.proof.open.real_concealed.examine import (
    OUTCOME_ADAPTER,
    ExaminedCase,
    ReportedFinding,
    diagnose_concealed,
    sought_in_case,
)
from armlab.proof.open.real_concealed.observation import read_observation, write_observation
from armlab.proof.open.real_identification.identify_recording import recipe_named
from armlab.proof.open.real_identification.looks import LOOKS_FILE, Looks
from armlab.recordings.load import load_recording
from armlab.recordings.public import local_recording, open_public_recording
from armlab.recordings.reading.words import NAMES as MISTAKE_NAMES
from armlab.recordings.recording import Recording
from armlab.report.words import effect_in_words

REAL_ARMS = ("emps", "staubli-tx40", "unisa-ur10", "unisa-panda", "kuka-kr300")
TABLES = ("cases.csv", "claims.csv", "recordings.csv")
WEIGHED_FILE, WEIGHED_SCHEMA = "weighed.json", "weighed/1"
CASE_COLUMNS = (
    "recording",
    "case",
    "way",
    "kind",
    "concealed",
    "sought",
    "strength",
    "answer",
    "said",
    "seconds",
    "refused",
)
CLAIM_COLUMNS = ("recording", "case", "concealed", "strength", "claim", "verdict", "class_size", "probability")
RECORDING_COLUMNS = ("recording", "reference", "control")


@dataclass(frozen=True)
class RandomCases:
    """Which recordings, how many cases of each, and the seed. Seeds 1000-1999 are for development.

    A recording is a public one or a folder of the local copies.
    """

    recordings: tuple[str, ...]
    cases: int
    seed: int

    def __post_init__(self) -> None:
        """Raises InputError for an unknown recording."""
        for name in self.recordings:
            if name not in REAL_ARMS and local_recording(name) is None:
                raise InputError(f"unknown recording '{name}': {suggest_name(name, list(REAL_ARMS))}")


@dataclass(frozen=True, eq=False)
class RandomStudy:
    """A recording with its control and the verdicts on its random cases. description: of the reference model.

    labelled: the findings of each case that were weighed.
    """

    name: str
    description: str
    control: ExaminedCase
    verdicts: tuple[DrawnVerdict, ...]
    labelled: tuple[tuple[LabelledFinding, ...], ...]


@dataclass(frozen=True)
class RandomTruth:
    """The answer to a random case. number: from 1 among those of its recording, 0 for the control.

    joints: of the arm. reference: how its model was chosen. sought: what should be named.
    """

    case: Case
    number: int
    joints: int
    reference: str
    strength: float
    sought: tuple[SoughtEffect, ...]


OBSERVATIONS, TRUTH, VERDICTS, OUTCOME_FILE = "observations", "truth", "verdicts", "outcome.json"


def make_cases(
    settings: RandomCases, recordings: Path, results: Path, folder: Path, progress: Callable[[str], None]
) -> Iterator[str]:
    """Writes observations and answers into a folder, the control of each recording first, and diagnoses nothing.

    Each look at the validation runs that their diagnosis will take is logged.
    """
    looks = Looks(results / LOOKS_FILE)
    for name in settings.recordings:
        progress(f"{name}: the reference model")
        reference = identify_reference(_open_recording(name, recordings), recipe_named(name))
        yield f"{name}: reference {reference.description}"
        drawn = (DrawnCase(Case(name), 0.0), *draw_cases(reference, settings.seed, settings.cases))
        for number, each in enumerate(drawn):
            write_random_case(reference, number, each, folder)
            for run in reference.recording.with_role("validate"):
                looks.note(reference.recording.arm.name, run.name, f"concealed: {each.case.name}")


def _open_recording(name: str, recordings: Path) -> Recording:
    """A public recording, or the folder of the local copies that `RandomCases` has found."""
    if name in REAL_ARMS:
        return open_public_recording(name, recordings)
    folder = local_recording(name)
    assert folder is not None
    return load_recording(folder)


def write_random_case(reference: ReferenceModel, number: int, drawn: DrawnCase, folder: Path) -> None:
    """Writes the observation and the answer of a case, the answer last."""
    key = f"{drawn.case.recording}-{number}"
    for part in (OBSERVATIONS, TRUTH):
        (folder / part).mkdir(parents=True, exist_ok=True)
    write_observation(reference, drawn.case, folder / OBSERVATIONS / key)
    sought = () if drawn.case.control else sought_in_case(reference, drawn.case)
    joints = len(reference.recording.arm)
    truth = RandomTruth(drawn.case, number, joints, reference.description, drawn.strength, sought)
    (folder / TRUTH / f"{key}.json").write_text(json.dumps(asdict(truth), indent=1) + "\n", encoding="utf-8")


def examine_observation(
    observation: Path, out: Path, progress: Callable[[str], None] = lambda message: None
) -> Iterator[str]:
    """Diagnoses the recording of an observation, and writes what is said into a folder."""
    outcome = diagnose_concealed(*read_observation(observation), progress)
    text = OUTCOME_ADAPTER.dump_json(outcome, indent=1).decode() + "\n"
    yield from (f"wrote {path}" for path in write_texts({OUTCOME_FILE: text}, out))


def judge_cases(settings: RandomCases, folder: Path, out: Path) -> Iterator[str]:
    """Judges the cases of a folder by their answers, and writes the tables.

    A case without an outcome counts as refused. InputError where a recording has no case there.
    """
    read = TypeAdapter(RandomTruth).validate_python
    answers = {path.stem: read(read_json(path)) for path in sorted((folder / TRUTH).glob("*.json"))}
    studies = list[RandomStudy]()
    for name in settings.recordings:
        own = sorted((each.number, key) for key, each in answers.items() if each.case.recording == name)
        if not own:
            raise InputError(f"{folder} holds no case of {name}: name the recordings that it was made of")
        judged = [(answers[key], _read_outcome(folder / VERDICTS / key)) for _, key in own]
        control = judged[0][1]
        if control.refused:
            yield f"{name} is left out: with nothing concealed it is not diagnosed: {control.refused}"
        else:
            studies.append(_judge(name, judged[1:], control))
    texts = random_tables(studies) | {WEIGHED_FILE: weighed_text(settings, studies)}
    yield from (f"wrote {path}" for path in write_texts(texts, out))


def _read_outcome(folder: Path) -> ExaminedCase:
    try:
        return OUTCOME_ADAPTER.validate_json((folder / OUTCOME_FILE).read_bytes())
    except FileNotFoundError:
        return ExaminedCase(folder.name, (), 0.0, "no verdict")


def _judge(name: str, judged: Sequence[tuple[RandomTruth, ExaminedCase]], control: ExaminedCase) -> RandomStudy:
    cases = [(outcome, truth.sought) for truth, outcome in judged]
    control = with_own_findings(control, cases, judged[0][0].joints)
    verdicts = tuple(
        judge_drawn(DrawnCase(truth.case, truth.strength), outcome, truth.sought, control, truth.joints)
        for truth, outcome in judged
    )
    labelled = tuple(tuple(label_weighed(outcome, truth.sought, control, truth.joints)) for truth, outcome in judged)
    return RandomStudy(name, judged[0][0].reference, control, verdicts, labelled)


def random_tables(studies: Sequence[RandomStudy]) -> dict[str, str]:
    """The texts of `TABLES`: a row for each thing sought, each new claim, each recording."""
    numbered = [pair for each in studies for pair in enumerate(each.verdicts, 1)]
    cases = [row for number, verdict in numbered for row in _case_rows(number, verdict)]
    claims = [row for number, verdict in numbered for row in _claim_rows(number, verdict)]
    about = [(each.name, each.description, list_findings(each.control.findings)) for each in studies]
    frames = (
        pd.DataFrame(cases, columns=list(CASE_COLUMNS)),
        pd.DataFrame(claims, columns=list(CLAIM_COLUMNS)),
        pd.DataFrame(about, columns=list(RECORDING_COLUMNS)),
    )
    return {
        name: frame.to_csv(index=False, float_format="%.4g", lineterminator="\n")
        for name, frame in zip(TABLES, frames, strict=True)
    }


def weighed_text(settings: RandomCases, studies: Sequence[RandomStudy]) -> str:
    """The names that were weighed for each finding of each case, and which of them are right."""
    findings = [
        {"recording": study.name, "case": number, **asdict(each)}
        for study in studies
        for number, labelled in enumerate(study.labelled, 1)
        for each in labelled
    ]
    return json.dumps({"schema": WEIGHED_SCHEMA, "seed": settings.seed, "findings": findings}) + "\n"


def _case_rows(number: int, verdict: DrawnVerdict) -> Iterator[tuple[Any, ...]]:
    case, outcome = verdict.drawn.case, verdict.outcome
    way, kind = ("withheld", case.withheld[0].kind) if case.injected is None else ("injected", case.injected.effect)
    said = "; ".join(_claim_in_words(each.finding) for each in verdict.claims)
    about = case.recording, number, way, kind.replace("_", " "), case.name
    for part in verdict.parts:
        judged = part.sought.label, verdict.drawn.strength, part.answer, said
        yield (*about, *judged, outcome.seconds, outcome.refused)


def _claim_rows(number: int, verdict: DrawnVerdict) -> Iterator[tuple[Any, ...]]:
    case = verdict.drawn.case
    for each in verdict.claims:
        claim = finding_in_words(each.finding), each.verdict, each.class_size, each.probability
        yield (case.recording, number, case.name, verdict.drawn.strength, *claim)


def _claim_in_words(finding: ReportedFinding) -> str:
    """A claim with the probability of its name, and what else it may be."""
    words = finding_in_words(finding)
    if finding.probability is not None:
        words += f" ({finding.probability:.2f})"
    others = [each.effect.replace("_", " ") for each in finding.members if each.effect != finding.effect]
    return f"{words} or {', '.join(others)}" if others else words


def finding_in_words(finding: ReportedFinding) -> str:
    """A finding with its place, by number as the plan of the concealed effects."""
    place = "the whole robot"
    is_mistake = finding.effect in MISTAKE_NAMES and finding.effect not in EFFECT_IDS
    if finding.joints:
        kind = "link" if not is_mistake and effect_named(finding.effect).where == "link" else "joint"
        place = f"{kind} {' from joint '.join(map(str, finding.joints[:2]))}"
    words = MISTAKE_NAMES[finding.effect] if is_mistake else effect_in_words(finding.effect)
    return f"{words}, {place}"


def list_findings(findings: Sequence[ReportedFinding]) -> str:
    """Findings in a cell."""
    return "; ".join(finding_in_words(each) for each in findings) or "–"
