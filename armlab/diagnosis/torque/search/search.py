"""The search for the set of effects with the best score, and its log."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from armlab.common.arrays import Array
from armlab.diagnosis.settings import Settings
from armlab.diagnosis.torque.columns.columns import Group
from armlab.diagnosis.torque.columns.links import Widths
from armlab.diagnosis.torque.columns.solver import Solver, State
from armlab.diagnosis.tuning import SearchTuning
from armlab.effects.contract import Candidate

SMALLEST_GAIN = 1e-6  # nats, of a move: less is rounding


def rival_formulas(groups: Sequence[Group], number: int) -> tuple[int, ...]:
    """Numbers of the formulas at a joint that a law of the last resort has to be clearly better than."""
    own = groups[number].candidate
    return tuple(
        other
        for other, each in enumerate(groups)
        if each.candidate.joint == own.joint
        and each.candidate.facts.one_of == own.facts.one_of
        and not each.candidate.facts.last_resort
    )


@dataclass(frozen=True)
class FailedTest:
    """A test that a name did not pass, in words.

    value, bound: what was compared, None where it is no number; number: the tuning number that is the bound;
    at_least: whether the value has to be at least the bound, or at most.
    """

    test: str
    text: str
    value: float | None = None
    bound: float | None = None
    number: str = ""
    at_least: bool = True


@dataclass(frozen=True)
class Step:
    """A move of the search or a test of a name, for the log.

    score: after a move of the search; 0 for a test. failed: the test that made the move. stage: in which it was made.
    before: the score before a move that raises it. Where that is not the score after the move before, the search has
    begun from another state, or with columns that follow another model.
    """

    what: str
    score: float
    failed: FailedTest | None = None
    stage: str = ""
    before: float | None = None

    @classmethod
    def against(cls, candidate: Candidate, failed: FailedTest, becomes: str = "withdrawn") -> "Step":
        """That an effect failed a test, and what becomes of it."""
        return cls(f"{becomes}: {candidate.effect} {candidate.joint}: {failed.text}", 0.0, failed)


@dataclass(frozen=True)
class NotTaken:
    """An effect that a model does not hold, by its likeliest shape there. joint: from 1, None for the whole robot.

    gain: what it would add to the score, nats. objection: of physics, None where there is none or nobody asked.
    """

    effect: str
    joint: int | None
    gain: float
    objection: str | None


@dataclass(frozen=True, eq=False)
class Search:
    """Moves that raise the score of a state. fixed: whether the links' widths may not be changed.
    banned: groups that were withdrawn."""

    solver: Solver
    settings: Settings
    fixed: bool
    links: int
    banned: frozenset[int] = frozenset()

    @property
    def tuning(self) -> SearchTuning:
        """Bounds of the search."""
        return self.settings.tuning.search

    def best(self, starts: Sequence[State]) -> tuple[State, tuple[Step, ...]]:
        """The best state that the starts lead to, and the moves of all."""
        steps: list[Step] = []
        ends = [self.climb(start, steps) for start in starts]
        if not self.fixed:
            crossed = {State(each.groups, other.widths) for each in ends for other in ends} - set(ends)
            ends += [self.climb(start, steps) for start in sorted(crossed, key=lambda each: each.groups)]
        return max(ends, key=lambda end: self.solver.fit(end).score), tuple(steps)

    def climb(self, state: State, steps: list[Step]) -> State:
        """The state where no move raises the score any more."""
        while (better := self._step(state)) is not None:
            before = self.solver.fit(state).score
            what, state = better
            steps.append(Step(what, self.solver.fit(state).score, before=before))
        return state

    def _step(self, state: State) -> tuple[str, State] | None:
        here = self.solver.fit(state).score
        for moves in (self._forward, self._backward, self._widths, self._exchanges):
            found = [(what, other) for what, other in moves(state)]
            if not found:
                continue
            what, other = max(found, key=lambda move: self.solver.fit(move[1]).score)
            if self.solver.fit(other).score > here + SMALLEST_GAIN:
                return what, other
        return None

    def _forward(self, state: State) -> Iterator[tuple[str, State]]:
        crowded = self.solver.crowd(state.groups) >= self.tuning.max_unusual_effects
        added = None if crowded else self._addition(state, self.gains(state))
        if added is not None:
            yield f"+ {self._name(added)}", self.with_group(state, added)

    def with_group(self, state: State, group: int) -> State:
        """The state with a group, without those that it replaces, or that break a law of physics at its joint then."""
        state = self.in_place(state, group)
        joint = self.solver.candidate(group).joint
        for other in state.groups:
            beside = other != group and self.solver.candidate(other).joint == joint
            if beside and self.objection(state, other) is not None:
                state = state.minus(other)
        return state

    def in_place(self, state: State, group: int) -> State:
        """The state with a group, without those that it replaces."""
        for other in self._replaced(state, group):
            state = state.minus(other)
        return state.plus(group)

    def with_expected(self, state: State) -> State:
        """The state with usual friction where it is expected, nothing holds its place, and physics allows it."""
        missing = [each for each in sorted(self.solver.expected - set(state.groups)) if each not in self.banned]
        for group in missing:
            if self.solver.is_held(state, group) and not self.has_no_room(state, group):
                state = state.plus(group)
        for group in missing:
            if group in state.groups and self.objection(state, group) is not None:
                state = state.minus(group)
        return state

    def _replaced(self, state: State, group: int) -> list[int]:
        return [other for other in state.groups if self.solver.replaces[group, other]]

    def excluded(self, state: State, group: int) -> bool:
        """Whether a group is not looked for: see `has_no_room`.

        A law of the last resort is nowhere looked for beside the others: see `name_friction_curves`.
        """
        return self.solver.candidate(group).facts.last_resort or self.has_no_room(state, group)

    def has_no_room(self, state: State, group: int) -> bool:
        """Whether the state holds the group's place already, or something that contains it."""
        candidate = self.solver.candidate(group)
        inside = [self.solver.groups[other] for other in state.groups]
        return self._too_many_beside(state, group) or any(
            other.place == self.solver.groups[group].place
            or (
                bool(candidate.facts.one_of)
                and candidate.facts.one_of == other.candidate.facts.one_of
                and candidate.joint == other.candidate.joint
            )
            or (candidate.effect in other.candidate.replaces and candidate.joint == other.candidate.joint)
            for other in inside
        )

    def _too_many_beside(self, state: State, group: int) -> bool:
        """Whether an effect would have more of another beside it than it allows, see `Effect.at_most_beside`."""
        facts = [self.solver.candidate(each).facts for each in (*state.groups, group)]
        present = [each.id for each in facts]
        limits = [limit for each in facts for limit in each.at_most_beside.items()]
        return any(present.count(effect) > count for effect, count in limits)

    def _addition(self, state: State, gains: Array, but: int | None = None) -> int | None:
        """The group of the largest of some gains that breaks no law of physics. but: one that may not be added."""
        asked = 0
        for group in np.argsort(-gains):
            number = int(group)
            if gains[number] <= SMALLEST_GAIN or asked >= self.tuning.max_candidates_asked:
                return None
            if self._may_add(state, number, but):
                asked += 1
                if self.objection(self.with_group(state, number), number) is None:
                    return number
        return None

    def _may_add(self, state: State, group: int, but: int | None) -> bool:
        return group != but and group not in self.banned and not self.excluded(state, group)

    def gains(self, state: State, but: int | None = None) -> Array:
        """Gain of each group, with the price of what it replaces given back. but: of the state, to go without."""
        return np.asarray(self.solver.gains(state, but) + self._given_back(state, but))

    def _given_back(self, state: State, but: int | None) -> Array:
        solver, present = self.solver, [each for each in state.groups if each != but]
        prices = solver.prices[present] + solver.tuning.crowd_penalty * solver.unusual[present]
        return np.asarray(solver.replaces[:, present] @ prices)

    def not_taken(self, state: State) -> Iterator[NotTaken]:
        """Each effect at each place that a state does not hold, with what it would add to the score."""
        gains, best = self.gains(state), dict[tuple[str, int | None], int]()
        held = {(each.effect, each.joint) for each in map(self.solver.candidate, state.groups)}
        for group in map(int, np.argsort(-gains)):
            candidate = self.solver.candidate(group)
            best.setdefault((candidate.effect, candidate.joint), group)
        for (effect, joint), group in best.items():
            if (effect, joint) not in held:
                asked = gains[group] > SMALLEST_GAIN
                objection = self.objection(self.with_group(state, group), group) if asked else None
                yield NotTaken(effect, joint, float(gains[group]), objection)

    def objection(self, state: State, group: int) -> str | None:
        """What physics says against a group as it is fitted in a state."""
        if not self.settings.guards.physics_signs:
            return None
        fit = self.solver.fit(state)
        return self.solver.objection(group, self.solver.values(fit, group), self.solver.covariance(fit, group))

    def _may_leave(self, state: State) -> list[int]:
        return [each for each in state.groups if not self.solver.is_held(state, each)]

    def _backward(self, state: State) -> Iterator[tuple[str, State]]:
        may_leave = self._may_leave(state)
        if not self.settings.guards.backward_elimination or not may_leave:
            return
        losses = self.solver.losses(self.solver.fit(state))
        group = max(may_leave, key=lambda each: losses[each])
        if losses[group] > 0:
            yield f"- {self._name(group)}", self.with_expected(state.minus(group))

    def _exchanges(self, state: State) -> Iterator[tuple[str, State]]:
        if not self.settings.guards.backward_elimination:
            return
        places = [(group, without) for group in self._may_leave(state) for without in self._without(state, group)]
        alone = [(group, without, state, group) for group, without in places if without == state.minus(group)]
        others = [(group, without, without, None) for group, without in places if without != state.minus(group)]
        for group, without, whole, but in (*alone, *others):  # where only the group is gone, all from one fit
            if self._may_raise(state, without, whole, but, group):
                added = self._addition(without, self.gains(whole, but), group)
                if added is not None:
                    other = self.with_expected(self.with_group(without, added))
                    yield f"{self._name(group)} -> {self._name(added)}", other

    def _may_raise(self, state: State, without: State, whole: State, but: int | None, group: int) -> bool:
        """Whether any group could raise the score of a state enough in the place of one."""
        least = self.solver.fit(state).score + SMALLEST_GAIN - self.solver.free_fit(without).score
        most = self.solver.gains_at_most(whole, but) + self._given_back(whole, but)
        enough = map(int, np.flatnonzero(most > least))
        return any(self._may_add(without, each, group) for each in enough)

    def _without(self, state: State, group: int) -> list[State]:
        """The state without a group; with the usual friction that it contained; without the joint's friction at all."""
        bare, usual = state.minus(group), self.solver.contained(group)
        back = State(tuple(sorted({*bare.groups, *usual})), state.widths)
        free, friction = bare, self._usual_friction(state, self.solver.candidate(group).joint)
        if friction[:1] == [
            group
        ]:  # one law may stand for all friction of a joint, and no part alone makes room for it
            for other in friction[1:]:
                free = free.minus(other)
        return list(dict.fromkeys((bare, back, free)))

    def _usual_friction(self, state: State, joint: int | None) -> list[int]:
        """Groups of a joint's usual friction in a state, in the order of the library."""
        facts = [(group, self.solver.candidate(group)) for group in state.groups]
        return [group for group, each in facts if each.joint == joint and each.facts.usual and each.facts.dissipates]

    def _widths(self, state: State) -> Iterator[tuple[str, State]]:
        if self.fixed or state.widths is None:
            return
        for widths in self._neighbours(state.widths):
            yield f"links off by {widths}", State(state.groups, widths)

    def _neighbours(self, widths: Widths) -> Iterator[Widths]:
        """All links alike, or one link changed."""
        tried = self.settings.tuning.links
        yield from ((size,) * self.links for size in (0.0, *tried.uncertainty_grid))
        for size in (0.0, *tried.single_link_grid):
            for link in range(self.links):
                yield tuple(size if other == link else width for other, width in enumerate(widths))

    def _name(self, group: int) -> str:
        candidate = self.solver.candidate(group)
        where = "" if candidate.joint is None else f" {candidate.joint}"
        shape = "" if not candidate.shape else f" {tuple(round(value, 4) for value in candidate.shape)}"
        return f"{candidate.effect}{where}{shape}"


def background_state(solver: Solver, widths: Widths | None) -> State:
    """Friction and offset on every joint."""
    chosen = [
        number for number, group in enumerate(solver.groups) if group.candidate.facts.usual and group.variant == 0
    ]
    return State(tuple(chosen), widths)
