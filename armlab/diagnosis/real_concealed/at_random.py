"""Random cases of public recordings: identify, draw, conceal, diagnose and judge; the tables of what came out.

`armlab prove --tier real` scores the tables, and `armlab calibrate --real` learns from the names that were weighed. All
outcomes are stored, so that an interrupted command continues.
"""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import pandas as pd
from joblib import Parallel, delayed

from armlab.common.errors import InputError
from armlab.common.files import write_texts
from armlab.common.settings import suggest_name
from armlab.diagnosis.real_concealed.claims import DrawnVerdict, judge_drawn
from armlab.diagnosis.real_concealed.conceal import Reference, identify_reference
from armlab.diagnosis.real_concealed.draw import DrawnCase, draw_cases
from armlab.diagnosis.real_concealed.examine import (
    Outcome,
    OutcomeStore,
    ReportedFinding,
    examine_stored,
    open_outcomes,
    sought_in_case,
)
from armlab.diagnosis.real_concealed.labels import LabelledFinding, label_weighed
from armlab.diagnosis.real_concealed.plan import Case
from armlab.diagnosis.real_concealed.report import OUTCOMES_FOLDER, finding_in_words, list_findings
from armlab.identification.real.looks import LOOKS_FILE, Looks
from armlab.identification.real.study import recipe_named
from armlab.recordings.public import open_public_recording

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
    """Which recordings, how many cases of each, and the seed. Seeds 1000-1999 are for development."""

    recordings: tuple[str, ...]
    cases: int
    seed: int

    def __post_init__(self) -> None:
        """Raises InputError for an unknown recording."""
        for name in self.recordings:
            if name not in REAL_ARMS:
                raise InputError(f"unknown recording '{name}': {suggest_name(name, list(REAL_ARMS))}")


@dataclass(frozen=True, eq=False)
class RandomStudy:
    """A recording with its control and the verdicts on its random cases. description: of the reference model.

    labelled: the findings of each case that were weighed.
    """

    name: str
    description: str
    control: Outcome
    verdicts: tuple[DrawnVerdict, ...]
    labelled: tuple[tuple[LabelledFinding, ...], ...]


def conceal_at_random(
    settings: RandomCases,
    recordings: Path,
    results: Path,
    out: Path,
    jobs: int,
    progress: Callable[[str], None] = lambda message: None,
) -> Iterator[str]:
    """Lines that tell what is done and written.

    recordings: folder of the recordings, which are fetched into it. results: folder of the log of looks. out: folder of
    the tables. What was diagnosed before an interruption is not diagnosed again.
    """
    drawn = dict[str, tuple[DrawnCase, ...]]()
    references = dict[str, Reference]()
    for name in settings.recordings:
        progress(f"{name}: the reference model")
        references[name] = identify_reference(open_public_recording(name, recordings), recipe_named(name))
        drawn[name] = draw_cases(references[name], settings.seed, settings.cases)
        yield f"{name}: reference {references[name].description}"
    tasks = [(references[name], case) for name in drawn for case in (Case(name), *(each.case for each in drawn[name]))]
    stored, looks = open_outcomes(recordings / OUTCOMES_FOLDER), Looks(results / LOOKS_FILE)
    outcomes = dict[Case, Outcome]()
    examined = Parallel(n_jobs=jobs, return_as="generator_unordered")(
        delayed(_examine)(*task, stored, looks) for task in tasks
    )
    for number, (case, outcome) in enumerate(examined, 1):
        outcomes[case] = outcome
        yield f"  diagnosed {number} of {len(tasks)}: {case.recording}, {case.name}"
    studies = list[RandomStudy]()
    for name, reference in references.items():
        control = outcomes[Case(name)]
        if control.refused:
            yield f"{name} is left out: with nothing concealed it is not diagnosed: {control.refused}"
        else:
            studies.append(_judge(reference, drawn[name], outcomes, control))
    texts = random_tables(studies) | {WEIGHED_FILE: weighed_text(settings, studies)}
    yield from (f"wrote {path}" for path in write_texts(texts, out))


def _examine(reference: Reference, case: Case, stored: OutcomeStore, looks: Looks) -> tuple[Case, Outcome]:
    return case, examine_stored(reference, case, stored, looks, lambda message: None)


def _judge(
    reference: Reference, drawn: Sequence[DrawnCase], outcomes: Mapping[Case, Outcome], control: Outcome
) -> RandomStudy:
    name, joints = reference.recording.name, len(reference.recording.arm)
    cases = [(each, outcomes[each.case], sought_in_case(reference, each.case)) for each in drawn]
    verdicts = (judge_drawn(*each, control, joints) for each in cases)
    labelled = (tuple(label_weighed(outcome, wanted, control, joints)) for _, outcome, wanted in cases)
    return RandomStudy(name, reference.description, control, tuple(verdicts), tuple(labelled))


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
