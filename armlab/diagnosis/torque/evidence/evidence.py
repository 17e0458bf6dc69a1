"""The evidence for each effect of a model: a robust test, the gain on held-out data, and the laws of physics."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from armlab.common.arrays import Array
from armlab.diagnosis.torque.columns.blocks import (
    BlockCovariance,
    Folds,
    HeldOutGain,
    WhitenedRows,
    block_covariance,
    held_out_gain,
    variance_inflation,
)
from armlab.diagnosis.torque.columns.links import Widths
from armlab.diagnosis.torque.columns.solver import Fit, State
from armlab.diagnosis.torque.evidence.pushes import make_stretch, reason_no_contact
from armlab.diagnosis.torque.rows.data import rows_in
from armlab.diagnosis.torque.search.fitted_model import FittedModel, fit_values, split_fit
from armlab.diagnosis.torque.search.refine import profile_without


@dataclass(frozen=True, eq=False)
class StatesCompared:
    """The state of a round beside others, whose groups are its own and some more."""

    model: FittedModel
    state: State
    more: frozenset[int]

    @cached_property
    def wide(self) -> Fit:
        """The fit with everything that is compared."""
        return self.model.solver.fit(State(tuple(sorted({*self.state.groups, *self.more})), self.state.widths))

    @cached_property
    def folds(self) -> Folds:
        """Whitened rows of the wide fit, in folds."""
        return split_fit(self.model, self.wide, self.model.noise)

    def covariance_of(self, state: State) -> BlockCovariance:
        """Robust covariance of the parameters of a state within the wide fit."""
        robust = self.model.design.settings.guards.robust_variance
        folds = self.folds
        return block_covariance(self._rows_of(state), folds.whole, folds.precision, robust, self._chosen(state))

    def _rows_of(self, state: State) -> WhitenedRows:
        """Whitened rows of the wide fit, with what a state leaves of them."""
        rows, values = self.folds.rows, np.zeros(len(self.folds.precision))
        values[self._chosen(state)] = fit_values(self.model.solver.fit(state))
        errors = (target - design @ values for target, design in zip(self.folds.targets, rows.designs, strict=True))
        return replace(rows, errors=tuple(errors))

    def event_inflation(self, state: State, place: Sequence[int], joint: int) -> float:
        """`variance_inflation` of what happens once at a joint (from 0). place: of its coefficients in the fit.

        No other stretch shows how its like would scatter, so the correlation of what all of them leave has to say it.
        """
        rows, chosen = self._rows_of(state), self._chosen(state)
        wide = [chosen[each] for each in place]
        event = rows.designs[joint][:, wide] @ fit_values(self.model.solver.fit(state))[list(place)]
        return variance_inflation(event, rows.errors[joint])

    def _chosen(self, state: State) -> list[int]:
        """Where the parameters of a smaller state stand among those of the wide fit."""
        rank = self.wide.links.shape[1]
        at = {int(column): rank + place for place, column in enumerate(self.wide.columns)}
        return [*range(rank), *(at[int(column)] for column in self.model.solver.fit(state).columns)]

    def gains(self, fit: Fit, less: Fit, joints: tuple[int, ...]) -> dict[int, tuple[HeldOutGain, HeldOutGain]]:
        """Per joint the gain on validation rows, and on identification stretches held out in turn."""
        pair = [self._in_turn(each.state, joints) for each in (less, fit)]
        blocks = self.folds.rows.blocks
        return {
            joint: (
                self.validation_gain(fit, less, joint),
                held_out_gain(pair[0][joint], pair[1][joint], blocks[joint]),
            )
            for joint in joints
        }

    def _in_turn(self, state: State, joints: tuple[int, ...]) -> dict[int, Array]:
        """Held-out errors of a state at some joints, stretch by stretch; those of the judged state itself are kept."""
        if state == self.state:
            return self._own_errors
        values = self.folds.solutions(self._chosen(state))
        return {joint: self.folds.errors_at(joint, values) for joint in joints}

    @cached_property
    def _own_errors(self) -> dict[int, Array]:
        """At all joints."""
        return dict(enumerate(self.folds.errors(self._chosen(self.state))))

    def validation_gain(self, fit: Fit, less: Fit, joint: int) -> HeldOutGain:
        """The gain at a joint on validation rows."""
        observed, noise = self.model.design.observed, self.model.noise
        left = np.column_stack([self.model.residual_at(joint, each) for each in (less, fit)])
        white = noise.white(left, joint, observed, "validate")
        blocks = noise.numbers(observed.held_out_stretches, joint, observed, "validate")
        return held_out_gain(white[:, 0], white[:, 1], blocks)

    def validation_rms(self, fit: Fit, joint: int) -> float:
        """What a fit leaves at a joint on validation rows, N m."""
        observed = self.model.design.observed
        rows = rows_in(observed.of_role("validate", joint), observed.rows)
        return float(np.sqrt(np.mean(self.model.residual_at(joint, fit)[rows] ** 2)))


@dataclass(frozen=True)
class Evidence:
    """p_value: of the effect being zero, robust; corrected: after everything that was looked at. gain: share by
    which the whitened held-out error of the joint that profits most falls, held_p: one-sided, of that fall; the better
    of validation runs and of identification stretches held out in turn. validation_gain: the share on validation runs.
    rms_before, rms_after: N m, of that joint on validation rows without and with it. score: what it adds to the score
    of the model. objection: of physics. repeatable: False for what happened once, in one stretch of one run: no other
    data can tell of it. usual: what every arm has. growth_p: one-sided, of the error on validation runs growing.
    """

    joint: int
    p_value: float
    corrected: float
    gain: float
    held_p: float
    validation_gain: float
    rms_before: float
    rms_after: float
    score: float
    objection: str | None = None
    repeatable: bool = True
    usual: bool = False
    growth_p: float = 1.0

    @property
    def fall(self) -> float:
        """By what share the RMS on validation rows falls."""
        return 1 - self.rms_after / self.rms_before if self.rms_before > 0 else 0.0


@dataclass(frozen=True, eq=False)
class Judge:
    """Judges the effects of a state of a round."""

    model: FittedModel
    state: State

    @cached_property
    def compared(self) -> StatesCompared:
        """The state beside the simpler groups that its own contain."""
        more = {other for group in self.state.groups for other in self.simpler(group)}
        return StatesCompared(self.model, self.state, frozenset(more))

    @cached_property
    def scores(self) -> dict[int, float]:
        """What each group adds to the score of the state."""
        losses = self.model.solver.losses(self.model.solver.fit(self.state))
        return {group: -losses[group] for group in self.state.groups}

    @cached_property
    def _spread(self) -> BlockCovariance:
        return self.compared.covariance_of(self.state)

    def effects(self) -> dict[int, Evidence]:
        """Evidence for each group."""
        return {group: self.effect(group) for group in self.state.groups}

    def effect(self, group: int) -> Evidence:
        """Evidence for a group."""
        solver, state = self.model.solver, self.state
        fit, candidate = solver.fit(state), solver.candidate(group)
        objection = solver.objection(group, solver.values(fit, group), self._covariance(fit, self._spread, group))
        if self.simpler(group) and not self._in_place_of_usual(group):
            evidence = self._beyond_usual(group)
        else:
            tested = self._tested(fit, self._spread, group), self.looks(group)
            evidence = self._against(state.minus(group), tested, candidate.rows, self.scores[group])
        if candidate.facts.single_event:
            evidence = replace(evidence, repeatable=False)
            objection = self._pushed(group)
        return replace(evidence, objection=objection, usual=candidate.facts.usual)

    def jointly(self, groups: Sequence[int]) -> Evidence:
        """Evidence for some groups at one place together, of which nothing else was looked at."""
        fit = self.model.solver.fit(self.state)
        less = State(tuple(each for each in self.state.groups if each not in groups), self.state.widths)
        columns = np.concatenate([self.model.solver.groups[each].columns for each in groups])
        place = [at for each in groups for at in self._place(fit, each)]
        largest = self.model.design.settings.tuning.blocks.max_variance_ratio
        p_value = self._spread.p_value(fit.coefficients[columns], place, largest)
        rows = self.model.solver.groups[groups[0]].candidate.rows
        evidence = self._against(less, (p_value, 1), rows, fit.score - self.model.solver.fit(less).score)
        return replace(evidence, usual=all(self.model.candidate(each).facts.usual for each in groups))

    def links(self) -> dict[int, Evidence]:
        """Evidence for each link (from 0) that is off."""
        widths = self.state.widths or ()
        others = {
            link: tuple(0.0 if other == link else each for other, each in enumerate(widths))
            for link, width in enumerate(widths)
            if width
        }
        return {link: self._off(without, link + 1, len(widths)) for link, without in others.items()}

    def together(self) -> Evidence:
        """Evidence for the links being off at all."""
        count = len(self.state.widths or ())
        return self._off((0.0,) * count, count, count)

    def _off(self, without: Widths, joints: int, looks: int) -> Evidence:
        """Evidence for the present widths against others."""
        fit = self.model.solver.fit(self.state)
        less = self.model.solver.fit(State(self.state.groups, without))
        score = fit.score - less.score
        p_value = float(np.exp(-np.clip(score, 0, 700)))  # a Bayes factor bounds the p-value from above
        gains = {joint: self.compared.validation_gain(fit, less, joint) for joint in range(joints)}
        both = {joint: (gain, gain) for joint, gain in gains.items()}  # links are held out in validation runs alone
        return self._evidence(fit, less, both, (p_value, looks), score)

    def looks(self, group: int) -> int:
        """How much was looked at: every place has its equal share of the level, and divides it among its shapes.

        Half of the level is for what every arm has.
        """
        groups = self.model.solver.groups
        if not self.model.solver.unusual[group]:
            return 2 * int(np.sum(~self.model.solver.unusual))
        own = groups[group].place
        return 2 * self.model.solver.places * sum(each.candidate.looks for each in groups if each.place == own)

    def _pushed(self, group: int) -> str | None:
        """Against a push: see `reason_no_contact`."""
        model, design = self.model, self.model.design
        block, joint = design.blocks[group], design.blocks[group].candidate.rows[0]
        push = block.values[:, 0] @ model.coefficients(model.fit)[model.solver.groups[group].columns]
        torque = design.observed.torque[:, joint] - model.residual_at(joint, model.fit) - push
        windows = [block.candidate.columns(scene)[:, 0, 0] for scene in design.scenes]
        rest = profile_without(design, model.noise, model.solver, self.state.minus(group))

        def whiten(matrix: Array, joint: int) -> Array:
            return model.noise.white(matrix, joint, design.observed, "identify")

        def lead(law: Array) -> float:
            return rest.gain(block, whiten) - rest.gain(replace(block, values=law[:, None]), whiten)

        inside = (model.candidate(each) for each in self.state.groups)
        remembers = any(each.is_friction_of(joint + 1) and each.of_time for each in inside)
        tuning = design.settings.tuning
        creep = tuning.data.creep_ratio if remembers else None
        return reason_no_contact(make_stretch(design.observed, joint, windows, torque, creep), lead, tuning)

    def simpler(self, group: int) -> tuple[int, ...]:
        """See `Solver.contained`."""
        return self.model.solver.contained(group)

    def _in_place_of_usual(self, group: int) -> bool:
        """Whether one law stands where usual friction would need as many numbers, and is likelier than that.

        A law without nonlinear parameters is usual friction by direction; it is compared as other special laws are.
        """
        solver, state, simpler = self.model.solver, self.state, self.simpler(group)
        candidate = solver.candidate(group)
        numbers = int(solver.ranks[group]) + len(candidate.shape)
        if not candidate.shape or set(simpler) & set(state.groups) or numbers > solver.ranks[list(simpler)].sum():
            return False
        usual = State(tuple(sorted({*state.minus(group).groups, *simpler})), state.widths)
        return solver.fit(state).score > solver.fit(usual).score

    def _beyond_usual(self, group: int) -> Evidence:
        """The evidence against usual friction in the place of one special law, and of all at this joint."""
        groups, state = self.model.solver.groups, self.state
        joint, simpler = groups[group].candidate.joint, self.simpler(group)
        special = [each for each in state.groups if groups[each].candidate.joint == joint and self.simpler(each)]
        tested = self._beyond(group, simpler), self.looks(group)
        found = list[Evidence]()
        for taken in ([group], special):
            less = State(tuple(sorted({*state.groups, *simpler} - set(taken))), state.widths)
            score = self.model.solver.fit(state).score - self.model.solver.fit(less).score
            found.append(self._against(less, tested, groups[group].candidate.rows, score))
        return min(found, key=lambda each: each.gain)

    def _against(self, less: State, tested: tuple[float, int], rows: tuple[int, ...], score: float) -> Evidence:
        """Evidence for the state against a smaller one."""
        fit = self.model.solver.fit(self.state)
        other = self.model.solver.fit(less)
        return self._evidence(fit, other, self.compared.gains(fit, other, rows), tested, score)

    def _tested(self, fit: Fit, spread: BlockCovariance, group: int) -> float:
        columns = self.model.solver.groups[group].columns
        largest, place = self.model.design.settings.tuning.blocks.max_variance_ratio, self._place(fit, group)
        candidate = self.model.candidate(group)
        if candidate.facts.single_event:
            inflation = self.compared.event_inflation(fit.state, place, candidate.rows[0])
            spread = replace(spread, covariance=spread.covariance * inflation)
        return spread.p_value(fit.coefficients[columns], place, largest)

    def _beyond(self, group: int, simpler: tuple[int, ...]) -> float:
        """P-value of what a group explains that the simpler ones in it do not."""
        state = State(tuple(sorted({*self.state.groups, *simpler})), self.state.widths)
        return self._tested(self.model.solver.fit(state), self.compared.covariance_of(state), group)

    def _place(self, fit: Fit, group: int) -> list[int]:
        """Where a group's coefficients stand in a fit's covariance."""
        columns = self.model.solver.groups[group].columns
        start = fit.links.shape[1] + int(np.flatnonzero(fit.columns == columns[0])[0])
        return list(range(start, start + len(columns)))

    def _covariance(self, fit: Fit, spread: BlockCovariance, group: int) -> Array:
        """Of a group's unscaled coefficients."""
        place = self._place(fit, group)
        lengths = self.model.moments.lengths[self.model.solver.groups[group].columns]
        return np.asarray(spread.covariance[np.ix_(place, place)] / np.outer(lengths, lengths))

    def _evidence(
        self,
        fit: Fit,
        less: Fit,
        gains: dict[int, tuple[HeldOutGain, HeldOutGain]],
        tested: tuple[float, int],
        score: float,
    ) -> Evidence:
        joint = max(gains, key=lambda each: max(gains[each], key=lambda gain: gain.share).share)
        validated, inside = gains[joint]
        best = validated if validated.share >= inside.share else inside
        p_value, looks = tested
        corrected = min(1.0, p_value * (looks if self.model.design.settings.guards.correction else 1))
        before = self.compared.validation_rms(less, joint)
        after = self.compared.validation_rms(fit, joint)
        return Evidence(
            joint,
            p_value,
            corrected,
            best.share,
            best.p_value,
            validated.share,
            before,
            after,
            score,
            growth_p=validated.growth_p,
        )


def count_looks(model: FittedModel) -> int:
    """Everything that was compared: each candidate with each shape, and the alternatives of scans."""
    return max(sum(group.candidate.looks for group in model.solver.groups), 1)
