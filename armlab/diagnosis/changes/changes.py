"""What changed: the columns of each candidate times the recording, tested beside the same columns in common.

As a change is tested beside its common part, a recording compared with itself has none, by symmetry. Status, named
changes and the table of parameters come from this one test.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.common.probabilities import fisher_tail
from armlab.diagnosis.changes.mixed import JointRows, MixedModel, WeightedRows, weigh_rows
from armlab.diagnosis.changes.pooled import Pooled, is_body
from armlab.diagnosis.torque.columns.columns import Block, Place, place_of
from armlab.diagnosis.tuning import ComparisonTuning
from armlab.effects.contract import Candidate

NO_COLUMNS = np.empty(0, dtype=np.intp)
LEAST_TORQUE = 1e-9  # N m (N): of a joint whose drive reports none
SHAPE_STEP = 0.05  # of a nonlinear parameter, for derivatives: a gap's torque has corners


@dataclass(frozen=True, eq=False)
class ChangeGroup:
    """One thing that may have changed. block: its columns in common; columns: their numbers, times the recording.

    scales: (columns,), of their normal prior. laws: where all friction of a joint changes by one factor, its laws with
    their coefficients. parts: laws that change together, each with its own coefficients. common: numbers of the same
    columns in common; empty where links hold them. least: a smaller change is how logs are made, see
    `Parameter.sampled`. whole_law: nonlinear parameters change with the coefficients of the law; their columns are
    derivatives. familiar: whether the common model has it, as it has all links.
    """

    block: Block
    columns: NDArray[np.intp]
    scales: Array
    common: NDArray[np.intp]
    laws: tuple[tuple[Candidate, Array], ...] = ()
    parts: tuple[Candidate, ...] = ()
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
    any_reading: whether the scale or the time of the torque may have changed by more than arms have. That shows beside
    links and friction alone; in a richer model a large scale makes up for a law that follows a change badly.
    """

    mixed: MixedModel
    common: NDArray[np.intp]
    model: NDArray[np.intp]
    groups: tuple[ChangeGroup, ...]
    contrast: Array
    tuning: ComparisonTuning
    any_reading: bool = False

    def columns_with(self, chosen: Sequence[int]) -> NDArray[np.intp]:
        """The common columns and those of chosen groups."""
        return np.concatenate([self.common, *(self.groups[each].columns for each in chosen)]).astype(np.intp)

    @cached_property
    def held_out_errors(self) -> Callable[[frozenset[int]], list[Array]]:
        """Of chosen groups: errors (rows,) of each joint, each stretch predicted by the others; fitted once a set."""
        return cache(lambda chosen: self.mixed.held_out_errors(self.columns_with(sorted(chosen))))

    @cached_property
    def degrees(self) -> float:
        """Degrees of freedom of the scatter between stretches: those of the recording with the fewest.

        Stretches of unequal weight count as fewer (Kish 1965).
        """
        rows = [np.column_stack([each.rows.members, each.rows.stretches]) for each in self.mixed.joints]
        pairs, place = np.unique(np.concatenate(rows), axis=0, return_inverse=True)
        weights = np.bincount(place, np.concatenate([each.rows.weights for each in self.mixed.joints]))
        sums, squares = (np.bincount(pairs[:, 0], each) for each in (weights, weights**2))
        return max(float(np.min(sums**2 / squares)) - 1, 1.0)

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
        return np.array([self.tuning.least_evidence if each.familiar else 0.0 for each in self.groups])

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
        of_reading = group.candidate.facts.scales_torque or _is_shift(group.candidate)
        bounded = plain and not (self.any_reading and of_reading)
        if bounded and any(group.candidate.absurdity(each) for each in sizes[1:] - sizes[0]):
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
    parts: tuple[Candidate, ...] = ()
    whole_law: bool = False


