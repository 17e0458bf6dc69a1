"""What changed: the columns of each candidate times the recording, tested beside the same columns in common.

As a change is tested beside its common part, a recording compared with itself has none, by symmetry. Status, named
changes and the table of parameters come from this one test.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.common.probabilities import fisher_tail
from armlab.diagnosis.columns import Block, Place, place_of
from armlab.diagnosis.compare.mixed import JointRows, MixedModel, WeightedRows, weigh_rows
from armlab.diagnosis.compare.pooled import Pooled, is_body
from armlab.diagnosis.tuning import ComparisonTuning
from armlab.effects.contract import Candidate
from armlab.effects.links import BODY_SIZE_M

SHAPE_STEP = 0.05  # of a nonlinear parameter, for derivatives: a gap's torque has corners
BODY_SCALES = np.array([1.0, *[BODY_SIZE_M] * 3, *[BODY_SIZE_M**2] * 6])  # of a body of one kilogram


@dataclass(frozen=True, eq=False)
class ChangeGroup:
    """One thing that may have changed. block: its columns in common; columns: their numbers, times the recording.

    scales: (columns,), of their normal prior. laws: where all friction of a joint changes by one factor, its laws with
    their coefficients. common: numbers of the same columns in common; empty where links hold them. least: a smaller
    change is how logs are made, see `Parameter.sampled`. shaped: where nonlinear parameters change, the coefficients of
    the law; the columns are derivatives. familiar: whether the common model has it.
    """

    block: Block
    columns: NDArray[np.intp]
    scales: Array
    common: NDArray[np.intp]
    laws: tuple[tuple[Candidate, Array], ...] = ()
    least: float = 0.0
    whole_law: bool = False
    familiar: bool = False

    @property
    def candidate(self) -> Candidate:
        """The law; of several, that of the largest torque."""
        return self.block.candidate


@dataclass(frozen=True)
class Tested:
    """A group fitted beside others. values: (columns,); covariance: by the scatter of stretches of time.

    p_value: of no change, for this group alone. evidence: log of the Bayes factor. inflation: of the covariance under
    independent errors. degrees: of freedom of the covariance.
    """

    group: int
    values: Array
    covariance: Array
    p_value: float
    evidence: float
    inflation: float
    degrees: float


@dataclass(frozen=True, eq=False)
class ChangeTable:
    """The model of all recordings. contrast: (recordings, columns a coefficient).

    common: columns that all share. model: those of them that the common model has; the others stand beside changes.
    """

    mixed: MixedModel
    common: NDArray[np.intp]
    model: NDArray[np.intp]
    groups: tuple[ChangeGroup, ...]
    contrast: Array
    tuning: ComparisonTuning

    def columns_with(self, chosen: Sequence[int]) -> NDArray[np.intp]:
        """The common columns and those of chosen groups."""
        return np.concatenate([self.common, *(self.groups[each].columns for each in chosen)]).astype(np.intp)

    @cached_property
    def held_out_errors(self) -> Callable[[frozenset[int]], list[Array]]:
        """Of chosen groups: errors (rows,) of each joint, each stretch predicted by the others; fitted once a set."""
        return cache(lambda chosen: self.mixed.held_out_errors(self.columns_with(sorted(chosen))))

    @cached_property
    def degrees(self) -> int:
        """Degrees of freedom of the scatter between stretches: those of the recording with the fewest."""
        pairs = [np.column_stack([each.rows.members, each.rows.stretches]) for each in self.mixed.joints]
        owners = np.unique(np.concatenate(pairs), axis=0)[:, 0]
        return max(int(np.bincount(owners, minlength=len(self.contrast)).min()) - 1, 1)

    def degrees_with(self, share: float) -> float:
        """The same where a share of a variance is that between runs, of which there are few (Satterthwaite 1946)."""
        spare = max(_runs_to_spare(each.rows.runs, each.rows.members) for each in self.mixed.joints)
        return self.degrees if spare < 1 else 1 / (share**2 / spare + (1 - share) ** 2 / self.degrees)

    def evidence(self, chosen: Sequence[int]) -> Array:
        """Log evidence of each group beside chosen ones, errors taken as independent: (groups,)."""
        mixed, inside = self.mixed, self.columns_with(chosen)
        matrix = mixed.information[np.ix_(inside, inside)] + np.diag(mixed.precision[inside])
        scale = 1 / np.sqrt(np.diag(matrix))
        low = np.linalg.cholesky(matrix * np.outer(scale, scale))
        half = np.linalg.solve(low, scale[:, None] * mixed.information[inside])
        out = np.full(len(self.groups), -np.inf)
        for number, group in enumerate(self.groups):
            if number in chosen:
                continue
            own = group.columns
            data = np.asarray(mixed.information[np.ix_(own, own)] - half[:, own].T @ half[:, own])
            towards = np.asarray(mixed.information[own, -1] - half[:, own].T @ half[:, -1])
            out[number] = _log_bayes_factor(data, towards, group.scales)
        return out

    @cached_property
    def prior_odds(self) -> Array:
        """Log odds before any data, (groups,): what the model has changes sooner than a new fault appears."""
        return np.array([self.tuning.familiar_odds if each.familiar else 0.0 for each in self.groups])

    def odds(self, evidence: Array) -> Array:
        """Log evidence where the scale of the errors is itself known by a few stretches alone (Student's t)."""
        half = (self.degrees + 1) / 2
        return np.asarray(half * np.sign(evidence) * np.log1p(2 * np.abs(evidence) / self.degrees))

    def log_odds(self, tested: Tested) -> float:
        """Log odds of a change, before and after the data."""
        return float(self.odds(np.array(tested.evidence)) + self.prior_odds[tested.group])

    def deficits(self, chosen: Sequence[int], tested: Tested) -> Array:
        """How much worse each group would be in the place of a chosen one, log odds, (groups,): infinite for others."""
        number = tested.group
        gains = self.evidence([each for each in chosen if each != number])
        known = np.isfinite(gains)
        worse = np.where(known, (gains[number] - np.where(known, gains, 0.0)) / tested.inflation, 0.0)
        return np.where(known, self.odds(worse) + self.prior_odds[number] - self.prior_odds, np.inf)

    def test(self, chosen: Sequence[int]) -> tuple[Tested, ...]:
        """Tests of chosen groups, all fitted together."""
        inside = self.columns_with(chosen)
        values, inverse = self.mixed.fit(inside)
        scatter, between = self.mixed.scatter(inside, values)
        robust = inverse @ (scatter + np.diag(self.mixed.precision[inside])) @ inverse
        of_runs = inverse @ between @ inverse
        out, at = [], len(self.common)
        for number in chosen:
            own = slice(at, at + len(self.groups[number].columns))
            out.append(self._judge(number, values[own], inverse[own, own], robust[own, own], of_runs[own, own]))
            at = own.stop
        return tuple(out)

    def _judge(self, number: int, values: Array, model: Array, robust: Array, of_runs: Array) -> Tested:
        """One factor makes the covariance under independent errors as large as the stretches say.

        of_runs: the part of the covariance robust that is known by the differences between runs alone.
        """
        scales, count = self.groups[number].scales, len(values)
        precision: Array = np.asarray(np.linalg.inv(model), dtype=np.float64)
        spread = float(np.trace(precision @ robust))
        inflation = max(spread / count, 1.0)
        degrees = self.degrees_with(min(float(np.trace(precision @ of_runs)) / spread, 1.0))
        data = (precision - np.diag(scales**-2.0)) / inflation
        evidence = _log_bayes_factor(data, precision @ values / inflation, scales)
        rank = max(int(np.sum(np.linalg.eigvalsh(scales[:, None] * data * scales) > 1)), 1)
        wald = float(values @ precision @ values) / inflation
        p_value = fisher_tail(wald / rank, rank, degrees)
        return Tested(number, values, model * inflation, p_value, evidence, inflation, degrees)

    def is_sure(self, tested: Tested) -> bool:
        """Whether a change is no chance among all that is compared."""
        group, values = self.groups[tested.group], tested.values.reshape(-1, self.contrast.shape[1])
        sizes = self.contrast @ values.T
        if float(np.ptp(sizes)) < group.least:
            return False
        plain = not group.laws and not group.whole_law
        if plain and any(group.candidate.absurdity(each) for each in sizes[1:] - sizes[0]):
            return False
        enough = tested.evidence > self.tuning.least_evidence
        return enough and tested.p_value * len(self.groups) < self.tuning.level


def _log_bayes_factor(data: Array, towards: Array, scales: Array) -> float:
    """Of values with a normal prior of these scales against zeros. data: (columns, columns), their information."""
    inner = np.eye(len(scales)) + scales[:, None] * data * scales
    scaled = scales * towards
    return 0.5 * float(scaled @ np.linalg.solve(inner, scaled)) - 0.5 * float(np.linalg.slogdet(inner)[1])


@dataclass(frozen=True, eq=False)
class _Offer:
    """What may have changed, without own columns yet. scales: (coefficients,); the others as in `ChangeGroup`."""

    block: Block
    common: NDArray[np.intp]
    scales: Array
    laws: tuple[tuple[Candidate, Array], ...] = ()
    whole_law: bool = False


def make_table(pooled: Pooled) -> ChangeTable:
    """Columns of the common model and of all changes, row by row, with the drift of each run."""
    design, observed, tuning = pooled.design, pooled.observed, pooled.tuning
    count = pooled.recordings
    contrast = np.eye(count)[:, 1:] - 1 / count
    interval = max(1 / each.run.rate_hz for each in observed.signals)
    known = {place_of(block.candidate) for block in design.blocks}
    shared = [*design.blocks, *(each for each in pooled.changes if place_of(each.candidate) not in known)]
    shared = [each for each in shared if not is_body(each.candidate)]
    parts = _Columns(observed.joints)
    for joint in range(observed.joints):
        loading = np.flatnonzero(design.base.columns >= 10 * joint)
        parts.add(joint, np.concatenate([run[joint] for run in design.rigid]), loading)
    at, prior, common = len(design.base), [np.zeros(len(design.base))], dict[Place, NDArray[np.intp]]()
    for block in shared:
        columns = np.arange(at, at + block.values.shape[2])
        at += len(columns)
        scale = block.candidate.prior_scale(design.simulation.inertial)
        prior.append(np.full(len(columns), scale**-2.0 if np.isfinite(scale) else 0.0))
        common[place_of(block.candidate)] = columns
        for place, row in enumerate(block.candidate.rows):
            parts.add(row, block.values[:, place], columns)
    whole = []
    for block in _whole_laws(pooled):
        shapes = np.arange(at, at + len(block.candidate.shape))
        at += len(shapes)
        prior.append(_shape_scales(block.candidate, tuning) ** -2.0)
        both = np.concatenate([common[place_of(block.candidate)], shapes])
        whole.append(_Offer(block, both, _whole_law_scales(block, pooled), whole_law=True))
        for place, row in enumerate(block.candidate.rows):
            parts.add(row, block.values[:, place, -len(shapes) :], shapes)
    everything, groups = np.arange(at), []
    none = np.empty(0, dtype=np.intp)
    scaled = [_Offer(block, none, np.full(1, tuning.typical_scale), laws) for block, laws in _scaled_frictions(pooled)]
    plain = [
        _Offer(block, common.get(place_of(block.candidate), none), _prior_scales(block, pooled))
        for block in pooled.changes
    ]
    for offer in (*plain, *scaled, *whole):
        block = offer.block
        columns = np.arange(at, at + block.values.shape[2] * contrast.shape[1])
        at += len(columns)
        scales = np.repeat(offer.scales, contrast.shape[1])
        sampled = any(each.sampled for each in block.candidate.facts.parameters)
        least = interval if sampled else 0.0
        familiar = place_of(block.candidate) in known
        groups.append(ChangeGroup(block, columns, scales, offer.common, offer.laws, least, offer.whole_law, familiar))
        prior.append(scales**-2.0)
        for place, row in enumerate(block.candidate.rows):
            values = block.values[:, place, :, None] * contrast[pooled.members][:, None, :]
            parts.add(row, values.reshape(len(values), -1), columns)
    friction = {each.block.candidate.rows[0]: each.block.values[:, 0, 0] for each in scaled}
    joints = tuple(_weighted_rows(pooled, parts, joint, friction.get(joint)) for joint in range(observed.joints))
    mixed = MixedModel(joints, at, np.concatenate(prior))
    own = np.arange(design.columns.size)
    return ChangeTable(mixed, everything, own, tuple(groups), contrast, tuning)


class _Columns:
    """Columns of each joint with their numbers, as they are added."""

    def __init__(self, joints: int) -> None:
        self.values: list[list[Array]] = [[] for _ in range(joints)]
        self.numbers: list[list[NDArray[np.intp]]] = [[] for _ in range(joints)]

    def add(self, joint: int, values: Array, numbers: NDArray[np.intp]) -> None:
        """Columns (rows, count) of a joint."""
        self.values[joint].append(values)
        self.numbers[joint].append(numbers)


def _weighted_rows(pooled: Pooled, parts: _Columns, joint: int, friction: Array | None) -> WeightedRows:
    """The rows in which a joint moves. friction: (rows,), its torque in the common model."""
    observed = pooled.observed
    rows = observed.moving[:, joint]
    slow = _slow_waves(pooled)
    level = np.sign(observed.kept("velocity")[:, joint]) if friction is None else friction
    level = level / max(float(np.sqrt(np.mean(level**2))), 1e-300)
    runs = np.repeat(np.arange(len(pooled.owner)), [len(each.torque) for each in observed.signals])[rows]
    members = pooled.members[rows]
    wave = np.arange(slow.shape[1]) % (pooled.tuning.drift_waves + 1) > 0
    drifts = [(slow[rows], wave)]
    if _runs_to_spare(runs, members) > 0:
        drifts.append((slow[rows][:, ~wave], wave[~wave]))
    return weigh_rows(
        JointRows(
            columns=np.column_stack(parts.values[joint])[rows],
            index=np.concatenate(parts.numbers[joint]),
            target=pooled.design.target[rows, joint],
            random=tuple(part * factor for part, _ in drifts for factor in (1.0, level[rows, None])),
            waves=np.concatenate([np.tile(kind, 2) for _, kind in drifts]),
            known=_drift_of_gain(pooled, joint)[rows],
            stretches=pooled.stretches[rows],
            runs=runs,
            members=members,
        )
    )


def _drift_of_gain(pooled: Pooled, joint: int) -> Array:
    """The torque of each run, by the common model, times what a motor's torque constant differs by between runs, (rows,
    runs). The measured torque would bring the noise itself into the columns, and bias all that is fitted beside them.
    """
    counts = [len(each.torque) for each in pooled.observed.signals]
    runs = np.repeat(np.arange(len(counts)), counts)
    left = pooled.model.residual_at(joint, pooled.model.fit)
    torque = pooled.tuning.gain_drift * (pooled.observed.torque[:, joint] - left)
    return np.asarray(torque[:, None] * (runs[:, None] == np.arange(len(counts))))


def _runs_to_spare(runs: NDArray[np.intp], members: NDArray[np.intp]) -> int:
    """Runs beyond the first one of each recording: they tell how far runs of one recording differ."""
    return len(np.unique(runs)) - len(np.unique(members))


def _slow_waves(pooled: Pooled) -> Array:
    """A constant and slow cosines of each run, falling as their frequency grows: (rows, runs * waves).

    A run differs from the next one by at least as much as its beginning from its end.
    """
    waves, start, orders = [], 0, np.arange(1, pooled.tuning.drift_waves + 1)
    for signals in pooled.observed.signals:
        count = len(signals.torque)
        share = (np.arange(count) + 0.5) / count
        own = np.zeros((pooled.observed.rows, len(orders) + 1))
        own[start : start + count, 0] = 1.0
        own[start : start + count, 1:] = np.sqrt(2) * np.cos(np.pi * np.outer(share, orders)) / orders
        waves.append(own)
        start += count
    return np.column_stack(waves)


def _scaled_frictions(pooled: Pooled) -> list[tuple[Block, tuple[tuple[Candidate, Array], ...]]]:
    """The torque of all friction of a joint as one column, where it has several coefficients."""
    model, out = pooled.model, []
    for joint in range(pooled.observed.joints):
        laws = []
        for number, block in enumerate(model.design.blocks):
            candidate = block.candidate
            if candidate.is_friction_of(joint + 1):
                values = model.solver.values(model.fit, number)
                laws.append((candidate, values, block.values[:, 0] @ values))
        laws.sort(key=lambda law: -float(law[2] @ law[2]))
        if sum(len(values) for _, values, _ in laws) > 1:
            total = np.sum([law[2] for law in laws], axis=0)
            out.append((Block(laws[0][0], 0, total[:, None, None]), tuple((law[0], law[1]) for law in laws)))
    return out


def _whole_laws(pooled: Pooled) -> list[Block]:
    """Laws at one joint with nonlinear parameters: their columns, and the derivatives of their torque by these."""
    model, design, out = pooled.model, pooled.design, []
    for number, block in enumerate(design.blocks):
        candidate = block.candidate
        if not candidate.shape or candidate.facts.single_event or candidate.facts.where != "joint":
            continue
        values, columns = model.solver.values(model.fit, number), []
        for place, (low, high) in enumerate(candidate.bounds):
            torques = []
            for way in (1, -1):
                shape = list(candidate.shape)
                shape[place] = float(np.clip(shape[place] + way * SHAPE_STEP * abs(shape[place]), low, high))
                torques.append(design.block(candidate.with_shape(tuple(shape)), 0).values @ values)
            columns.append((torques[0] - torques[1]) / (2 * SHAPE_STEP * abs(candidate.shape[place])))
        derivatives = np.stack(columns, axis=-1)
        if np.isfinite(derivatives).all() and np.all(np.any(derivatives != 0, axis=(0, 1))):
            out.append(Block(candidate, 0, np.concatenate([block.values, derivatives], axis=2)))
    return out


def _shape_scales(candidate: Candidate, tuning: ComparisonTuning) -> Array:
    """Standard deviations of changes of nonlinear parameters."""
    return np.asarray(tuning.typical_scale * np.abs(candidate.shape))


def _whole_law_scales(block: Block, pooled: Pooled) -> Array:
    """Standard deviations of changes of coefficients and nonlinear parameters."""
    coefficients = Block(block.candidate, 0, block.values[:, :, : block.candidate.size])
    shape = _shape_scales(block.candidate, pooled.tuning)
    return np.concatenate([_prior_scales(coefficients, pooled), shape])


def _prior_scales(block: Block, pooled: Pooled) -> Array:
    """Standard deviations of a change's coefficients: what the effect has on arms, else a share of the torque."""
    candidate, observed = block.candidate, pooled.observed
    known = candidate.prior_scale(pooled.design.simulation.inertial)
    if np.isfinite(known):
        return np.full(block.values.shape[2], known)
    rows = list(candidate.rows)
    torque = pooled.tuning.typical_share * np.sqrt(np.mean(observed.torque[:, rows] ** 2, axis=0))
    size = np.sqrt(np.mean(block.values**2, axis=0))  # (rows, coefficients)
    if is_body(candidate):
        inner = BODY_SCALES[list(getattr(candidate, "felt", range(10)))]
        total = np.sqrt(np.sum((size * inner) ** 2, axis=1))
        return np.asarray(inner * np.min(torque / np.maximum(total, 1e-300)))
    return np.asarray(np.min(torque[:, None] / np.maximum(size, 1e-300), axis=0))
