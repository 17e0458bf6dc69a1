"""The setup tier: recordings with mistakes of reading, and with none."""

import json
import shutil
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from armlab.proof.blind.case_files import write_observation
from armlab.proof.blind.sealed import OBSERVATION, TRUTH_FILE, Score, SealedTier
from armlab.proof.blind.setup.mistakes import Injected, inject
from armlab.proof.blind.setup.setup_oracle import is_seen
from armlab.proof.blind.setup.setup_plan import PUBLIC, SetupCase, draw_cases, draw_mistakes, local_folder
from armlab.proof.blind.setup.setup_score import score_setup
from armlab.proof.blind.simulate import arm_with_effects
from armlab.proof.blind.sizing import simulate_case
from armlab.recordings.load import load_recording
from armlab.recordings.public import open_public_recording


@dataclass(frozen=True)
class SetupSet:
    """How many cases of each source, from a seed; seeds 1000-1999 are for development.

    folders: recordings of the local copies that stand beside the public ones.
    """

    simulated: int
    real: int
    nulls: int
    seed: int
    folders: tuple[str, ...] = ()

    def plans(self) -> Iterator[SetupCase]:
        """The plans of all cases."""
        return draw_cases(self.seed, self.simulated, self.real, self.nulls, self.folders)


def _make(case: SetupCase, draft: Path) -> None:
    right, wrong, public = draft / "right", draft / OBSERVATION, draft / "public"
    true_arm, physics = None, list[list[Any]]()
    if case.recording and case.recording not in PUBLIC:
        shutil.copytree(local_folder(case.recording), right)
    elif case.recording:
        open_public_recording(case.recording, public)
        shutil.copytree(public / case.recording, right)
        shutil.rmtree(public)
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
        together = is_seen(right, wrong)
        seen = [together and _is_seen_alone(right, draft, mistakes, place) for place in range(len(mistakes))]
    truth = {**asdict(case), "mistakes": [asdict(each) for each in mistakes], "seen": seen, "physics": physics}
    truth["arm_joints"] = len(arm)
    (draft / TRUTH_FILE).write_text(json.dumps(truth, indent=1) + "\n", encoding="utf-8")


def _question(case: SetupCase, observation: Path) -> list[str]:
    """A diagnosis; where no physics is hidden that would judge it, of the reading alone."""
    return ["diagnose", str(observation), *([] if case.has_physics else ["--only-setup"])]


def _judge(settings: SetupSet, work: Path, results: Path) -> Score:
    names = [plan.name for plan in settings.plans()]
    score = score_setup(work, names, results)
    return Score(list(score.lines), len(names), {"setup": [each.entry for each in score.shares]})


SETUP = SealedTier("setup", SetupSet.plans, _make, _question, _judge)


def _is_seen_alone(right: Path, draft: Path, mistakes: tuple[Injected, ...], place: int) -> bool:
    """Whether a mistake alone can be seen."""
    alone = draft / f"alone-{place}"
    shutil.copytree(right, alone)
    inject(alone, (mistakes[place],))
    seen = is_seen(right, alone)
    shutil.rmtree(alone)
    return seen
