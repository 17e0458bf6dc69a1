"""A verdict held against what is known of its recording: facts named, classed, told as causes, minor or missed."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from armlab.common.probabilities import normal_quantile
from armlab.proof.open.real_folders.facts import (
    AllowedFact,
    ChangedFact,
    FactsFile,
    KnownFact,
    PairFacts,
    ReadingFact,
    SingleFacts,
)
from armlab.proof.open.real_folders.stated_names import (
    FACT_RANKS,
    SETUP,
    FindingAsTold,
    Rank,
    StatedFact,
    ToldChange,
    ToldVerdict,
    friction_at,
    number_of,
    statement_of,
)

BESIDE_ANY = frozenset({"torque_offset", "asymmetric_friction"})  # names that may stand in a class beside a right one
NOT_TOLD: tuple[Rank, ...] = ("minor", "missed")
MAX_INTERVAL_RATIO = 2.0  # of the interval of a change over the range that is known
DOUBT = re.compile(r"(?<!othing is )read wrongly|may be read|not be excluded|cannot (be excluded|exclude)")


@dataclass(frozen=True)
class JudgedFact:
    """How a fact was told.

    size_right: of a change, whether a number told touches its range. width: of its interval over that of plain least
    squares, both as shares of the change; None where there is none.
    """

    rank: Rank
    strong: bool = False
    size_right: bool | None = None
    width: float | None = None


@dataclass(frozen=True)
class FolderScore:
    """A verdict against facts.

    wrong: what contradicts them. extra: what is told and neither known nor allowed. below: what is told below
    probability 0.5. words: of the summary; causes: effects told, all friction as one; told: findings told.
    """

    facts: tuple[JudgedFact, ...] = ()
    wrong: tuple[str, ...] = ()
    extra: tuple[str, ...] = ()
    below: tuple[str, ...] = ()
    words: int | None = None
    causes: int | None = None
    told: int | None = None

    def count(self, rank: Rank, strong: bool = False) -> int:
        """How many facts were told so; of the strong ones alone where `strong`."""
        return sum(each.rank == rank and (each.strong or not strong) for each in self.facts)


def score_missing(known: SingleFacts | PairFacts) -> FolderScore:
    """The score of a folder without a verdict."""
    if isinstance(known, SingleFacts):
        facts = tuple(JudgedFact("missed", each.strong) for each in known.known)
    else:
        facts = tuple(JudgedFact("missed", size_right=False) for _ in known.changed)
    return FolderScore(facts, wrong=("no verdict",))


def score_single(known: SingleFacts, verdict: ToldVerdict, file: FactsFile) -> FolderScore:
    """The verdict of one recording against what is known of it."""
    return _SingleJudge(known, verdict, file).score()


@dataclass(frozen=True)
class _SingleJudge:
    known: SingleFacts
    verdict: ToldVerdict
    file: FactsFile

    def score(self) -> FolderScore:
        told = [(each, statement_of(each, self.file.friction)) for each in self.verdict.found if each.kind != SETUP]
        facts, wrong = list[JudgedFact](), list[str]()
        for fact in self.known.known:
            rank, by = self._best(fact, told)
            facts.append(JudgedFact(rank, fact.strong))
            wrong += self._wrong_about(fact, rank, by, told)
        wrong += [text for finding, said in told for text in self._wrong_in(finding, said)]
        wrong += self._wrong_readings()
        shown = [each for each in self.verdict.found if not each.minor]
        causes = {"friction" if each.effect in self.file.friction else each.effect for each in shown}
        return FolderScore(
            facts=tuple(facts),
            wrong=tuple(wrong),
            extra=tuple(each.label for each, said in told if self._is_extra(each, said)),
            below=tuple(each.label for each, said in told if said.rank == "below"),
            words=len(self.verdict.summary.split()),
            causes=len(causes),
            told=len(shown),
        )

    def _best(
        self, fact: KnownFact, told: Sequence[tuple[FindingAsTold, StatedFact]]
    ) -> tuple[Rank, FindingAsTold | None]:
        """The best rank of a fact, and the finding that tells it; a class may hold no name that is not right."""
        effects = self.file.effects(fact.effect)
        fitting = [
            (said.rank, finding)
            for finding, said in told
            if said.rank != "below"
            and (fact.joint is None or fact.joint in finding.places)
            and finding.effect in effects
            and said.names <= effects | BESIDE_ANY
        ]
        missed: tuple[Rank, FindingAsTold | None] = ("missed", None)
        return min(fitting, key=lambda each: FACT_RANKS.index(each[0]), default=missed)

    def _wrong_about(
        self, fact: KnownFact, rank: Rank, by: FindingAsTold | None, told: Sequence[tuple[FindingAsTold, StatedFact]]
    ) -> Iterator[str]:
        """A strong fact that is not told, a number or a friction torque outside of what is known."""
        label = f"{'/'.join(fact.effect)}@{fact.joint}"
        if rank in NOT_TOLD or by is None:
            if fact.strong and not (self.known.abstain and self.verdict.status == "inconclusive"):
                yield f"{rank} {label}"
            return
        number = number_of(by) if fact.value is not None and by.effect == fact.effect[0] else None
        if fact.value is not None and number is not None:
            widest = max(1.0, *fact.value) if fact.width is None else fact.width
            if not _touches(number, fact.value) or number[1] - number[0] > widest:
                yield f"{label} {_interval_text(number)}, known {_range_text(fact.value)}"
        if fact.torque is not None and fact.speed is not None and fact.joint is not None:
            stated = tuple(finding for finding, said in told if said.rank != "below")
            torque = friction_at(self.verdict, stated, fact.joint, fact.speed, self.file.friction)
            if torque is not None and not fact.torque[0] <= torque <= fact.torque[1]:
                yield f"{label} {torque:.3g} at {fact.speed:g}, known {_range_text(fact.torque)}"

    def _wrong_in(self, finding: FindingAsTold, said: StatedFact) -> Iterator[str]:
        """A finding that contradicts a fact, or whose number lies outside of what is allowed."""
        if said.rank in ("minor", "below"):
            return
        if said.names & set(self.known.never):
            yield f"never {finding.label}"
        for allowed in self.known.allowed:
            number = number_of(finding, allowed.parameter) if self._covers(allowed, finding) else None
            if allowed.value is not None and number is not None and not _touches(number, allowed.value):
                yield f"{finding.label} {_interval_text(number)}, known {_range_text(allowed.value)}"

    def _is_extra(self, finding: FindingAsTold, said: StatedFact) -> bool:
        if said.rank in ("minor", "below") or said.names & set(self.known.never):
            return False
        right: list[KnownFact | AllowedFact] = [*self.known.known, *self.known.allowed]
        return not any(self._covers(each, finding) for each in right)

    def _covers(self, fact: KnownFact | AllowedFact, finding: FindingAsTold) -> bool:
        """Whether a finding is of an effect and at a place that a fact names."""
        joints = fact.joints if isinstance(fact, AllowedFact) else None if fact.joint is None else (fact.joint,)
        return finding.effect in self.file.effects(fact.effect) and (
            joints is None or not finding.places.isdisjoint(joints)
        )

    def _wrong_readings(self) -> Iterator[str]:
        """Reading mistakes that are not there, a doubt in the summary without one that is, and no answer at all."""
        mistakes = [each for each in self.verdict.found if each.kind == SETUP]
        fair = [each for each in mistakes if any(_is_fair(each, fact) for fact in self.known.setup)]
        yield from (f"read wrongly: {each.label}" for each in mistakes if each not in fair)
        if DOUBT.search(self.verdict.summary) and not fair:
            yield "doubt in the summary"
        if self.verdict.status == "inconclusive" and not self.known.abstain:
            yield "inconclusive"


def _is_fair(finding: FindingAsTold, fact: ReadingFact) -> bool:
    if finding.effect != fact.effect:
        return False
    joints, number = finding.places - {None}, number_of(finding)
    at_joints = fact.joints is None or (bool(joints) and joints <= set(fact.joints))
    return at_joints and (fact.value is None or number is None or _touches(number, fact.value))


def score_pair(known: PairFacts, verdict: ToldVerdict, file: FactsFile) -> FolderScore:
    """A comparison against what changed."""
    told = [(each, statement_of(each, file.friction)) for each in verdict.found]
    right: list[ChangedFact | AllowedFact] = [*known.changed, *known.allowed]
    facts, wrong = list[JudgedFact](), list[str]()
    for fact in known.changed:
        effects = file.effects(fact.effect)
        ranks: list[Rank] = [
            said.rank
            for finding, said in told
            if finding.effect in effects and finding.places & {fact.joint, None} and said.rank != "below"
        ]
        rank = _best_rank(ranks)
        rows = _rows_of(fact, verdict, file)
        size_right = _has_right_size(fact, rows)
        widths = [width for row in rows if (width := _width_of(row, fact.errors)) is not None]
        facts.append(JudgedFact(rank, size_right=size_right, width=min(widths, default=None)))
        if rank in NOT_TOLD:
            if not (known.same_is_fair and verdict.status != "changed"):
                wrong.append(f"{rank}, at {fact.errors:g} standard errors")
        elif not size_right:
            wrong.append(f"no size inside {_range_text(_known_size(fact))}")
    extra = list[str]()
    for finding, said in told:
        if said.rank in ("minor", "below"):
            continue
        if not known.changed:
            wrong.append(f"nothing changed: {finding.label}")
        elif said.names & set(known.never):
            wrong.append(f"never {finding.label}")
        elif not any(_covers_change(each, finding, file) for each in right):
            extra.append(finding.label)
    if not known.changed and verdict.status == "changed" and not verdict.found:
        wrong.append("nothing changed: status")
    if verdict.status == "inconclusive":
        wrong.append("inconclusive")
    return FolderScore(tuple(facts), tuple(wrong), tuple(extra))


def _best_rank(ranks: list[Rank]) -> Rank:
    return min([*ranks, "missed"], key=FACT_RANKS.index)


def _covers_change(fact: ChangedFact | AllowedFact, finding: FindingAsTold, file: FactsFile) -> bool:
    joints = fact.joints if isinstance(fact, AllowedFact) else (fact.joint,)
    somewhere = joints is None or not finding.places.isdisjoint({*joints, None})
    return finding.effect in file.effects(fact.effect) and somewhere


def _rows_of(fact: ChangedFact, verdict: ToldVerdict, file: FactsFile) -> list[ToldChange]:
    """The parameters that changed and may be that of a fact."""
    effects = file.effects(fact.effect)
    return [
        row
        for row in verdict.changes or ()
        if row.changed
        and row.joint in (fact.joint, None)
        and (row.effect in effects or (row.effect == "base_parameter" and not effects & file.friction))
    ]


def _has_right_size(fact: ChangedFact, rows: Sequence[ToldChange]) -> bool:
    """Whether a changed parameter's interval touches what is known and is at most twice as wide."""
    sizes = [_ratio_of(row) if fact.factor is not None else _difference_of(row) for row in rows]
    low, high = _known_size(fact)
    widest = MAX_INTERVAL_RATIO * (high - low)
    return any(size is not None and _touches(size, (low, high)) and size[1] - size[0] <= widest for size in sizes)


