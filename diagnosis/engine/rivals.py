"""What these very data cannot tell from a claim: replaced by something else, everything else fitted anew."""

import numpy as np

from diagnosis.effects.contract import Candidate
from diagnosis.engine.naming import IDENTICAL
from diagnosis.engine.rounds import Round
from diagnosis.engine.search import Search
from diagnosis.engine.solver import State
from recordings.run import Array

AS_GOOD = 2.0  # units of log likelihood: a difference that may be chance
HELD_AS_GOOD = 0.01  # of the held-out error
MOST = 3

Found = list[tuple[str, int | None, tuple[int, ...], bool, float]]


def rivals_of(found: Round, group: int, own: Candidate) -> Found:
    """Rivals of a group in the state of a round: effect, joint, joints, identical, deficit; the best first.

    own: the candidate under its first name.
    """
    solver, state = found.solver, found.state
    out: Found = [(name, own.joint, own.joints, True, 0.0) for name in IDENTICAL.get((own.effect, own.form), ())]
    search = Search(solver, found.bench.settings.guards, True, 0)
    without = state.minus(group)
    scores = search.gains(without)
    full = found.moments.heldout_error(found.fit.coefficients)
    for number in np.argsort(-scores):
        rival = int(number)
        deficit = float(scores[group] - scores[rival])
        if deficit > AS_GOOD or len(out) >= MOST:
            break
        candidate = solver.groups[rival].candidate
        same = candidate.effect == own.effect and candidate.joint == own.joint
        known = any(each[:2] == (candidate.effect, candidate.joint) for each in out)
        if same or known or search.excluded(without, rival):
            continue
        other = search.joined(without, rival)
        if search.objection(other, rival) is None and _as_good(found, other, full):
            out.append((candidate.effect, candidate.joint, candidate.joints, False, max(deficit, 0.0)))
    return out


def _as_good(found: Round, other: State, full: Array) -> bool:
    error = found.moments.heldout_error(found.solver.fit(other).coefficients)
    return bool(np.all(error <= (1 + HELD_AS_GOOD) * full))
