"""One public recording identified: choose inside the identification data, then fit. Runs that validate stay unseen.

A recipe is what is given to this procedure for each recording before it looks at any data.
"""

import time
from dataclasses import dataclass, field

import numpy as np

from armlab.effects.contract import Candidate
from armlab.identification.identifier import Identifier
from armlab.identification.priors import Pull
from armlab.identification.selection import (
    NOMINAL_TOLERANCES,
    USUAL_GROUPS,
    Choice,
    Groups,
    Selection,
    candidate_groups,
    candidate_pulls,
    components_of,
    counterbalance_groups,
    describe_choice,
    select_structure,
)
from armlab.recordings.recording import Recording
from problem.arm import Arm

KUKA_FLANGE = (0.0, 0.0, 0.1)  # m in link 6: where the payload of the recordings sits, by their source


@dataclass(frozen=True)
class Recipe:
    """starts: groups from which the search begins. physical: only bodies that can exist, near the CAD model.
    counterbalanced: the joint that is known to have a counterbalance.

    best_known: the figures to beat, percent for each validation run.
    """

    name: str
    best_known: dict[str, float] = field(default_factory=dict)
    starts: tuple[tuple[str, ...], ...] = (USUAL_GROUPS,)
    physical: bool = False
    payload: tuple[float, float, float] | None = None
    counterbalanced: int | None = None

    def groups(self, arm: Arm) -> Groups:
        """Components to choose from."""
        usual = candidate_groups(arm)
        return usual if self.counterbalanced is None else usual | counterbalance_groups(arm, self.counterbalanced)

    def pulls(self, arm: Arm) -> tuple[Pull, ...]:
        """Priors to choose from."""
        if self.physical:
            return tuple(Pull("nominal", size, self.payload) for size in NOMINAL_TOLERANCES)
        return candidate_pulls(arm, self.payload)


RECIPES = (
    Recipe("emps", {"pulses.csv": 5.3}),
    Recipe("staubli-tx40", {"validate.csv": 7.1}),
    Recipe("unisa-ur10", {"validate.csv": 13.3}),
    Recipe("unisa-panda", {"validate.csv": 3.3}),
    Recipe(
        "kuka-kr300",
        {"run_B.csv": 13.6, "run_C.csv": 13.9},
        # its data sheet names a hydropneumatic counterbalance on axis 2
        (USUAL_GROUPS, ("viscous", "coulomb", "rotor", "spring"), ("viscous", "coulomb", "rotor", "crank")),
        physical=True,
        payload=KUKA_FLANGE,
        counterbalanced=2,
    ),
    Recipe("friction-damper-20-lb", {"run-0p5-hz.csv": 60}),
    Recipe("friction-damper-25-lb", {"run-0p5-hz.csv": 63}),
    Recipe("friction-damper-35-lb", {"run-0p5-hz.csv": 62}),
    Recipe("friction-damper-80-lb", {"run-0p5-hz.csv": 66}),
)


@dataclass(frozen=True, eq=False)
class Study:
    """What is identified of one recording.

    models: `rigid`; `friction`, which is viscous and Coulomb friction, rotor inertia and offset at every joint; and
    `chosen`. seconds: of the choice and its fit.
    """

    recipe: Recipe
    recording: Recording
    selection: Selection
    models: dict[str, Identifier]
    seconds: float

    @property
    def chosen(self) -> Identifier:
        """The identification with everything that was chosen."""
        return self.models["chosen"]


def recipe_named(name: str) -> Recipe:
    """The recipe of a recording; one of which nothing is known beforehand has the usual one."""
    return next((each for each in RECIPES if each.name == name), Recipe(name))


def study_recording(recipe: Recipe, recording: Recording) -> Study:
    """Identifies a recording from the runs that identify."""
    runs = recording.with_role("identify")
    groups = recipe.groups(recording.arm)
    started = time.perf_counter()
    selection = select_structure(recording.arm, runs, groups, recipe.pulls(recording.arm), recipe.starts)
    choice = selection.choice
    filters = choice.cutoff_hz, recording.robot, choice.position_factor
    components = components_of(groups, choice.groups)
    method = _choose_method(recipe, recording, choice, components)
    chosen = Identifier(recording.arm, components, method, choice.pull, *filters).fit(runs)
    seconds = time.perf_counter() - started
    usual = components_of(groups, USUAL_GROUPS)
    plain = {
        name: Identifier(recording.arm, parts, "ordinary", Pull(), *filters).fit(runs)
        for name, parts in (("rigid", ()), ("friction", usual))
    }
    return Study(recipe, recording, selection, {**plain, "chosen": chosen}, seconds)


def _choose_method(recipe: Recipe, recording: Recording, choice: Choice, components: tuple[Candidate, ...]) -> str:
    """Physically consistent, or free of that: what predicts held-out blocks of the identification data better."""
    free = "weighted" if choice.by_joint else "alike"
    runs = recording.with_role("identify")
    ways = ("physical",) if recipe.physical else ("physical", free)
    filters = choice.cutoff_hz, None, choice.position_factor
    tried = [Identifier(recording.arm, components, way, choice.pull, *filters) for way in ways]
    fitted = tried[0].prepare(runs)
    return min(tried, key=lambda each: float(np.linalg.norm(each.held_out_errors(fitted)))).method


def describe_study(study: Study) -> str:
    """The choice in a line."""
    choice = study.selection.choice
    method = study.chosen.method
    return f"{study.recipe.name}: {describe_choice(choice)}; {method}; held-out error {100 * choice.held_out:.2f} %"
