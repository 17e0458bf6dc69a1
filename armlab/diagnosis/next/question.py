"""The question of a design: rival laws, the columns that each adds, the columns that are free beside them, and which
rivals no motion separates.
"""

from dataclasses import dataclass, replace

import numpy as np

from armlab.common.arrays import Array
from armlab.diagnosis.next.moments import ROUNDING_SHARE, DesignMoments, Index, unexplained_power
from armlab.diagnosis.next.sampling import Sampling, column_changes, kept_columns
from armlab.effects.contract import Candidate, Effect, Scene
from armlab.effects.library import effect_named
from armlab.recordings.filters import Butterworth
from problem.base_parameters import BaseParameters

CLEAR_SEPARATION = 4.0  # standard errors between two rivals that decide


@dataclass(frozen=True)
class Name:
    """An effect and its joint or link, from 1; None for the whole robot."""

    effect: str
    joint: int | None

    @property
    def facts(self) -> Effect:
        """What is known of the effect; ValueError where there is no effect of that id."""
        return effect_named(self.effect)

    def __str__(self) -> str:
        """`viscous friction at joint 2`."""
        facts = self.facts
        place = "link" if facts.where == "link" else "joint"
        return facts.words if self.joint is None else f"{facts.words} at {place} {self.joint}"


@dataclass(frozen=True, eq=False)
class Law:
    """A rival in one shape. columns: its indices among all columns. freedom: number of parameters that it adds to the
    free columns. looks: number of alternatives from which a search picks it. share: of joints whose torque it changes.
    """

    candidate: Candidate
    columns: Index
    freedom: int
    looks: int
    share: float

    def price(self, rows: float) -> float:
        """Penalty of its parameters in units of log likelihood, as in the search of a diagnosis; 0 without freedom.

        rows: of all joints.
        """
        if not self.freedom:
            return 0.0
        return float(0.5 * self.freedom * np.log(max(rows * self.share, 2)) + np.log(self.looks))


@dataclass(frozen=True, eq=False)
class RivalLaw:
    """A name that may be right. Its law is laws[0] with these values; the other laws are other shapes of it.

    weight: its probability after the first recording, up to a factor. sizes: for each law draws of its coefficients
    after that recording, (draws, columns); empty without a recording.
    """

    name: Name
    laws: tuple[Law, ...]
    values: Array
    weight: float = 1.0
    sizes: tuple[Array, ...] = ()

    @property
    def possible_sizes(self) -> list[tuple[Law, Array]]:
        """Laws and coefficients (draws, columns) that it may have."""
        found = [(law, sizes) for law, sizes in zip(self.laws, self.sizes, strict=False) if len(sizes)]
        return found or [(self.laws[0], self.values[None])]


@dataclass(frozen=True, eq=False)
class Question:
    """Rivals of which one is right.

    free: columns that may be fitted beside any rival. found: those of them that the verdict has found; the others,
    usual friction, are fitted at a price. inseparable: (rivals, rivals), true where no motion can refute the second
    rival if the first one is right.
    """

    rivals: tuple[RivalLaw, ...]
    free: Index
    found: Index
    inseparable: Array

    def with_columns(self, kept: Index) -> "Question":
        """The same where only the `kept` columns, ascending, are left."""
        rivals = tuple(
            replace(each, laws=tuple(replace(law, columns=np.searchsorted(kept, law.columns)) for law in each.laws))
            for each in self.rivals
        )
        return Question(rivals, np.searchsorted(kept, self.free), np.searchsorted(kept, self.found), self.inseparable)

    @property
    def extras(self) -> Index:
        """Columns that may be fitted at a price."""
        return np.setdiff1d(self.free, self.found)

    @property
    def pairs(self) -> list[tuple[int, int]]:
        """Pairs that some motion separates."""
        every = [(one, other) for other in range(len(self.rivals)) for one in range(other)]
        return [
            (one, other) for one, other in every if not (self.inseparable[one, other] and self.inseparable[other, one])
        ]

    @property
    def hopeless(self) -> list[tuple[int, int]]:
        """Pairs that no motion separates."""
        every = [(one, other) for other in range(len(self.rivals)) for one in range(other)]
        return [pair for pair in every if pair not in self.pairs]

    def noncentrality(self, gram: Array, one: int, other: int) -> float:
        """What the best of the other's laws cannot explain where one is right, in standard errors squared."""
        right = self.rivals[one]
        return min(
            unexplained_power(gram, right.laws[0].columns, right.values, np.append(self.free, law.columns))
            for law in self.rivals[other].laws
        )

    def separation(self, gram: Array, one: int, other: int) -> float:
        """Standard errors between two rivals, whichever is right.

        Where one law contains the other, it explains all that the other explains. A diagnosis then names the simpler
        law unless the larger one is needed, so only this direction is measured.
        """
        ways = [(one, other), (other, one)]
        seen = [self.noncentrality(gram, *way) for way in ways if not self.inseparable[way]]
        return float(np.sqrt(min(seen))) if seen else 0.0


