"""The search for the mistakes of a recording: each alone, then beside the best ones, each once more in its place."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from armlab.recordings.reading import mistakes as table
from armlab.recordings.reading.judge import ReadingJudge, Trial
from armlab.recordings.reading.reading import SPRING, Mistake, Reading
from armlab.recordings.reading.singles import search_singles


@dataclass(frozen=True, eq=False)
class Found:
    """What a search found. start: as it is read; best: read rightly, with its mistakes. without: read with all of them
    but one. rivals: of each mistake, other mistakes in its place that fit alike. margins: standard errors by which the
    next best reading with another one in its place is worse, 0 at least. undecided: joints (from 1) whose zeros
    the data do not tell by quarters of a turn. doubts: readings that may not be named and cannot be excluded.
    """

    start: Trial
    best: Trial
    without: tuple[Trial, ...] = ()
    rivals: tuple[tuple[Trial, ...], ...] = ()
    margins: tuple[float, ...] = ()
    undecided: tuple[int, ...] = ()
    doubts: tuple[Trial, ...] = ()
    looks: int = 0


def find_mistakes(judge: ReadingJudge, start: Trial) -> Found:
    """The mistakes of a reading, at most as many as the tuning allows; none where all joints leave what is usual."""
    tuning = judge.tuning
    if judge.is_usual(start):
        return Found(start, start, looks=judge.looks[0])
    singles = search_singles(judge, start)
    best, beside = _extend(judge, start, singles)
    if not judge.is_usual(best) and judge.overall_error(start) > tuning.gross_error:
        for first in _distinct(singles, tuning.beam):
            is_taken = first.reading.mistakes == best.reading.mistakes[:1]
            if is_taken or first.loss > start.loss - tuning.least_evidence:
                continue
            other, more = _extend(judge, first, search_singles(judge, first))
            if other is not first and judge.cost(other) < judge.cost(best) and judge.is_accepted(start, other):
                best, beside = other, more
    if best is start:
        mistakes = [each for each in singles if each.reading.mistakes[-1].effect != SPRING]
        doubts = (each for each in _distinct(mistakes, tuning.beam) if judge.is_doubt(start, each))
        return Found(start, start, doubts=tuple(doubts), looks=judge.looks[0])
    extended, best = best, _merge_at_joints(judge, start, best)
    without, lists = _in_each_place(judge, start, best, singles)
    for _ in range(tuning.max_mistakes):
        better = _better_in_place(judge, without, lists, best)
        if better is None:
            break
        if better is start:
            return Found(start, start, looks=judge.looks[0])
        best = better
        without, lists = _in_each_place(judge, start, best, singles)
    if best is not extended:
        beside = search_singles(judge, best)
    rivals = tuple(_rivals(judge, without[place], best, place, each) for place, each in enumerate(lists))
    margins = tuple(_margin(judge, best, place, each) for place, each in enumerate(lists))
    return Found(start, best, without, rivals, margins, _undecided(judge, beside, best), looks=judge.looks[0])


def _extend(judge: ReadingJudge, trial: Trial, singles: list[Trial]) -> tuple[Trial, list[Trial]]:
    """Takes the best accepted mistake, one after the other; the last list of single mistakes beside it."""
    while len(trial.reading.mistakes) < judge.tuning.max_mistakes:
        accepted = next((each for each in singles if judge.is_accepted(trial, each)), None)
        if accepted is None:
            break
        trial = accepted
        singles = search_singles(judge, trial)
    return trial, singles


def _distinct(singles: list[Trial], count: int) -> list[Trial]:
    """The best ones, each effect once at a place and in a form."""
    out: dict[tuple[str, str], Trial] = {}
    for each in singles:
        out.setdefault(_name(each.reading.mistakes[-1]), each)
    return list(out.values())[:count]


def _in_each_place(
    judge: ReadingJudge, start: Trial, best: Trial, singles: list[Trial]
) -> tuple[tuple[Trial, ...], list[list[Trial]]]:
    """The readings that leave out one mistake of the best one, in their order, and what may stand in its place.

    singles: mistakes on top of the start.
    """
    without = _without_each(judge, start, best)
    return without, [singles] if len(without) == 1 else [search_singles(judge, each) for each in without]


def _without_each(judge: ReadingJudge, start: Trial, best: Trial) -> tuple[Trial, ...]:
    """The readings that leave out one mistake of the best one, in their order."""
    own = best.reading.mistakes
    if len(own) == 1:
        return (start,)
    others = [[each for each in own if each is not mistake] for mistake in own]
    return tuple(judge.trial(rebuild(judge, start.reading, each)) for each in others)


def _merge_at_joints(judge: ReadingJudge, start: Trial, best: Trial) -> Trial:
    """The reading with one mistake of a joint where it has several and one explains as much: the first was a part."""
    own = best.reading.mistakes
    places = [_place(each) for each in own]
    for place in dict.fromkeys(places):
        if places.count(place) == 1:
            continue
        others = [mistake for mistake in own if _place(mistake) != place]
        singles = search_singles(judge, judge.trial(rebuild(judge, start.reading, others)))
        merged = next((each for each in singles if _place(each.reading.mistakes[-1]) == place), None)
        if merged is not None and judge.fits_alike(merged, best):
            return _merge_at_joints(judge, start, merged)
    return best


def _place(mistake: Mistake) -> str:
    """Of a joint, its number; else the name of the mistake."""
    return mistake.label if mistake.joint is None else str(mistake.joint)


def _better_in_place(
    judge: ReadingJudge, without: tuple[Trial, ...], lists: list[list[Trial]], best: Trial
) -> Trial | None:
    """A reading that is better without a mistake, or with another in its place; a first step may have been wrong."""
    for parent, singles, mistake in zip(without, lists, best.reading.mistakes, strict=True):
        if not judge.is_accepted(parent, best, mistake):
            return parent
        nearest = (each for each in singles[: judge.tuning.beam] if each.loss < best.loss)
        other = next((each for each in nearest if judge.is_accepted(parent, each)), None)
        if other is not None:
            return other
    return None


def _rivals(judge: ReadingJudge, without: Trial, best: Trial, place: int, singles: list[Trial]) -> tuple[Trial, ...]:
    """Readings with another mistake at one place that fit as well as the best one. singles: beside the other ones."""
    out = {_name(best.reading.mistakes[place]): best}
    for each in singles:
        name = _name(each.reading.mistakes[-1])
        if name not in out and judge.fits_alike(each, best) and judge.is_accepted(without, each):
            out[name] = each
    return tuple(out.values())[1:]


def _margin(judge: ReadingJudge, best: Trial, place: int, singles: list[Trial]) -> float:
    """Standard errors by which the next best reading with another mistake at one place is worse, accepted or not."""
    own = _name(best.reading.mistakes[place])
    others = [each for each in singles if _name(each.reading.mistakes[-1]) != own]
    second = min(others, key=lambda each: each.loss, default=None)
    return math.inf if second is None else max(judge.gain(second, best).near.total_sigmas, 0.0)


def _name(mistake: Mistake) -> tuple[str, str]:
    """What is wrong and where, and in which form; its number does not count."""
    return mistake.label, mistake.form


def _undecided(judge: ReadingJudge, singles: list[Trial], best: Trial) -> tuple[int, ...]:
    """Joints whose zero may as well be a multiple of 90 degrees off."""
    out = set()
    for each in singles:
        mistake = each.reading.mistakes[-1]
        is_zero = mistake.effect == "encoder_offset"
        is_quarter = is_zero and abs(abs(mistake.value("offset")) % (np.pi / 2)) < 1e-9
        if is_quarter and judge.fits_alike(each, best):
            out.add(mistake.joint or 0)
    return tuple(sorted(out))


def rebuild(judge: ReadingJudge, reading: Reading, mistakes: Iterable[Mistake]) -> Reading:
    """The reading with mistakes taken back one after the other."""
    for mistake in mistakes:
        reading = table.take_back(reading, mistake, judge.recording)
    return reading
