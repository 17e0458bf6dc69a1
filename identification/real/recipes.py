"""What is given to the procedure for each public recording before it looks at any data."""

from dataclasses import dataclass

from identification.groups import USUAL, Groups, candidate_groups, counterbalance
from identification.priors import Pull
from identification.selection import TOLERANCES, pulls
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
    starts: tuple[tuple[str, ...], ...] = (USUAL,)
    physical: bool = False
    payload: tuple[float, float, float] | None = None
    counterbalanced: int | None = None

    def groups(self, arm: Arm) -> Groups:
        """Components to choose from."""
        usual = candidate_groups(len(arm))
        return usual if self.counterbalanced is None else usual | counterbalance(self.counterbalanced)

    def pulls(self, arm: Arm) -> tuple[Pull, ...]:
        """Priors to choose from."""
        if self.physical:
            return tuple(Pull("nominal", size, self.payload) for size in TOLERANCES)
        return pulls(arm, self.payload)


RECIPES = (
    Recipe("emps", {"pulses.csv": 5.3}),
    Recipe("staubli-tx40", {"validate.csv": 7.1}),
    Recipe("unisa-ur10", {"validate.csv": 13.3}),
    Recipe("unisa-panda", {"validate.csv": 3.3}),
    Recipe(
        "kuka-kr300",
        {"run_B.csv": 13.6, "run_C.csv": 13.9},
        # its data sheet names a hydropneumatic counterbalance on axis 2
        (USUAL, ("viscous", "coulomb", "rotor", "spring"), ("viscous", "coulomb", "rotor", "crank")),
        physical=True,
        payload=KUKA_FLANGE,
        counterbalanced=2,
    ),
)
