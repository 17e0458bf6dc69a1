"""The laws that a name may stand for, from the library, and the effects of a verdict as the model has them."""

from collections.abc import Mapping, Sequence

import numpy as np

from armlab.effects.contract import Candidate, Family, Scene
from armlab.effects.drive import TORQUE_OFFSET
from armlab.effects.friction import COULOMB_FRICTION, VISCOUS_FRICTION
from armlab.effects.naming import is_first_name
from diagnosis.next.present import Part
from diagnosis.next.question import Name
from diagnosis.next.verdict_file import Finding
from problem.arm import Arm
from problem.errors import InputError

SHAPES = 24  # of a law that are looked at
Offered = Mapping[str, list[list[Candidate]]]  # places of each effect, with their shapes


def name_of(candidate: Candidate) -> Name:
    """The name that a candidate belongs to."""
    return Name(candidate.effect, candidate.joint)


def background(arm: Arm, scenes: Sequence[Scene]) -> list[Candidate]:
    """Coulomb and viscous friction and an offset on every joint."""
    families = (COULOMB_FRICTION, VISCOUS_FRICTION, TORQUE_OFFSET)
    return [shapes[0] for family in families for shapes in family.candidates(arm, scenes)]


def part_of(finding: Finding, arm: Arm, families: Sequence[Family]) -> Part | None:
    """A finding as a candidate with its coefficients; None where its parameters do not say all."""
    place = finding.joints or (() if finding.name.joint is None else (finding.name.joint,))
    for family in families:
        if family.effect == finding.name.effect:
            try:
                return family.from_parameters(arm, place, finding.parameters)
            except (ValueError, KeyError):
                return None
    return None


def offered_by(families: Sequence[Family], arm: Arm, scenes: Sequence[Scene]) -> Offered:
    """Everything that the library offers on these motions."""
    return {family.effect: family.candidates(arm, scenes) for family in families}


def leaves_trace(name: Name, offered: Offered) -> bool:
    """Whether the arm and the motions show anything of a name."""
    return bool(_places(name, offered))


def alternatives(name: Name, offered: Offered) -> list[Candidate]:
    """Every law and shape that a name may stand for; InputError where the arm or the motion shows none."""
    places = _places(name, offered)
    if not places:
        raise InputError(f"{name} leaves no trace in the torques of this arm")
    thinned = [[shapes[at] for at in _spread(len(shapes))] for shapes in places]
    found = [each for shapes in thinned for each in shapes]
    return [each for each in found if is_first_name(each)] or found


def _places(name: Name, offered: Offered) -> list[list[Candidate]]:
    return [shapes for shapes in offered.get(name.effect, []) if shapes and shapes[0].joint == name.joint]


def _spread(count: int) -> list[int]:
    places: list[int] = np.unique(np.linspace(0, count - 1, min(count, SHAPES)).astype(int)).tolist()
    return places