@dataclass(frozen=True, eq=False)
class Layout:
    """All columns that matter: base parameters, then candidates. prior: precision that is known beforehand."""

    base: BaseParameters
    candidates: tuple[Candidate, ...]
    places: tuple[Index, ...]
    prior: Array

    @property
    def size(self) -> int:
        """Number of columns."""
        return len(self.prior)

    def indices_of(self, candidate: Candidate) -> Index:
        """Indices of the columns of a candidate."""
        return self.places[self.candidates.index(candidate)]

    def moments(self, scene: Scene, keep: Butterworth, sampling: Sampling) -> DesignMoments:
        """Moments of a motion whose torque is not recorded yet: the vector is zero."""
        rows = self.rows(scene, keep, sampling)
        return DesignMoments(rows.T @ rows, np.zeros(self.size))

    def rows(self, scene: Scene, keep: Butterworth, sampling: Sampling) -> Array:
        """Whitened rows of a motion, (rows of all joints, columns)."""
        columns = kept_columns(self.base, self.candidates, scene, keep, smooth=True)
        return sampling.whiten(columns, scene.motion.velocity)

    def row_changes(self, scenes: tuple[Scene, Scene], keep: Butterworth, sampling: Sampling) -> Array:
        """By how much the same rows change from one scene to another one very near; weights stay those of the first."""
        columns = column_changes(self.base, self.candidates, scenes, keep)
        return sampling.whiten(columns, scenes[0].motion.velocity)


def build_layout(base: BaseParameters, candidates: list[Candidate], scene: Scene, prior: Array) -> Layout:
    """Places of all candidates, each once. prior: (base, base), precision of the base parameters."""
    unique = list(dict.fromkeys(candidates))
    places, at = [], len(base)
    for candidate in unique:
        count = candidate.columns(scene).shape[2]
        places.append(np.arange(at, at + count))
        at += count
    whole = np.zeros((at, at))
    whole[: len(base), : len(base)] = prior
    return Layout(base, tuple(unique), tuple(places), whole)


def is_in_free_links(name: Name, free: Index) -> bool:
    """Whether the free columns hold the effect already: an error of a link, where the base parameters are free."""
    return 0 in free and name.facts.in_links


def inseparable_rivals(rivals: tuple[RivalLaw, ...], free: Index, gram: Array) -> Array:
    """Matrix (rivals, rivals): true where a rich motion cannot refute the second rival if the first one is right.

    gram: of rich motions, with the prior. An error of links that are free anyway refutes no other name.
    """
    count = len(rivals)
    out = np.zeros((count, count), dtype=bool)
    question = Question(rivals, free, free, out)
    for one, right in enumerate(rivals):
        own = right.laws[0].columns
        whole = float(right.values @ gram[np.ix_(own, own)] @ right.values)
        for other in range(count):
            if one != other:
                left = question.noncentrality(gram, one, other)
                out[one, other] = is_in_free_links(right.name, free) or left <= ROUNDING_SHARE * max(whole, 1e-300)
    return out
