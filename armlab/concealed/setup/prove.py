"""The proof: make the cases, seal the answers, diagnose each in a process of its own, and score.

An interrupted proof continues in its folder.
"""

import json
import shutil
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from joblib import Parallel, delayed

from armlab.common.errors import DataError, InputError
from armlab.concealed.case_files import write_observation
from armlab.concealed.pairs.prove import SETTINGS_FILE, digest_of_answers
from armlab.concealed.prove import answer, is_answered, report_progress
from armlab.concealed.setup.mistakes import Injected, inject
from armlab.concealed.setup.oracle import can_be_seen
from armlab.concealed.setup.plan import SetupCase, draw_cases, draw_mistakes
from armlab.concealed.setup.score import score_lines, score_setup
from armlab.concealed.simulate import arm_with_effects
from armlab.concealed.sizing import simulate_case
from armlab.recordings.load import load_recording
from armlab.recordings.public import open_public_recording


@dataclass(frozen=True)
class SetupSet:
    """How many cases of each source, from a seed; seeds 1000-1999 are for development.

    only_setup: nothing is asked but how the recording is to be read.
    """

    simulated: int
    real: int
    nulls: int
    seed: int
    only_setup: bool = False


def prove_setup(settings: SetupSet, work: Path, results: Path, jobs: int) -> Iterator[str]:
    """Makes, seals, diagnoses and scores; yields the lines that report it. InputError for a folder of another set."""
    _claim_folder(settings, work)
    cases = list(draw_cases(settings.seed, settings.simulated, settings.real, settings.nulls))
    missing = [case for case in cases if not (work / "observations" / case.name).is_dir()]
    made = Parallel(n_jobs=jobs, return_as="generator_unordered")(delayed(_make)(case, work) for case in missing)
    yield from report_progress("made", made, max(len(missing), 1))
    yield f"answers SHA-256 {digest_of_answers(work / 'truth')}"
    names = [case.name for case in cases]
    waiting = [name for name in names if not is_answered(work / "verdicts" / name)]
    tasks = (delayed(_diagnose)(work, name, settings.only_setup) for name in waiting)
    done = Parallel(n_jobs=jobs, backend="threading", return_as="generator_unordered")(tasks)
    yield from report_progress("diagnosed", done, max(len(waiting), 1))
    yield from score_lines(score_setup(work, names, results))


def _claim_folder(settings: SetupSet, work: Path) -> None:
    content = json.dumps(asdict(settings), indent=1) + "\n"
    note = work / SETTINGS_FILE
    if note.is_file() and note.read_text(encoding="utf-8") != content:
        raise InputError(f"{work} holds another set (see {note}): choose another folder")
    work.mkdir(parents=True, exist_ok=True)
    note.write_text(content, encoding="utf-8")


def _make(case: SetupCase, work: Path) -> str:
    """Makes one case in a draft folder. Its observation is moved last and marks the case as complete."""
    draft = work / "drafts" / case.name
    shutil.rmtree(draft, ignore_errors=True)
    draft.mkdir(parents=True)
    right, wrong = draft / "right", draft / "observation"
    true_arm, physics = None, list[list[Any]]()
    if case.recording:
        open_public_recording(case.recording, work / "public" / case.name)
        shutil.copytree(work / "public" / case.name / case.recording, right)
        shutil.rmtree(work / "public" / case.name)
    else:
        simulated = simulate_case(case.plan())
        write_observation(simulated, right)
        true_arm = arm_with_effects(simulated.plan, simulated.hidden)
        physics += [[each.effect, each.place] for each in simulated.hidden]
    shutil.copytree(right, wrong)
    arm = load_recording(right).arm
    mistakes = draw_mistakes(case, arm)
    seen = []
    if mistakes:
        inject(wrong, mistakes, true_arm)
        seen = [_is_seen(right, draft, mistakes, place) for place in range(len(mistakes))]
    truth = {**asdict(case), "mistakes": [asdict(each) for each in mistakes], "seen": seen, "physics": physics}
    truth["arm_joints"] = len(arm)
    for part in ("truth", "observations"):
        (work / part).mkdir(parents=True, exist_ok=True)
    (work / "truth" / f"{case.name}.json").write_text(json.dumps(truth, indent=1) + "\n", encoding="utf-8")
    wrong.replace(work / "observations" / case.name)
    shutil.rmtree(draft)
    return case.name


def _is_seen(right: Path, draft: Path, mistakes: tuple[Injected, ...], place: int) -> bool:
    """Whether a mistake alone can be seen."""
    alone = draft / f"alone-{place}"
    shutil.copytree(right, alone)
    inject(alone, (mistakes[place],))
    try:
        return can_be_seen(load_recording(right), load_recording(alone))
    except (InputError, DataError):
        return True  # a recording that cannot even be read is seen to be wrong
    finally:
        shutil.rmtree(alone)


def _diagnose(work: Path, name: str, only_setup: bool) -> str:
    folder, options = (work / "observations" / name).resolve(), ["--only-setup"] if only_setup else []
    answer(["diagnose", str(folder), *options], work / "verdicts" / name)
    return name
