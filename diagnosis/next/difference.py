"""What is left of one rival where the other is fitted instead: the torque by which a motion tells them apart."""

import numpy as np

from diagnosis.next.moments import left_over, solved
from diagnosis.next.question import Question
from recordings.run import Array


def difference(question: Question, pair: tuple[int, int], gram: Array, columns: Array) -> Array:
    """Torque (rows, joints), N m, in the direction that is harder to tell.

    gram: of everything that is fitted. columns: (rows, joints, columns), of the motion that is looked at.
    """
    ways = [way for way in (pair, pair[::-1]) if not question.blind[way]] or [pair]
    one, other = min(ways, key=lambda way: question.noncentrality(gram, *way))
    right = question.rivals[one]
    own = right.laws[0].columns
    fits = [np.append(question.free, law.columns) for law in question.rivals[other].laws]
    chosen = min(fits, key=lambda each: left_over(gram, own, right.values, each))
    best = solved(gram, chosen, gram[:, own] @ right.values)
    return np.asarray(columns[:, :, own] @ right.values - columns[:, :, chosen] @ best)
