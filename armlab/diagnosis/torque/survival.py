"""Does a name survive on this recording? Torque that is simulated anew from the model found is diagnosed again.

The torque of the model and what it leaves, drawn anew in stretches of time of all joints together (Kuensch 1989), is a
recording with the same motion, of which the answer is known. Half of these recordings hold all findings: a name
survives as often as it returns there. From each of the others a half of the findings is left out, drawn at random: a
name that appears there without its effect would appear here without it, too. Motion, columns of the links and filters
stay as they are; the reading, the model that predicts and the pages are not asked again.
"""

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from joblib import Parallel, delayed

from armlab.common.arrays import Array
from armlab.diagnosis.result import Claim, Diagnosis, Survival
from armlab.diagnosis.torque.belief import Belief
from armlab.diagnosis.torque.columns.design import DesignMatrix
from armlab.diagnosis.torque.conclude import name_claims
from armlab.diagnosis.torque.rows.data import Observed
from armlab.diagnosis.torque.search.fitted_model import FittedModel, Progress
from armlab.diagnosis.torque.stages import BY_PROBABILITY, find_names, run_stages
from armlab.effects.contract import UNKNOWN

Name = tuple[str, int | None]  # an effect and its joint or link, from 1


def with_survival(
    found: Diagnosis, belief: Belief, design: DesignMatrix, repetitions: int, seed: int, progress: Progress
) -> Diagnosis:
    """The diagnosis with how often each of its names returns, and appears where it is left out.

    That links are off is asked of the model that predicts, where no claim says so: it is not diagnosed again. belief:
    from which it was concluded. design: before any candidate was on it. repetitions: recordings with all
    findings, and as many with half of them. seed: of what is drawn.
    """
    known = {(each.effect, each.joint) for each in name_claims(belief).claims if each.effect != UNKNOWN.id}
    named = [each for each in found.claims if (each.effect, each.joint) in known]
    if not named:
        return found
    drawn = list(_simulations(belief.model, design, named, repetitions, seed))
    progress(f"diagnosing {len(drawn)} simulated recordings")
    started, told = time.monotonic(), dict[int, frozenset[Name]]()
    work = (delayed(_names_in)(number, _with_target(design, each.target), seed) for number, each in enumerate(drawn))
    for number, names in Parallel(n_jobs=-1, return_as="generator_unordered")(work):
        told[number] = names
        left = (time.monotonic() - started) / len(told) * (len(drawn) - len(told))
        progress(f"diagnosed {len(told)} of {len(drawn)} simulated recordings, about {left:.0f} s left")
    counts = _count(named, drawn, told)
    kept = (replace(each, survival=counts.get((each.effect, each.joint))) for each in found.claims)
    return replace(found, claims=tuple(kept))


@dataclass(frozen=True, eq=False)
class _Simulated:
    """A simulated recording. target: (rows, joints), N m, measured less simulated torque. without: what is left out."""

    target: Array
    without: frozenset[Name]


def _simulations(
    model: FittedModel, design: DesignMatrix, named: Sequence[Claim], repetitions: int, seed: int
) -> Iterator[_Simulated]:
    left = model.residual(model.fit)
    for number in range(2 * repetitions):
        rng = np.random.default_rng([seed, number])
        gone = rng.permutation(len(named))[: (len(named) + 1) // 2] if number >= repetitions else ()
        torque = sum((named[each].prediction for each in gone), np.zeros_like(left))
        drawn = _drawn_anew(left, design.observed, rng)
        without = frozenset((named[each].effect, named[each].joint) for each in gone)
        yield _Simulated(design.target - left - torque + drawn, without)


def _drawn_anew(left: Array, observed: Observed, rng: np.random.Generator) -> Array:
    """What a model leaves (rows, joints), stretch by stretch from a stretch of the same role that begins anywhere."""
    out, numbers = np.empty_like(left), observed.long_stretches
    for number in np.unique(numbers):
        rows = np.flatnonzero(numbers == number)
        own = next(each for each in observed.segments if each.start <= rows[0] < each.stop)
        long = [each for each in observed.of_role(own.role) if each.stop - each.start >= len(rows)]
        starts = np.concatenate([np.arange(each.start, each.stop - len(rows) + 1) for each in long])
        begin = int(rng.choice(starts))
        out[rows] = left[begin : begin + len(rows)]
    return out


def _with_target(design: DesignMatrix, target: Array) -> DesignMatrix:
    """The design of the same motion with another torque, (rows, joints), less that of the simulation."""
    ends = np.cumsum([len(each.torque) for each in design.observed.signals])[:-1]
    changes = np.split(target - design.target, ends)
    pairs = zip(design.observed.signals, changes, strict=True)
    signals = tuple(replace(each, torque=each.torque + change) for each, change in pairs)
    return replace(design, target=target, observed=replace(design.observed, signals=signals))


def _names_in(number: int, design: DesignMatrix, seed: int) -> tuple[int, frozenset[Name]]:
    """The names that a diagnosis of the torque of a design tells, as the one of a finding or in its class."""
    belief = run_stages(BY_PROBABILITY, find_names(design, seed, _silent), _silent)
    claims = name_claims(belief).claims
    names = {(each.effect, each.joint) for each in claims}
    names |= {(member.effect, member.joint) for each in claims for member in each.members}
    return number, frozenset(name for name in names if name[0] != UNKNOWN.id)


def _count(
    named: Sequence[Claim], drawn: Sequence[_Simulated], told: Mapping[int, frozenset[Name]]
) -> dict[Name, Survival]:
    out = {}
    for name in ((each.effect, each.joint) for each in named):
        whole = [name in told[number] for number, each in enumerate(drawn) if not each.without]
        less = [name in told[number] for number, each in enumerate(drawn) if name in each.without]
        out[name] = Survival(sum(whole), len(whole), sum(less), len(less))
    return out


def _silent(message: str) -> None:
    """No progress."""