def make_table(pooled: Pooled) -> ChangeTable:
    """Columns of the common model and of all changes, row by row, with the drift of each run."""
    parts = _CommonColumns(pooled)
    whole = []
    for block in _whole_laws(pooled):
        scales = _shape_scales(block.candidate, pooled.tuning)
        shapes = parts.add(block.candidate.rows, block.values[:, :, -len(scales) :], scales)
        both = np.concatenate([parts.common[place_of(block.candidate)], shapes])
        whole.append(_Offer(block, both, _whole_law_scales(block, pooled), whole_law=True))
    plain = [parts.offer((block,)) for block in pooled.changes]
    return _finish_table(parts, (*plain, *_friction_by_one_factor(pooled), *whole))


def make_plain_table(pooled: Pooled) -> ChangeTable:
    """The same with Coulomb and viscous friction of a joint as one cause, by one factor or each by its own change.

    A shift in time of one joint is no change here: below the cut-off it looks like what friction leaves at each
    reversal. One of all torques is seen at all of several joints.
    """
    parts = _CommonColumns(pooled)
    friction: dict[int, list[Block]] = {}
    others = []
    for block in pooled.changes:
        joint = block.candidate.joint
        if joint is not None and block.candidate.is_friction_of(joint):
            friction.setdefault(joint, []).append(block)
        elif len(block.candidate.rows) > 1 or not _is_shift(block.candidate):
            others.append(block)
    causes = [(each,) for each in others] + [tuple(each) for each in friction.values()]
    table = _finish_table(parts, [*(parts.offer(each) for each in causes), *_friction_by_one_factor(pooled)])
    return replace(table, any_reading=True)


def _friction_by_one_factor(pooled: Pooled) -> list[_Offer]:
    scale = np.full(1, pooled.tuning.typical_scale)
    return [_Offer(block, NO_COLUMNS, scale, laws=laws) for block, laws in _scaled_frictions(pooled)]


def _finish_table(parts: "_CommonColumns", offers: Sequence[_Offer]) -> ChangeTable:
    """The table with the columns of what may have changed."""
    pooled, size, groups = parts.pooled, parts.size, list[ChangeGroup]()
    contrast = np.eye(pooled.recordings)[:, 1:] - 1 / pooled.recordings
    interval = max(1 / each.run.rate_hz for each in pooled.observed.signals)
    for offer in offers:
        block = offer.block
        scales = np.repeat(offer.scales, contrast.shape[1])
        values = block.values[..., None] * contrast[pooled.members][:, None, None, :]
        columns = parts.add(block.candidate.rows, values.reshape(*values.shape[:2], -1), scales)
        groups.append(
            ChangeGroup(
                block,
                columns,
                scales,
                offer.common,
                laws=offer.laws,
                parts=offer.parts,
                least=interval if _is_shift(block.candidate) else 0.0,
                whole_law=offer.whole_law,
                familiar=is_body(block.candidate) or place_of(block.candidate) in parts.known,
            )
        )
    friction = {each.block.candidate.rows[0]: each.block.values[:, 0, 0] for each in offers if each.laws}
    joints = tuple(_weighted_rows(parts, joint, friction.get(joint)) for joint in range(pooled.observed.joints))
    mixed = MixedModel(joints, parts.size, np.concatenate(parts.prior))
    own = np.arange(pooled.design.columns.size)
    return ChangeTable(mixed, np.arange(size), own, tuple(groups), contrast, pooled.tuning)


def _is_shift(candidate: Candidate) -> bool:
    """Whether it is a shift in time, of which logs are made in steps."""
    return any(each.sampled for each in candidate.facts.parameters)


