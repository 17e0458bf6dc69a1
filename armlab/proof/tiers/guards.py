"""The value of each guard of the diagnosis: the same concealed cases with one guard off, or one number changed."""

import json
import shutil
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from joblib import Parallel, delayed

from armlab.common.files import write_texts
from armlab.common.markdown import markdown_page, markdown_table
from armlab.proof.blind.score.measures import MEASURE_TEXTS
from armlab.proof.blind.score.scoring import compute_score
from armlab.proof.blind.sealed import FINISHED_MARK
from armlab.proof.tiers.torque import TORQUE, torque_sets

DONE_FOLDER = "done"  # beside the verdicts: an empty file for each finished case
GUARD_ORDER_FILE = "guards.txt"  # beside the verdicts: the guards in their order
REPORT_INTERVAL = 10  # cases between two lines of progress
SHOWN_MEASURES = (
    "false_claims_on_nulls",
    "false_claims_on_decoys",
    "wrong_names",
    "right_name_or_class",
    "unknown_outside",
)
DiagnoseWithGuards = Callable[[Path], dict[str, dict[str, Any]]]


@dataclass(frozen=True)
class AblationSettings:
    """A development seed, the number of its mixed cases and of its nulls, and changes like `noise.max_order=8`."""

    seed: int
    cases: int
    nulls: int
    changes: tuple[str, ...] = ()


def ablate(
    settings: AblationSettings, diagnose: DiagnoseWithGuards, work: Path, results: Path, jobs: int
) -> Iterator[str]:
    """Diagnoses development sets with each guard off, and writes guards.md and guards.json into `results`.

    Yields lines that report the progress. diagnose: from a recording folder, verdicts by the name of the guard that is
    off, then by the change; the verdict with all guards on comes first. An interrupted ablation continues; a finished
    one starts again.
    """
    if (work / FINISHED_MARK).is_file():
        shutil.rmtree(work)
    found: dict[str, dict[str, Any]] = {}
    for name, each in torque_sets(settings.seed, settings.cases, settings.nulls).items():
        folder, verdicts = work / name, work / "verdicts" / name
        list(TORQUE.conceal(each, folder, jobs))
        sealed = TORQUE.seal(each, folder)
        cases = [plan.name for plan in each.plans()]
        missing = [case for case in cases if not _is_done(case, settings.changes, verdicts)]
        todo = (delayed(_write_verdicts)(diagnose, folder / "observations" / case, verdicts) for case in missing)
        for number, _ in enumerate(Parallel(n_jobs=jobs, return_as="generator_unordered")(todo), 1):
            if number % REPORT_INTERVAL == 0:
                yield f"{name}: diagnosed {number} of {len(missing)}"
        for guard in (verdicts / GUARD_ORDER_FILE).read_text(encoding="utf-8").splitlines():
            score = compute_score(folder, verdicts / guard, sealed)[2]
            found.setdefault(guard, {})[name] = score["tiers"]
    write_texts({"guards.json": json.dumps(found, indent=1) + "\n", "guards.md": render_page(settings, found)}, results)
    (work / FINISHED_MARK).touch()
    yield f"wrote {results / 'guards.md'}"


def _is_done(case: str, changes: Sequence[str], verdicts: Path) -> bool:
    """Whether a case has its verdicts, those of all changes too, which may differ from an interrupted ablation's."""
    changed = (verdicts / change / case / "verdict.json" for change in changes)
    return (verdicts / DONE_FOLDER / case).is_file() and all(each.is_file() for each in changed)


def _write_verdicts(diagnose: DiagnoseWithGuards, observation: Path, verdicts: Path) -> None:
    """Writes the verdicts of a case, one folder a guard. The mark that the case is done comes last."""
    found = diagnose(observation)
    for guard, verdict in found.items():
        own = verdicts / guard / observation.name
        own.mkdir(parents=True, exist_ok=True)
        (own / "verdict.json").write_text(json.dumps(verdict) + "\n", encoding="utf-8")
    (verdicts / GUARD_ORDER_FILE).write_text("\n".join(found) + "\n", encoding="utf-8")
    (verdicts / DONE_FOLDER).mkdir(exist_ok=True)
    (verdicts / DONE_FOLDER / observation.name).touch()


def render_page(settings: AblationSettings, found: dict[str, dict[str, Any]]) -> str:
    """One table a tier, with one row for each guard that was off."""
    tiers = sorted({tier for sets in found.values() for each in sets.values() for tier in each})
    about = f"{settings.cases} cases and {settings.nulls} with nothing hidden, of development seed {settings.seed}."
    first = "guard off, or number changed" if settings.changes else "guard off"
    headings = (first, *(MEASURE_TEXTS[id].title for id in SHOWN_MEASURES))
    parts = [f"{about} Share, and how often it was counted."]
    for tier in tiers:
        rows = [_table_row(guard, found[guard], tier) for guard in found]
        parts += [f"## {tier} tier", markdown_table(headings, rows)]
    return markdown_page("What each guard is worth", *parts)


def _table_row(guard: str, sets: dict[str, Any], tier: str) -> tuple[str, ...]:
    name = f"`{guard}`" if "=" in guard else guard.replace("_", " ")
    return name, *(_table_cell(id, sets, tier) for id in SHOWN_MEASURES)


def _table_cell(id: str, sets: dict[str, Any], tier: str) -> str:
    """The measure in the set with the largest count: nulls in the set of nulls, names in the mixed set."""
    counted: Sequence[dict[str, Any]] = [
        each for found in sets.values() for each in found.get(tier, []) if each["id"] == id
    ]
    best = max(counted, key=lambda each: int(each["number"]), default=None)
    return "-" if best is None or best["value"] is None else f"{best['value']:.3g} of {best['number']}"
