"""The search for changes: candidates that are added, exchanged and taken out, and their rivals."""

from collections.abc import Sequence

import numpy as np

from armlab.common.arrays import Array
from armlab.common.told import MAX_CLASS_NAMES
from armlab.diagnosis.changes.changes import ChangeTable, Tested
from armlab.diagnosis.torque.columns.columns import place_of


def find_changes(table: ChangeTable, banned: frozenset[int] = frozenset()) -> tuple[Tested, ...]:
    """The changes that are sure, fitted together: added one by one, exchanged, taken out where others explain them.

    banned: groups that are no changes.
    """
    chosen: tuple[int, ...] = ()
    for _ in range(table.tuning.max_changes):
        added = _best_addition(table, chosen, banned)
        if added is None:
            break
        settled = _settle(table, (*chosen, added), banned)
        if set(settled) == set(chosen):
            break
        chosen = settled
    return table.test(chosen)


def _best_addition(table: ChangeTable, chosen: tuple[int, ...], banned: frozenset[int]) -> int | None:
    """The surest group beside chosen ones; None where none is sure."""
    gains = table.evidence(chosen)
    gains[list(banned)] = -np.inf
    asked = [int(number) for number in np.argsort(-gains)[: table.tuning.max_asked] if gains[number] > 0]
    tested = [table.test((*chosen, number))[-1] for number in asked]
    sure = [each for each in tested if table.is_sure(each)]
    if not sure:
        return None
    return max(sure, key=table.log_odds).group


def _settle(table: ChangeTable, chosen: tuple[int, ...], banned: frozenset[int]) -> tuple[int, ...]:
    """The groups, each in place of a worse one, without those that the others explain."""
    chosen = without_unsure(table, _with_single_laws(table, chosen, banned))
    for number in chosen:
        own = next((each for each in table.test(chosen) if each.group == number), None)
        if own is None:
            continue
        deficits = table.deficits(chosen, own)
        deficits[list(banned)] = np.inf
        best = int(np.argmin(deficits))
        if best != number and deficits[best] < 0:
            rest = tuple(each for each in chosen if each != number)
            exchanged = without_unsure(table, _with_single_laws(table, (*rest, best), banned))
            chosen = exchanged if best in exchanged else chosen
    return chosen


def without_unsure(table: ChangeTable, chosen: tuple[int, ...]) -> tuple[int, ...]:
    """Chosen groups without those that are not sure, the one of the least evidence first."""
    while chosen:
        tested = table.test(chosen)
        worst = min(tested, key=lambda each: each.evidence)
        if table.is_sure(worst):
            break
        chosen = tuple(each for each in chosen if each != worst.group)
    return chosen


def _with_single_laws(table: ChangeTable, chosen: tuple[int, ...], banned: frozenset[int]) -> tuple[int, ...]:
    """Laws of friction one by one where they did not change by one factor."""
    for number in chosen:
        group = table.groups[number]
        if not group.laws:
            continue
        laws = [place_of(law) for law, _ in group.laws]
        plain = [(other, each) for other, each in enumerate(table.groups) if not each.laws and not each.whole_law]
        single = [other for other, each in plain if place_of(each.candidate) in laws and other not in banned]
        if set(single) & set(chosen):
            chosen = tuple(dict.fromkeys((*(each for each in chosen if each != number), *single)))
    return chosen


def find_rivals(table: ChangeTable, chosen: Sequence[int], tested: Tested) -> tuple[tuple[int, float], ...]:
    """Groups that explain the difference nearly as well in the place of a chosen one, with their deficits."""
    deficits = table.deficits(chosen, tested)
    near = [int(each) for each in np.argsort(deficits) if deficits[each] < table.tuning.least_evidence]
    others = [(each, float(max(deficits[each], 0.0))) for each in near if each != tested.group]
    return tuple(others[: MAX_CLASS_NAMES - 1])


def held_out_errors(table: ChangeTable, chosen: Sequence[int], number: int) -> tuple[list[Array], list[Array]]:
    """Errors (rows,) of each joint without and with a change, each stretch predicted by the others."""
    everything = frozenset(chosen)
    return table.held_out_errors(everything - {number}), table.held_out_errors(everything)
