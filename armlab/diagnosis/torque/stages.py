"""How a name gets claimed: the stages of a diagnosis in their order, each from a belief to a belief.

A search comes first: links and usual friction are fitted, what they leave is scanned for candidates, and the set of
effects with the best score is searched, round by round with better noise and shapes (`search_effects`). Then come the
stages of `BY_TESTS` (`find_names`) and of `BY_PROBABILITY`. `conclude.py` makes findings of what is believed then: each
is told by its name, as a class of names, or as unknown, by its probability (`named_claims` in `names/decide.py`).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from armlab.diagnosis.torque.belief import Belief
from armlab.diagnosis.torque.columns.design import DesignMatrix
from armlab.diagnosis.torque.columns.solver import State
from armlab.diagnosis.torque.evidence.added_body import possible_links, with_possible_bodies
from armlab.diagnosis.torque.evidence.friction_curves import name_friction_curves
from armlab.diagnosis.torque.evidence.plausibility import unclaim_implausible
from armlab.diagnosis.torque.evidence.pruning import prefer_one_body, prune, scan_what_is_left
from armlab.diagnosis.torque.evidence.unknown import with_what_is_left
from armlab.diagnosis.torque.names.expected_parts import claim_expected_parts
from armlab.diagnosis.torque.names.likeliest_names import with_likeliest_names
from armlab.diagnosis.torque.predict.prediction import fit_prediction
from armlab.diagnosis.torque.search.fitted_model import Progress, fit_background, search_effects
from armlab.effects.library import library


@dataclass(frozen=True)
class Stage:
    """A step of a diagnosis. sentence: what it does; message: what a waiting user is told, where that changes."""

    run: Callable[[Belief], Belief]
    sentence: str
    message: str = ""

    @property
    def name(self) -> str:
        """Of its function, as in the log."""
        return self.run.__name__


def choose_prediction(belief: Belief) -> Belief:
    """The belief with the model that predicts, whose bodies can exist. What no claim holds has to help there."""
    model, claimed = belief.model, (each for each in belief.model.state.groups if each not in belief.present)
    named = replace(model, state=State(tuple(claimed), model.state.widths))
    return replace(belief, prediction=with_possible_bodies(fit_prediction(named)))


BY_TESTS = (
    Stage(
        prune,
        "The weakest effect that fails a test (`first_failed_test`) leaves until all pass; the search looks again.",
        "testing claims",
    ),
    Stage(scan_what_is_left, "What passes is taken off, and scans look for gaps, pushes and waves in the rest."),
    Stage(prefer_one_body, "One body that can exist replaces loose masses; bodies that cannot exist leave."),
    Stage(with_what_is_left, "What is left at each joint is searched for structure, which speaks against names there."),
    Stage(name_friction_curves, "Structure that depends on the velocity of its joint alone is a curve of friction."),
    Stage(possible_links, "Links that are off keep a name only if they are bodies with these numbers."),
)
BY_PROBABILITY = (
    Stage(
        with_likeliest_names,
        "Each effect takes the likeliest name of its finding, by learnt weights.",
        "weighing names",
    ),
    Stage(
        choose_prediction,
        "The model that predicts is chosen on blocks of the runs that identify: names, and what is only present.",
        "fitting the model that predicts",
    ),
    Stage(
        unclaim_implausible,
        "Names with numbers that nobody believes stay in the model without a claim.",
        "stating numbers",
    ),
    Stage(claim_expected_parts, "Friction and offsets that the prediction needs, and no claim holds, are claimed."),
)


def find_names(design: DesignMatrix, seed: int, progress: Progress) -> Belief:
    """The names that hold of what a search finds. seed: of the surrogates' random waves."""
    searched = search_effects(fit_background(design, library(), seed, progress), progress)
    return run_stages(BY_TESTS, Belief(searched), progress)


def run_stages(stages: Sequence[Stage], belief: Belief, progress: Progress) -> Belief:
    """A belief after some stages."""
    for stage in stages:
        if stage.message:
            progress(stage.message)
        known = len(belief.model.steps)
        belief = stage.run(belief)
        steps = belief.model.steps
        if len(steps) > known:
            own = (replace(each, stage=stage.name) for each in steps[known:])
            belief = replace(belief, model=replace(belief.model, steps=(*steps[:known], *own)))
    return belief
