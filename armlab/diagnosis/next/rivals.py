"""The laws that a name may stand for, and the parameter values with which each rival best explains the recording or
imitates the finding.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.diagnosis.next.first_run import FoundEffect
from armlab.diagnosis.next.moments import (
    DesignMoments,
    Index,
    count_independent,
    draw_coefficients,
    solve_least_squares,
    unexplained_power,
)
from armlab.diagnosis.next.question import Law, Name, RivalLaw, is_in_free_links
from armlab.diagnosis.next.verdict_file import VerdictFinding
from armlab.effects.contract import Candidate, Family, Scene
from armlab.effects.library import library
from problem.arm import Arm

MAX_SHAPES = 24  # of a law that are looked at
OfferedLaws = Mapping[str, list[list[Candidate]]]  # places of each effect, with their shapes


def name_of(candidate: Candidate) -> Name:
    """The name that a candidate belongs to."""
    return Name(candidate.effect, candidate.joint)


def usual_friction(arm: Arm, scenes: Sequence[Scene]) -> list[Candidate]:
    """The effects that every arm has, on every joint: Coulomb and viscous friction and an offset."""
    families = [family for family in library() if family.facts.usual]
    return [shapes[0] for family in families for shapes in family.candidates(arm, scenes)]


def restore_part(finding: VerdictFinding, arm: Arm, families: Sequence[Family]) -> FoundEffect | None:
    """A finding as a candidate with its coefficients; None where its parameters do not determine it."""
    place = finding.joints or (() if finding.name.joint is None else (finding.name.joint,))
    for family in families:
        if family.effect == finding.name.effect:
            try:
                return family.from_parameters(arm, place, finding.parameters)
            except (ValueError, KeyError):
                return None
    return None


def offered_laws(families: Sequence[Family], arm: Arm, scenes: Sequence[Scene]) -> OfferedLaws:
    """Everything that the library offers on these motions."""
    return {family.effect: family.candidates(arm, scenes) for family in families}


def leaves_trace(name: Name, offered: OfferedLaws) -> bool:
    """Whether the arm and the motions show anything of a name."""
    return bool(_offered_places(name, offered))


def alternative_laws(name: Name, offered: OfferedLaws) -> list[Candidate]:
    """Every law and shape that a name may stand for; InputError where the arm or the motion shows none."""
    places = _offered_places(name, offered)
    if not places:
        raise InputError(f"{name} leaves no trace in the torques of this arm")
    thinned = [[shapes[at] for at in _evenly_spaced(len(shapes))] for shapes in places]
    laws = [each for shapes in thinned for each in shapes]
    return [each for each in laws if not each.second_name] or laws


def _offered_places(name: Name, offered: OfferedLaws) -> list[list[Candidate]]:
    return [shapes for shapes in offered.get(name.effect, []) if shapes and shapes[0].joint == name.joint]


def _evenly_spaced(count: int) -> list[int]:
    places: list[int] = np.unique(np.linspace(0, count - 1, min(count, MAX_SHAPES)).astype(int)).tolist()
    return places


MAX_LAWS = 3  # shapes of a rival that are kept: those that come closest
MIN_BEYOND_NOISE = 2.0  # standard errors: a smaller difference is noise
SIZE_DRAWS = 12  # sizes that a rival may have
SHARED_WEIGHT = 0.1  # of the weight, shared equally by all rivals, so that none is ruled out by its likelihood
MAX_SHARE_OF_FINDING = 0.3  # of the finding's torque on rich motions: by how much a rival may differ from it


@dataclass(frozen=True, eq=False)
class RivalChoice:
    """Laws that a name may stand for, with their columns. values: of the first one, None where nothing was found."""

    name: Name
    laws: tuple[tuple[Candidate, Index], ...]
    values: Array | None


def choose_rivals(
    choices: list[RivalChoice],
    free: Index,
    seen: DesignMoments,
    rich: Array,
    library_places: int,
    recorded: bool,
    joints: int,
) -> tuple[RivalLaw, ...]:
    """Rivals with the laws that come closest, and the sizes with which they do.

    seen: of the first recording, or of rich motions where there is none (recorded: False). rich: Gram matrix of rich
    motions. library_places: for the price of a law.
    """
    signal = _finding_signal(choices, free, seen)
    rivals = tuple(_build_rival(each, free, seen, rich, signal, library_places, recorded, joints) for each in choices)
    return _weight_rivals(rivals, free, seen) if recorded else rivals


def _weight_rivals(rivals: tuple[RivalLaw, ...], free: Index, seen: DesignMoments) -> tuple[RivalLaw, ...]:
    """The rivals with their weights and sizes after the recording.

    A weight follows from the likelihood, less what the parameters gain by chance.
    """
    fits = [[0.5 * explained_power(seen, free, law.columns) for law in rival.laws] for rival in rivals]
    likely = np.array([max(fit) - rival.laws[0].freedom for fit, rival in zip(fits, rivals, strict=True)])
    weights = np.exp(likely - likely.max())
    weights = (1 - SHARED_WEIGHT) * weights / weights.sum() + SHARED_WEIGHT / len(weights)
    out = zip(rivals, fits, weights.tolist(), strict=True)
    return tuple(replace(rival, weight=weight, sizes=_draw_sizes(rival, fit, free, seen)) for rival, fit, weight in out)


def _draw_sizes(rival: RivalLaw, fits: list[float], free: Index, seen: DesignMoments) -> tuple[Array, ...]:
    """Draws of the coefficients of each law, more of a law that fits better."""
    share = np.exp(np.array(fits) - max(fits))
    counts = np.round(SIZE_DRAWS * share / share.sum()).astype(int).tolist()
    rng = np.random.default_rng(0)  # the same sizes for every motion that is judged
    return tuple(
        draw_coefficients(seen, free, law.columns, law.candidate, count, rng)[1][len(free) :].T
        for law, count in zip(rival.laws, counts, strict=True)
    )


@dataclass(frozen=True, eq=False)
class _FindingSignal:
    """The torque of the finding: its columns, their values, and its products (columns,) with all columns."""

    own: Index
    values: Array
    products: Array


def _finding_signal(choices: list[RivalChoice], free: Index, seen: DesignMoments) -> _FindingSignal:
    sized = next((each for each in choices if each.values is not None), None)
    if sized is not None and sized.values is not None:
        own, values = sized.laws[0][1], sized.values
    else:
        own = max((columns for _, columns in choices[0].laws), key=lambda each: explained_power(seen, free, each))
        values = solve_least_squares(seen.gram, np.append(free, own), seen.vector)[len(free) :]
    return _FindingSignal(own, values, seen.gram[:, own] @ values)


def explained_power(seen: DesignMoments, free: Index, columns: Index) -> float:
    """Power of the recording that a law and the free columns explain together, in standard errors squared."""
    chosen = np.append(free, columns)
    return float(solve_least_squares(seen.gram, chosen, seen.vector) @ seen.vector[chosen])


def _build_rival(
    choice: RivalChoice,
    free: Index,
    seen: DesignMoments,
    rich: Array,
    signal: _FindingSignal,
    library_places: int,
    recorded: bool,
    joints: int,
) -> RivalLaw:
    if recorded:
        left = [-explained_power(seen, free, columns) for _, columns in choice.laws]
    else:
        left = [unexplained_power(seen.gram, signal.own, signal.values, np.append(free, own)) for _, own in choice.laws]
    order = [int(number) for number in np.argsort(left, kind="stable")]
    if choice.values is not None:
        order = [0, *(number for number in order if number != 0)]
    known = is_in_free_links(choice.name, free)
    places = 0 if known else library_places
    laws = tuple(_build_law(*choice.laws[number], free, seen.gram, places, joints) for number in order[:MAX_LAWS])
    values = choice.values
    if values is None:
        values = _fit_size(laws[0].columns, free, seen, rich, signal, recorded)
    return RivalLaw(choice.name, laws, values)


def _fit_size(
    columns: Index, free: Index, seen: DesignMoments, rich: Array, signal: _FindingSignal, recorded: bool
) -> Array:
    """Coefficients (columns,) of a rival that the verdict did not find.

    They are fitted to the recording where this differs from the finding by more than noise. Else they imitate the
    finding as well as they can. A recording that hardly excites the difference fits it far too large, so on rich
    motions the difference is limited to a share of the finding.
    """
    chosen = np.append(free, columns)
    imitation = solve_least_squares(seen.gram, chosen, signal.products)[len(free) :]
    if recorded:
        fitted = solve_least_squares(seen.gram, chosen, seen.vector)[len(free) :]
        if unexplained_power(seen.gram, columns, fitted, np.append(free, signal.own)) > MIN_BEYOND_NOISE**2:
            beyond = fitted - imitation
            power = float(beyond @ rich[np.ix_(columns, columns)] @ beyond)
            most = MAX_SHARE_OF_FINDING**2 * float(signal.values @ rich[np.ix_(signal.own, signal.own)] @ signal.values)
            return np.asarray(imitation + beyond * np.sqrt(min(1.0, most / max(power, 1e-300))))
    return imitation


def _build_law(candidate: Candidate, columns: Index, free: Index, gram: Array, library_places: int, joints: int) -> Law:
    """A law with its price: a usual effect counts as one look, any other as one of all places of the library."""
    own = count_independent(gram, columns, free) if library_places else 0
    looks = 1 if candidate.facts.usual else library_places * candidate.looks
    freedom = own + len(candidate.shape) if own else 0
    return Law(candidate, columns, freedom, looks, len(candidate.rows) / joints)
