"""How large each rival would have to be: as found, or so that it imitates what was found."""

from dataclasses import dataclass, replace

import numpy as np

from armlab.diagnosis.solver import USUAL_EFFECTS
from armlab.effects.contract import Candidate
from diagnosis.next.moments import Index, Moments, independent, left_over, solved
from diagnosis.next.posterior import coefficients
from diagnosis.next.question import Law, Name, Rival, in_free_links
from recordings.run import Array

LAWS = 3  # shapes of a rival that are kept: those that come closest
BEYOND_NOISE = 2.0  # standard errors
DRAWS = 12  # sizes that a rival may have
DOUBT = 0.1  # of the weight is shared by all rivals alike: no likelihood is that sure
LARGEST_SHARE = 0.3  # of the finding's torque on rich motions: by how much a rival may differ from it


@dataclass(frozen=True, eq=False)
class Choice:
    """Laws that a name may stand for, with their columns. values: of the first one, None where nothing was found."""

    name: Name
    laws: tuple[tuple[Candidate, Index], ...]
    values: Array | None


def chosen_rivals(
    choices: list[Choice], free: Index, seen: Moments, rich: Array, library_places: int, recorded: bool, joints: int
) -> tuple[Rival, ...]:
    """Rivals with the laws that come closest, and the sizes with which they do.

    seen: of the first recording, or of rich motions where there is none (recorded: False). rich: Gram matrix of rich
    motions. library_places: for the price of a law.
    """
    signal = _signal(choices, free, seen)
    rivals = tuple(_rival(each, free, seen, rich, signal, library_places, recorded, joints) for each in choices)
    return _weighted(rivals, free, seen) if recorded else rivals


def _weighted(rivals: tuple[Rival, ...], free: Index, seen: Moments) -> tuple[Rival, ...]:
    """The same with what the recording says of each: likelihood, less what parameters gain by chance, and sizes."""
    fits = [[0.5 * explained(seen, free, law.columns) for law in rival.laws] for rival in rivals]
    likely = np.array([max(fit) - rival.laws[0].freedom for fit, rival in zip(fits, rivals, strict=True)])
    weights = np.exp(likely - likely.max())
    weights = (1 - DOUBT) * weights / weights.sum() + DOUBT / len(weights)
    out = zip(rivals, fits, weights.tolist(), strict=True)
    return tuple(replace(rival, weight=weight, sizes=_sizes(rival, fit, free, seen)) for rival, fit, weight in out)


def _sizes(rival: Rival, fits: list[float], free: Index, seen: Moments) -> tuple[Array, ...]:
    """Sizes for each law, more of those that fit better."""
    share = np.exp(np.array(fits) - max(fits))
    counts = np.round(DRAWS * share / share.sum()).astype(int).tolist()
    rng = np.random.default_rng(0)  # the same sizes for every motion that is judged
    return tuple(
        coefficients(seen, free, law.columns, law.candidate, count, rng)[1][len(free) :].T
        for law, count in zip(rival.laws, counts, strict=True)
    )


@dataclass(frozen=True, eq=False)
class _Signal:
    """What the finding adds: columns times values, and its products with all columns."""

    own: Index
    values: Array
    products: Array


def _signal(choices: list[Choice], free: Index, seen: Moments) -> _Signal:
    found = next((each for each in choices if each.values is not None), None)
    if found is not None and found.values is not None:
        own, values = found.laws[0][1], found.values
    else:
        own = max((columns for _, columns in choices[0].laws), key=lambda each: explained(seen, free, each))
        values = solved(seen.gram, np.append(free, own), seen.vector)[len(free) :]
    return _Signal(own, values, seen.gram[:, own] @ values)


def explained(seen: Moments, free: Index, columns: Index) -> float:
    """What a law explains of the recording, together with what is free: standard errors squared."""
    chosen = np.append(free, columns)
    return float(solved(seen.gram, chosen, seen.vector) @ seen.vector[chosen])


def _rival(
    choice: Choice,
    free: Index,
    seen: Moments,
    rich: Array,
    signal: _Signal,
    library_places: int,
    recorded: bool,
    joints: int,
) -> Rival:
    if recorded:
        left = [-explained(seen, free, columns) for _, columns in choice.laws]
    else:
        left = [left_over(seen.gram, signal.own, signal.values, np.append(free, own)) for _, own in choice.laws]
    order = [int(number) for number in np.argsort(left, kind="stable")]
    if choice.values is not None:
        order = [0, *(number for number in order if number != 0)]
    known = in_free_links(choice.name, free)
    places = 0 if known else library_places
    laws = tuple(_law(*choice.laws[number], free, seen.gram, places, joints) for number in order[:LAWS])
    values = choice.values
    if values is None:
        values = _size(laws[0].columns, free, seen, rich, signal, recorded)
    return Rival(choice.name, laws, values)


def _size(columns: Index, free: Index, seen: Moments, rich: Array, signal: _Signal, recorded: bool) -> Array:
    """As fitted to the recording where that differs from the finding by more than noise, else its best imitation.

    What a poor recording hardly shows is fitted far too large: on rich motions the difference is no more than a share
    of the finding.
    """
    chosen = np.append(free, columns)
    imitation = solved(seen.gram, chosen, signal.products)[len(free) :]
    if recorded:
        fitted = solved(seen.gram, chosen, seen.vector)[len(free) :]
        if left_over(seen.gram, columns, fitted, np.append(free, signal.own)) > BEYOND_NOISE**2:
            beyond = fitted - imitation
            power = float(beyond @ rich[np.ix_(columns, columns)] @ beyond)
            most = LARGEST_SHARE**2 * float(signal.values @ rich[np.ix_(signal.own, signal.own)] @ signal.values)
            return np.asarray(imitation + beyond * np.sqrt(min(1.0, most / max(power, 1e-300))))
    return imitation


def _law(candidate: Candidate, columns: Index, free: Index, gram: Array, library_places: int, joints: int) -> Law:
    """A law; what every arm has is no surprise, everything else was looked for in many places, if in any."""
    own = independent(gram, columns, free) if library_places else 0
    looks = 1 if candidate.effect in USUAL_EFFECTS else library_places * candidate.looks
    freedom = own + len(candidate.shape) if own else 0
    return Law(candidate, columns, freedom, looks, len(candidate.rows) / joints)
