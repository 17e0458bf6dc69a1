"""One public recording from raw file to errors: choose inside the identification data, fit, then look.

A recipe is what is given to this procedure for each recording before it looks at any data.
"""

from dataclasses import dataclass
from pathlib import Path

from armlab.effects.contract import Candidate
from armlab.identification.identifier import Identifier
from armlab.identification.priors import Pull
from armlab.identification.real.looks import Looks
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
from armlab.identification.validation import RunError, run_error
from armlab.recordings.load import load_recording
from armlab.recordings.public import fetch_recording
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
    best_known: dict[str, float]
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
)


@dataclass(frozen=True, eq=False)
class JudgedModel:
    """A model of a recording under its name, with its errors on every run."""

    name: str
    identifier: Identifier
    errors: tuple[RunError, ...]


@dataclass(frozen=True, eq=False)
class Study:
    """What is shown of one recording: the models, from the rigid arm to the chosen one."""

    recipe: Recipe
    recording: Recording
    selection: Selection
    models: tuple[JudgedModel, ...]


def study_recording(recipe: Recipe, folder: Path, looks: Looks) -> Study:
    """Identifies a recording that is fetched into `folder` (taken from there if it is there already)."""
    place = folder / recipe.name
    recording = load_recording(place if place.is_dir() else fetch_recording(recipe.name, place))
    groups = recipe.groups(recording.arm)
    runs = recording.with_role("identify")
    selection = select_structure(recording.arm, runs, groups, recipe.pulls(recording.arm), recipe.starts)
    choice = selection.choice
    chosen = components_of(groups, choice.groups)
    method = _choose_method(recipe, recording, choice, chosen)
    tasks: tuple[tuple[str, tuple[Candidate, ...], str, Pull], ...] = (
        ("rigid", (), "ordinary", Pull()),
        ("friction", components_of(groups, USUAL_GROUPS), "ordinary", Pull()),
        ("chosen", chosen, method, choice.pull),
    )
    models = []
    for name, components, by, pull in tasks:
        filters = choice.cutoff_hz, recording.robot, choice.position_factor
        identifier = Identifier(recording.arm, components, by, pull, *filters).fit(runs)
        models.append(JudgedModel(name, identifier, _look_at_errors(identifier, recording, name, looks)))
    return Study(recipe, recording, selection, tuple(models))


def _choose_method(recipe: Recipe, recording: Recording, choice: Choice, components: tuple[Candidate, ...]) -> str:
    """Physically consistent, or free of that: what predicts held-out blocks of the identification data better."""
    free = "weighted" if choice.by_joint else "alike"
    runs = recording.with_role("identify")
    ways = ("physical",) if recipe.physical else ("physical", free)
    errors = {
        way: Identifier(
            recording.arm, components, way, choice.pull, choice.cutoff_hz, None, choice.position_factor
        ).held_out_error(runs)
        for way in ways
    }
    return min(errors, key=errors.__getitem__)


def _look_at_errors(identifier: Identifier, recording: Recording, name: str, looks: Looks) -> tuple[RunError, ...]:
    model = identifier.model_
    for run in recording.with_role("validate"):
        looks.note(recording.arm.name, run.name, name)
    return tuple(run_error(model, model.signals(run)) for run in recording.runs)


def describe_study(study: Study) -> str:
    """The choice in a line."""
    choice = study.selection.choice
    method = study.models[-1].identifier.method
    return f"{study.recipe.name}: {describe_choice(choice)}; {method}; held-out error {100 * choice.held_out:.2f} %"
