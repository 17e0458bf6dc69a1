"""How findings got their names: `steps.json`, all moves and tests; `names.json`, what each finding was weighed against;
and the answer to `--why EFFECT@JOINT`.
"""

import json
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Final, Literal

from armlab.common.errors import InputError
from armlab.common.report.wording import format_number
from armlab.diagnosis.result import Diagnosis, Member, Weighed
from armlab.diagnosis.settings import Settings
from armlab.diagnosis.torque.names.decide import with_probabilities
from armlab.diagnosis.torque.search.search import SMALLEST_GAIN, FailedTest, Step
from armlab.effects.contract import UNKNOWN
from armlab.effects.library import effect_named
from armlab.effects.words import at_place
from armlab.report.words import effect_in_words
from problem.arm import Arm

STEPS_SCHEMA: Final = "steps/1"
STEPS_FILE: Final = "steps.json"
NAMES_SCHEMA: Final = "names/1"
NAMES_FILE: Final = "names.json"
SEARCH: Final = "search"  # the stage before the others

Place = tuple[str, int | None]


def steps_texts(diagnosis: Diagnosis) -> dict[str, str]:
    """The file: all moves and tests in their order, and what the model of the names does not hold; none without any."""
    content = {
        "schema": STEPS_SCHEMA,
        "steps": [_step_entry(each) for each in diagnosis.steps],
        "not_taken": [
            {"effect": each.effect, "joint": each.joint, "log_evidence": each.gain, "objection": each.objection}
            for each in diagnosis.not_taken
        ],
    }
    return {STEPS_FILE: json.dumps(content, indent=1) + "\n"} if diagnosis.steps else {}


def _step_entry(step: Step) -> dict[str, Any]:
    failed = step.failed
    if failed is None:
        return {"stage": step.stage or SEARCH, "what": step.what, "score_before": step.before, "score": step.score}
    test = {"test": failed.test, "value": failed.value, "bound": failed.bound, "number": failed.number or None}
    return {"stage": step.stage, "what": step.what, **test, "has_to_be": "at least" if failed.at_least else "at most"}


Outcome = Literal["named", "class", "unknown", "not stated"]


@dataclass(frozen=True)
class WeighedOutcome:
    """What was weighed for a finding, and what came of it.

    outcome: named; class, where its name is one of several; unknown; or not stated, where it is no finding of its own.
    effect, joint: as the verdict states them, else of the name that the search took.
    """

    effect: str
    joint: int | None
    outcome: Outcome
    weighed: Weighed

    @classmethod
    def of_diagnosis(cls, diagnosis: Diagnosis) -> "Iterator[WeighedOutcome]":
        """All that was weighed, in the order of the diagnosis."""
        for weighed in diagnosis.weighed:
            claim = next((each for each in diagnosis.claims if each.weighed is weighed), None)
            if claim is None:
                yield cls(weighed[0].effect, weighed[0].joint, "not stated", weighed)
            else:
                outcome = outcome_of(claim.effect, claim.members)
                yield cls(claim.effect, claim.joint, outcome, weighed)


def outcome_of(effect: str, members: Sequence[Member]) -> Outcome:
    """Of a finding that is stated. members: of its class."""
    if effect == UNKNOWN.id:
        return "unknown"
    return "class" if members else "named"


def names_texts(findings: Iterable[WeighedOutcome], settings: Settings) -> dict[str, str]:
    """The file: of each finding what came of it, and its names, with what speaks for each and its probability.

    Nothing without findings.
    """
    entries = [
        {
            "effect": each.effect,
            "joint": each.joint,
            "outcome": each.outcome,
            "names": [
                {**asdict(name), "probability": chance} for name, chance in with_probabilities(each.weighed, settings)
            ],
        }
        for each in findings
    ]
    content = {"schema": NAMES_SCHEMA, "findings": entries}
    return {NAMES_FILE: json.dumps(content, indent=1) + "\n"} if entries else {}


def parse_place(text: str, arm: Arm) -> Place:
    """An effect and its joint or link, from 1, of `EFFECT@JOINT`, or of `EFFECT` for one of the whole robot.

    Raises InputError for an effect or a joint that there is not.
    """
    effect, _, joint = text.partition("@")
    try:
        effect_named(effect)
    except ValueError as error:
        raise InputError(f"--why {text}: {error}") from None
    if not joint:
        return effect, None
    if not joint.isdecimal() or not 1 <= int(joint) <= len(arm):
        raise InputError(f"--why {text}: a joint is one from 1 to {len(arm)}")
    return effect, int(joint)


def why_lines(diagnosis: Diagnosis, effect: str, joint: int | None) -> Iterator[str]:
    """Why an effect is a finding, or why it is none: the tests that it passed or failed, in their order."""
    name = at_place(diagnosis.simulation.arm, effect_in_words(effect), effect, joint)
    mentioned = [each for each in diagnosis.steps if _mentions(each, effect, joint)]
    yield f"why {name}: {_answer(diagnosis, mentioned, effect, joint)}"
    yield from (f"  {each.what}" for each in mentioned)


def _answer(diagnosis: Diagnosis, mentioned: list[Step], effect: str, joint: int | None) -> str:
    for number, claim in enumerate(diagnosis.claims, 1):
        if (claim.effect, claim.joint) == (effect, joint):
            return f"it is finding {number} of {len(diagnosis.claims)}"
    members = [claim for claim in diagnosis.claims if any(each.is_of(effect, joint) for each in claim.members)]
    if members:
        return f"it is one of the names of the finding {members[0].effect}: these data do not tell them apart"
    failed = next((each.failed for each in reversed(mentioned) if each.failed is not None), None)
    if failed is not None:
        return f"not named: {_test_in_words(failed)}"
    left = next((each for each in diagnosis.not_taken if (each.effect, each.joint) == (effect, joint)), None)
    if left is None:
        return "not named: no search looks for it there" if not mentioned else "in the model, without a claim"
    if left.objection is not None:
        return f"not named: {left.objection}"
    if left.gain <= SMALLEST_GAIN:
        return "not named: it would not raise the log evidence beside what is named"
    return f"not named: it would raise the log evidence by {format_number(left.gain)}, and did not last in the search"


def _test_in_words(failed: FailedTest) -> str:
    if failed.value is None or failed.bound is None:
        return failed.text
    bound = f"{'at least' if failed.at_least else 'at most'} {format_number(failed.bound)}"
    number = f" ({failed.number})" if failed.number else ""
    return f"{failed.test} is {format_number(failed.value)}, and has to be {bound}{number}"


def _mentions(step: Step, effect: str, joint: int | None) -> bool:
    where = "" if joint is None else f" {joint}"
    return re.search(rf"\b{effect}{where}(?!\w)", step.what) is not None
