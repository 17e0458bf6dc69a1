"""The complete model of a recording, identified on its identification runs alone."""

from dataclasses import dataclass

from identification.groups import Groups, components_of
from identification.identifier import Identifier
from identification.real.recipes import Recipe
from identification.selection import describe, select
from identification.torque_model import TorqueModel
from recordings.recording import Recording

MIXED = ("direction", "cube root", "square", "load")
"""Laws of the same velocity or load that predict a little better in sums, and of which none means anything alone: a
law that is to be named has to stand for something."""


@dataclass(frozen=True, eq=False)
class Reference:
    """A recording and its complete model. told: how that was chosen, in a line."""

    recording: Recording
    model: TorqueModel
    told: str


def reference_of(recording: Recording, recipe: Recipe) -> Reference:
    """Components, filters and prior by blocked cross-validation; links are bodies that can exist.

    A diagnosis weighs how far links may be off in the metric of their pseudo-inertias, so it wants links, not base
    parameters.
    """
    arm, runs = recording.arm, recording.with_role("identify")
    groups: Groups = {name: parts for name, parts in recipe.groups(arm).items() if name not in MIXED}
    choice = select(arm, runs, groups, recipe.pulls(arm), recipe.starts).choice
    filters = choice.cutoff_hz, recording.robot, choice.position_factor
    components = components_of(groups, choice.groups)
    model = Identifier(arm, components, "physical", choice.pull, *filters).fit(runs).model_
    return Reference(recording, model, describe(choice))
