"""The confusability card of a design: what the rivals look like before and after, in lines and as JSON."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from diagnosis.next.chances import Chances
from diagnosis.next.experiment import WEAK, Experiment, Pair

SCHEMA = "next/1"


def lines(experiment: Experiment) -> Iterator[str]:
    """The card as a person reads it."""
    yield "standard errors between rivals           before   random motion   this motion"
    for pair in experiment.pairs:
        yield f"  {pair.names[0]} | {pair.names[1]}"
        if pair.hopeless:
            yield "    no motion separates these two: to this arm's torques they are the same"
        else:
            yield f"    {pair.before:41.1f} {pair.random:15.1f} {pair.after:13.1f}"
            if pair.after < WEAK:
                yield f"    {runs_needed(pair)} such runs would bring {WEAK:g} standard errors"
        for remedy in pair.remedies:
            yield f"    what else would: {remedy.what}: {remedy.separation:.1f} standard errors"
    for number, found in enumerate(experiment.chances):
        if found is not None:
            yield _told(found, experiment, number)
    budget = experiment.budget
    yield f"designed in {experiment.seconds:.1f} s with {budget.evaluations} evaluations of {budget.algorithm}"


def runs_needed(pair: Pair) -> int:
    """How many runs of the designed motion bring enough, as information adds."""
    gain = pair.after**2 - pair.before**2
    return int(np.ceil((WEAK**2 - pair.before**2) / gain)) if gain > 0 else 0


def _told(found: Chances, experiment: Experiment, number: int) -> str:
    names = " or ".join(str(rival.name) for rival in experiment.prepared.questions[number].rivals)
    return (
        f"one such run decides between {names}: rightly {100 * found.right:.0f} %, wrongly {100 * found.wrong:.0f} %, "
        f"still open {100 * found.open:.0f} % of simulated runs"
    )


def content(experiment: Experiment) -> dict[str, Any]:
    """The card as plain data, schema next/1."""
    budget = experiment.budget
    return {
        "schema": SCHEMA,
        "helps": experiment.point is not None,
        "duration_s": budget.duration,
        "algorithm": budget.algorithm,
        "evaluations": budget.evaluations,
        "seed": budget.seed,
        "seconds": round(experiment.seconds, 2),
        "limits": [_limits(each) for each in experiment.excitation.constraints.limits],
        "questions": [_question(experiment, number) for number in range(len(experiment.chances))],
    }


def _question(experiment: Experiment, number: int) -> dict[str, Any]:
    found = experiment.chances[number]
    rivals = experiment.prepared.questions[number].rivals
    return {
        "rivals": [
            {
                "effect": each.name.effect,
                "joint": each.name.joint,
                "law": each.laws[0].candidate.equation(each.values),
            }
            for each in rivals
        ],
        "pairs": [_pair(each) for each in experiment.pairs if each.question == number],
        "decides": None if found is None else {"rightly": found.right, "wrongly": found.wrong, "open": found.open},
    }


def _pair(pair: Pair) -> dict[str, Any]:
    return {
        "names": list(pair.names),
        "no_motion_separates": pair.hopeless,
        "standard_errors": {"before": pair.before, "random_motion": pair.random, "designed": pair.after},
        "otherwise": [{"what": each.what, "standard_errors": each.separation} for each in pair.remedies],
    }


def _limits(limits: Any) -> dict[str, Any]:
    torque = limits.torque if np.isfinite(limits.torque) else None
    return {
        "position": list(limits.position),
        "velocity": limits.velocity,
        "acceleration": limits.acceleration,
        "torque": torque,
    }
