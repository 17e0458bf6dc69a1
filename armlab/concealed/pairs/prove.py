"""The proof of a comparison: make pairs, seal the answers, compare each pair in a process of its own, and score.

An interrupted proof continues in its folder.
"""

import hashlib
import json
import shutil
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

from joblib import Parallel, delayed

from armlab.common.errors import InputError
from armlab.concealed.pairs.make import SIDES, make_pair, write_pair
from armlab.concealed.pairs.plan import PairPlan, draw_pair
from armlab.concealed.pairs.score import score_lines, score_pairs
from armlab.concealed.plan import DEVELOPMENT_SEEDS
from armlab.concealed.prove import answer, is_answered, report_progress
from armlab.concealed.sets import TIERS

SETTINGS_FILE = "settings.json"


@dataclass(frozen=True)
class PairSet:
    """How many pairs with nothing changed and with one thing changed, from a seed.

    Seeds 1000-1999 are for development: they leave out the kinds of noise that are kept for judged sets.
    """

    nulls: int
    changed: int
    seed: int

    def plans(self) -> Iterator[PairPlan]:
        """The plans of all pairs; tiers in turn, so that each kind of change comes in both."""
        development = self.seed in DEVELOPMENT_SEEDS
        for number in range(self.nulls):
            yield draw_pair(self.seed, number, TIERS[number % 2], False, development)
        for number in range(self.changed):
            yield draw_pair(self.seed, number, TIERS[number // 4 % 2], True, development)


def prove_pairs(settings: PairSet, work: Path, results: Path, jobs: int) -> Iterator[str]:
    """Makes, seals, compares and scores; yields the lines that report it. InputError for a folder of another set."""
    _claim_folder(settings, work)
    plans = list(settings.plans())
    missing = [plan for plan in plans if not (work / "observations" / plan.name).is_dir()]
    made = Parallel(n_jobs=jobs, return_as="generator_unordered")(delayed(_make)(plan, work) for plan in missing)
    yield from report_progress("made", made, max(len(missing), 1))
    yield f"answers SHA-256 {digest_of_answers(work / 'truth')}"
    names = [plan.name for plan in plans]
    waiting = [name for name in names if not is_answered(work / "verdicts" / name)]
    tasks = (delayed(_compare)(work, name) for name in waiting)
    done = Parallel(n_jobs=jobs, backend="threading", return_as="generator_unordered")(tasks)
    yield from report_progress("compared", done, max(len(waiting), 1))
    yield from score_lines(score_pairs(work, names, results))


def _claim_folder(settings: PairSet, work: Path) -> None:
    content = json.dumps(asdict(settings), indent=1) + "\n"
    note = work / SETTINGS_FILE
    if note.is_file() and note.read_text(encoding="utf-8") != content:
        raise InputError(f"{work} holds other pairs (see {note}): choose another folder")
    work.mkdir(parents=True, exist_ok=True)
    note.write_text(content, encoding="utf-8")


def _make(plan: PairPlan, work: Path) -> str:
    """Makes one pair in a draft folder. Its observation is moved last and marks the pair as complete."""
    draft = work / "drafts" / plan.name
    shutil.rmtree(draft, ignore_errors=True)
    write_pair(make_pair(plan), draft / "observation", draft / "truth.json")
    for part in ("truth", "observations"):
        (work / part).mkdir(parents=True, exist_ok=True)
    (draft / "truth.json").replace(work / "truth" / f"{plan.name}.json")
    (draft / "observation").replace(work / "observations" / plan.name)
    shutil.rmtree(draft)
    return plan.name


def digest_of_answers(truth: Path) -> str:
    """SHA-256 of all answers."""
    out = hashlib.sha256()
    for path in sorted(truth.glob("*.json")):
        out.update(path.name.encode() + path.read_bytes())
    return out.hexdigest()


def _compare(work: Path, name: str) -> str:
    old, new = (str((work / "observations" / name / side).resolve()) for side in SIDES)
    answer(["diagnose", "--compare", old, new], work / "verdicts" / name)
    return name