class _CommonColumns:
    """Columns of each joint with their numbers, as they are added; first those that all recordings share.

    common: numbers of the columns of each law; known: places of the laws of the common model.
    """

    def __init__(self, pooled: Pooled) -> None:
        design = pooled.design
        joints = pooled.observed.joints
        self.pooled = pooled
        self.values: list[list[Array]] = [[] for _ in range(joints)]
        self.numbers: list[list[NDArray[np.intp]]] = [[] for _ in range(joints)]
        self.size = len(design.base)
        self.prior = [np.zeros(self.size)]
        for joint in range(joints):
            loading = np.flatnonzero(design.base.columns >= 10 * joint)
            self.values[joint].append(design.rigid[joint])
            self.numbers[joint].append(loading)
        self.common: dict[Place, NDArray[np.intp]] = {}
        self.known = {place_of(block.candidate) for block in design.blocks}
        shared = [*design.blocks, *(each for each in pooled.changes if place_of(each.candidate) not in self.known)]
        for block in shared:
            if not is_body(block.candidate):
                scale = block.candidate.prior_scale(design.simulation.inertial)
                scales = np.full(block.values.shape[2], scale)
                self.common[place_of(block.candidate)] = self.add(block.candidate.rows, block.values, scales)

    def add(self, rows: Sequence[int], values: Array, scales: Array) -> NDArray[np.intp]:
        """Columns (rows, joints, count) at some joints, with the scales (count,) of their prior; their numbers."""
        columns = np.arange(self.size, self.size + len(scales))
        self.size += len(scales)
        self.prior.append(np.where(np.isfinite(scales), scales, np.inf) ** -2.0)
        for place, row in enumerate(rows):
            self.values[row].append(values[:, place])
            self.numbers[row].append(columns)
        return columns

    def offer(self, blocks: tuple[Block, ...]) -> _Offer:
        """Laws at one place that change together, each with its own coefficients."""
        values = np.concatenate([each.values for each in blocks], axis=2)
        common = [self.common.get(place_of(each.candidate), NO_COLUMNS) for each in blocks]
        scales = np.concatenate([_prior_scales(each, self.pooled) for each in blocks])
        laws = tuple(each.candidate for each in blocks) if len(blocks) > 1 else ()
        return _Offer(Block(blocks[0].candidate, 0, values), np.concatenate(common), scales, parts=laws)


def _weighted_rows(parts: _CommonColumns, joint: int, friction: Array | None) -> WeightedRows:
    """The rows in which a joint moves. friction: (rows,), its torque in the common model."""
    pooled = parts.pooled
    observed = pooled.observed
    rows = observed.moving[:, joint]
    slow = _slow_waves(pooled)
    level = np.sign(observed.kept("velocity")[:, joint]) if friction is None else friction
    level = level / max(float(np.sqrt(np.mean(level**2))), 1e-300)
    runs = np.repeat(np.arange(len(pooled.owner)), [len(each.torque) for each in observed.signals])[rows]
    members = pooled.members[rows]
    wave = np.arange(slow.shape[1]) % (pooled.tuning.drift_waves + 1) > 0
    weight = np.sqrt(pooled.shared[rows, joint])
    drifts = [(slow[rows], wave)]
    if _runs_to_spare(runs, members) > 0:
        drifts.append((slow[rows][:, ~wave], wave[~wave]))
    return weigh_rows(
        JointRows(
            columns=weight[:, None] * np.column_stack(parts.values[joint])[rows],
            index=np.concatenate(parts.numbers[joint]),
            target=weight * pooled.design.target[rows, joint],
            random=tuple(weight[:, None] * part * factor for part, _ in drifts for factor in (1.0, level[rows, None])),
            waves=np.concatenate([np.tile(kind, 2) for _, kind in drifts]),
            known=weight[:, None] * _drift_of_gain(pooled, joint)[rows],
            stretches=pooled.stretches[rows],
            runs=runs,
            members=members,
            weights=weight**2,
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
    torque = np.maximum(torque, LEAST_TORQUE)
    size = np.sqrt(np.mean(block.values**2, axis=0))  # (rows, coefficients)
    return np.asarray(np.min(torque[:, None] / np.maximum(size, 1e-300), axis=0))