def _width_of(row: ToldChange, errors: float) -> float | None:
    """The width of a change's interval over that of plain least squares, which sees it by so many standard errors."""
    if row.difference_ci95 is None or row.old is None or row.new is None or row.new == row.old:
        return None
    low, high = row.difference_ci95
    return errors * (high - low) / (2 * normal_quantile(0.975) * abs(row.new - row.old))


def _known_size(fact: ChangedFact) -> tuple[float, float]:
    size = fact.factor or fact.difference
    assert size is not None
    return size


def _ratio_of(row: ToldChange) -> tuple[float, float] | None:
    """New over old as an interval; None where there is none."""
    if row.ratio is not None:
        return row.ratio_ci95 or (row.ratio, row.ratio)
    difference = _difference_of(row)
    if not row.old or difference is None:
        return None
    one, other = 1 + difference[0] / row.old, 1 + difference[1] / row.old
    return min(one, other), max(one, other)


def _difference_of(row: ToldChange) -> tuple[float, float] | None:
    """New minus old as an interval; None where one of them is not known."""
    if row.old is None or row.new is None:
        return None
    return row.difference_ci95 or (row.new - row.old, row.new - row.old)


def _touches(interval: tuple[float, float], known: tuple[float, float]) -> bool:
    return interval[0] <= known[1] and interval[1] >= known[0]


def _interval_text(interval: tuple[float, float]) -> str:
    return f"{interval[0]:.3g} to {interval[1]:.3g}"


def _range_text(known: tuple[float, float]) -> str:
    return f"{known[0]:g} to {known[1]:g}"
