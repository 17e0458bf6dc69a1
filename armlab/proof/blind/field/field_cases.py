"""The folders of a field case and its answer: observation and truth."""

import json
import shutil
from pathlib import Path

import numpy as np

from armlab.proof.blind.field.field_hidden import FieldEffect, draw_field_effect, hidden_names
from armlab.proof.blind.field.field_plan import FieldPlan
from armlab.proof.blind.field.field_runs import simulate_field
from armlab.proof.blind.field.field_sizes import draw_sized
from armlab.proof.blind.field.field_truth import FieldTruth, make_field_truth
from armlab.proof.blind.field.files import write_field_observation
from armlab.proof.blind.plan import random_stream
from armlab.proof.blind.setup.mistakes import EFFECTS, draw_mistake, inject
from armlab.proof.blind.setup.setup_oracle import is_seen
from armlab.recordings.load import load_recording

MISTAKE_DRAWS = 10


def make_field_case(plan: FieldPlan, observation: Path, truth: Path) -> FieldTruth:
    """Writes the observation and the answer of a plan; returns the answer."""
    answer = _make_mistake(plan, observation) if plan.kind == "mistake" else _make_single(plan, observation)
    truth.write_text(json.dumps(answer.model_dump(mode="json", by_alias=True), indent=1) + "\n", encoding="utf-8")
    return answer


def _make_single(plan: FieldPlan, observation: Path) -> FieldTruth:
    case = simulate_field(plan)
    if plan.kind == "null":
        write_field_observation(case, observation)
        return make_field_truth(case)

    def draw(rng: np.random.Generator, number: int) -> FieldEffect | None:
        return draw_field_effect(rng, plan, _cycled(plan, "effects", hidden_names(), number))

    effect, strength = draw_sized(plan, case, draw)
    write_field_observation(simulate_field(plan, (effect,), case.rest_factors), observation)
    return make_field_truth(case, hidden=(effect, strength))


def _make_mistake(plan: FieldPlan, observation: Path) -> FieldTruth:
    """A recording with one mistake that can be seen, if one of some draws can."""
    case = simulate_field(plan)
    right = observation.with_name("right")
    write_field_observation(case, right)
    recording, rng = load_recording(right), plan.stream("mistake")
    for number in range(MISTAKE_DRAWS):
        drawn = draw_mistake(rng, _cycled(plan, "mistakes", EFFECTS, number), recording.arm)
        if drawn is None:
            continue
        shutil.rmtree(observation, ignore_errors=True)
        shutil.copytree(right, observation)
        inject(observation, (drawn,), case.arm)
        made, seen = drawn, is_seen(right, observation)
        if seen:
            break
    shutil.rmtree(right)
    return make_field_truth(case, mistakes=((made, seen),))


def _cycled(plan: FieldPlan, what: str, names: tuple[str, ...], attempt: int) -> str:
    """Each name comes once in a set before any comes twice; another one at a further attempt."""
    order: list[int] = random_stream("field order", what, plan.seed).permutation(len(names)).tolist()
    return names[order[(plan.index + 5 * attempt) % len(names)]]
