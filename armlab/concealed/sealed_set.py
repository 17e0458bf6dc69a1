"""A set of concealed cases: made in drafts, sealed by a digest, and answered one by one, each in a process of its own.

An interrupted set continues in its folder.
"""

import hashlib
import re
import shutil
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, Protocol, TypeVar

from joblib import Parallel, delayed

from armlab.common.errors import InputError
from armlab.common.statistics import wilson_interval
from armlab.concealed.folders import claim_folder
from armlab.concealed.log_page import LOG_FILE
from armlab.concealed.plan import DEVELOPMENT_SEEDS
from armlab.concealed.prove import (
    FINISHED_MARK,
    answer,
    append_to_log,
    code_commit,
    is_answered,
    judged_seed,
    report_progress,
)

OBSERVATION = "observation"  # in a draft, what the program sees
TRUTH_FILE = "truth.json"  # in a draft, the answer


class Named(Protocol):
    """A plan of a case: it can be sent to another process, and has a name of its own."""

    @property
    def name(self) -> str:
        """Of its files."""


Plan = TypeVar("Plan", bound=Named)


@dataclass(frozen=True)
class SetMaker(Generic[Plan]):
    """How a set is made and asked. make: writes OBSERVATION and TRUTH_FILE of a plan into a draft folder.

    question: arguments of the command that answers a plan, whose observation is in a folder. done: what is said
    of a case then.
    """

    make: Callable[[Plan, Path], None]
    question: Callable[[Plan, Path], list[str]]
    done: str

    def prove(self, settings: Any, plans: Sequence[Plan], work: Path, jobs: int) -> Iterator[str]:
        """Makes, seals and asks what is not done in a folder; yields the lines that report it.

        settings: a dataclass that tells sets apart. InputError for a folder of another set.
        """
        claim_folder(settings, work)
        missing = [plan for plan in plans if not (work / "observations" / plan.name).is_dir()]
        made = Parallel(n_jobs=jobs, return_as="generator_unordered")(
            delayed(_make)(self.make, plan, work) for plan in missing
        )
        yield from report_progress("made", made, max(len(missing), 1))
        yield f"answers SHA-256 {digest_of_answers(work)}"
        waiting = [plan for plan in plans if not is_answered(work / "verdicts" / plan.name)]
        tasks = (delayed(self._ask)(plan, work) for plan in waiting)
        asked = Parallel(n_jobs=jobs, backend="threading", return_as="generator_unordered")(tasks)
        yield from report_progress(self.done, asked, max(len(waiting), 1))

    def _ask(self, plan: Plan, work: Path) -> str:
        answer(self.question(plan, (work / "observations" / plan.name).resolve()), work / "verdicts" / plan.name)
        return plan.name


def _make(make: Callable[[Plan, Path], None], plan: Plan, work: Path) -> str:
    """Makes one case in a draft folder. Its observation is moved last and marks the case as complete."""
    draft = work / "drafts" / plan.name
    shutil.rmtree(draft, ignore_errors=True)
    draft.mkdir(parents=True)
    make(plan, draft)
    for part in ("truth", "observations"):
        (work / part).mkdir(parents=True, exist_ok=True)
    (draft / TRUTH_FILE).replace(work / "truth" / f"{plan.name}.json")
    (draft / OBSERVATION).replace(work / "observations" / plan.name)
    shutil.rmtree(draft)
    return plan.name


def digest_of_answers(work: Path) -> str:
    """SHA-256 of all answers of the set in a folder."""
    out = hashlib.sha256()
    for path in sorted((work / "truth").glob("*.json")):
        out.update(path.name.encode() + path.read_bytes())
    return out.hexdigest()


@dataclass(frozen=True)
class Share:
    """A share with its 95 % interval (Wilson 1927)."""

    name: str
    hits: int
    number: int

    @property
    def interval(self) -> tuple[float, float]:
        """Of the share."""
        return wilson_interval(self.hits, self.number)

    @property
    def text(self) -> str:
        """Share, interval and counts."""
        low, high = self.interval
        share = f"{self.hits / self.number:.1%}" if self.number else "-"
        return f"{share} ({low:.1%} to {high:.1%}), {self.hits} of {self.number}"

    @property
    def entry(self) -> dict[str, Any]:
        """As the log of judged runs has it: id, value with its interval, number of cases."""
        low, high = self.interval
        value = self.hits / self.number if self.number else None
        name = re.sub(r"[^a-z0-9]+", "_", self.name.lower()).strip("_")
        return {"id": name, "value": value, "low": low, "high": high, "number": self.number}


JUDGED_LOG = Path(__file__).resolve().parents[2] / "results" / "proof" / LOG_FILE  # of all judged runs


def log_judged_set(name: str, seed: int, cases: int, work: Path, shares: Sequence[Share]) -> None:
    """Adds a judged set, whose seed follows from the commit, to the log, once; other sets are not judged."""
    if seed in DEVELOPMENT_SEEDS or (work / FINISHED_MARK).is_file():
        return
    try:
        commit = code_commit()
    except InputError:  # no git checkout
        return
    if seed != judged_seed(commit):
        return
    score = {"seed": seed, "cases": cases, "manifest": digest_of_answers(work)}
    append_to_log(JUDGED_LOG, commit, name, {**score, "tiers": {name: [each.entry for each in shares]}})
    (work / FINISHED_MARK).touch()
