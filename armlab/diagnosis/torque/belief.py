"""What is believed of a recording between two stages of its diagnosis."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from armlab.diagnosis.result import Weighed
from armlab.diagnosis.torque.columns.solver import State
from armlab.diagnosis.torque.evidence.evidence import Evidence
from armlab.diagnosis.torque.predict.prediction import Prediction
from armlab.diagnosis.torque.search.fitted_model import FittedModel
from armlab.diagnosis.torque.search.search import Step
from armlab.diagnosis.torque.search.surrogate import Structure
from armlab.diagnosis.tuning import Tuning


@dataclass(frozen=True, eq=False)
class Belief:
    """A model, which of its parts have a name, and what it leaves.

    effects, links: the evidence for names that hold, by group and by link (from 0); present: for effects of the model
    that are not claimed. banned: groups for which a search does not look any more. left: structure that the model
    leaves at each joint. weighed: names of friction whose law has no believable numbers, by group. prediction: the
    model that predicts, None before it is fitted.
    """

    model: FittedModel
    effects: Mapping[int, Evidence] = field(default_factory=dict)
    links: Mapping[int, Evidence] = field(default_factory=dict)
    present: Mapping[int, Evidence] = field(default_factory=dict)
    banned: frozenset[int] = frozenset()
    left: tuple[Structure, ...] = ()
    weighed: Mapping[int, Weighed] = field(default_factory=dict)
    prediction: Prediction | None = None

    @property
    def tuning(self) -> Tuning:
        """The tuning numbers of the diagnosis."""
        return self.model.design.settings.tuning

    def with_state(self, state: State, *steps: Step) -> "Belief":
        """The belief with its model in another state, and more steps in its log."""
        return replace(self, model=replace(self.model, state=state, steps=(*self.model.steps, *steps)))

    def with_steps(self, *steps: Step) -> "Belief":
        """The belief with more steps in its log."""
        return self.with_state(self.model.state, *steps)
