"""One public recording from raw file to errors: choose inside the identification data, fit, then look."""

from dataclasses import dataclass
from pathlib import Path

from identification.components import Component
from identification.groups import USUAL, components_of
from identification.identifier import Identifier
from identification.priors import Pull
from identification.real.looks import Looks
from identification.real.recipes import Recipe
from identification.selection import Choice, Selection, describe, select
from identification.validation import RunError, run_error
from recordings.load import load_recording
from recordings.public.fetch import fetch_recording
from recordings.recording import Recording


@dataclass(frozen=True, eq=False)
class Fitted:
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
    models: tuple[Fitted, ...]


def study(recipe: Recipe, folder: Path, looks: Looks) -> Study:
    """Identifies a recording that is fetched into `folder` (taken from there if it is there already)."""
    place = folder / recipe.name
    recording = load_recording(place if place.is_dir() else fetch_recording(recipe.name, place))
    groups = recipe.groups(recording.arm)
    runs = recording.with_role("identify")
    selection = select(recording.arm, runs, groups, recipe.pulls(recording.arm), recipe.starts)
    choice = selection.choice
    chosen = components_of(groups, choice.groups)
    method = _method(recipe, recording, choice, chosen)
    tasks: tuple[tuple[str, tuple[Component, ...], str, Pull], ...] = (
        ("rigid", (), "ordinary", Pull()),
        ("friction", components_of(groups, USUAL), "ordinary", Pull()),
        ("chosen", chosen, method, choice.pull),
    )
    models = []
    for name, components, by, pull in tasks:
        filters = choice.cutoff_hz, recording.robot, choice.position_factor
        identifier = Identifier(recording.arm, components, by, pull, *filters).fit(runs)
        models.append(Fitted(name, identifier, _errors(identifier, recording, name, looks)))
    return Study(recipe, recording, selection, tuple(models))


def _method(recipe: Recipe, recording: Recording, choice: Choice, components: tuple[Component, ...]) -> str:
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


def _errors(identifier: Identifier, recording: Recording, name: str, looks: Looks) -> tuple[RunError, ...]:
    model = identifier.model_
    for run in recording.with_role("validate"):
        looks.note(recording.arm.name, run.name, name)
    return tuple(run_error(model, model.signals(run)) for run in recording.runs)


def summary(found: Study) -> str:
    """The choice in a line."""
    choice = found.selection.choice
    method = found.models[-1].identifier.method
    return f"{found.recipe.name}: {describe(choice)}; {method}; held-out error {100 * choice.held_out:.2f} %"
