"""What a verdict says, held against itself: no truth is needed to find that a sentence contradicts a number."""

import re
from collections.abc import Iterator
from itertools import pairwise

from armlab.diagnosis.formats import FindingEntry, VerdictFile
from armlab.effects.library import effect_named
from armlab.proof.open.real_folders.stated_names import SETUP

MAX_SENTENCES, MAX_WORDS, MAX_CAUSES, MAX_OF_JOINT = 3, 70, 4, 2
ROUNDING = 1e-6  # of shares and errors that are added up again
FIRST_SHARE = re.compile(r"^(\d+) % of the error comes from ")
UNIT = r"(?:N m|N|kg|%|mrad|rad|mm|m|s|ms|Hz|V|A|deg)"
NUMBER = re.compile(r"(?<![\w.])(?<!factor )[−-]?\d+(?:\.\d+)?(?![\w.]*\d)")
PLACE = re.compile(r"(?:joints?|links?|all) (?:\d+(?:, | and )?)+")  # numbers of joints have no unit


def contradictions(verdict: VerdictFile) -> tuple[str, ...]:
    """What a verdict of a recording with torque contradicts in itself, in a few words each; empty for a sound one."""
    return tuple(
        text for check in (_removals, _shares, _sentences, _numbers, _counts, _rest) for text in check(verdict)
    )


def _physics(verdict: VerdictFile) -> list[FindingEntry]:
    return [each for each in verdict.findings if each.kind != SETUP]


def _removals(verdict: VerdictFile) -> Iterator[str]:
    """A finding without which the held-out error is smaller."""
    for each in _physics(verdict):
        if each.heldout_rms_before < (1 - ROUNDING) * each.heldout_rms_after:
            yield f"without {each.effect}@{each.joint} the error falls"


def _shares(verdict: VerdictFile) -> Iterator[str]:
    """Shares of causes that exceed one, or are not those of their findings."""
    story = verdict.story or ()
    if sum(each.share_of_gap for each in story) > 1 + ROUNDING:
        yield "causes explain more than all of the error"
    for each in story:
        own = sum(verdict.findings[place].share_of_gap or 0.0 for place in each.findings)
        if abs(own - each.share_of_gap) > ROUNDING:
            yield f"findings of {each.cause} explain {own:.3f}, the cause {each.share_of_gap:.3f}"
    if any(one.share_of_gap < other.share_of_gap - ROUNDING for one, other in pairwise(story)):
        yield "causes are not in the order of their shares"


def _sentences(verdict: VerdictFile) -> Iterator[str]:
    """A summary that is long, says a sentence twice, or gives another share than the first cause has."""
    sentences = [each.strip() for each in re.split(r"(?<=[.?!])\s+(?=[A-Z0-9])", verdict.summary) if each.strip()]
    if len(set(sentences)) < len(sentences):
        yield "the summary says a sentence twice"
    if len(sentences) > MAX_SENTENCES or len(verdict.summary.split()) > MAX_WORDS:
        yield f"the summary has {len(sentences)} sentences and {len(verdict.summary.split())} words"
    told = FIRST_SHARE.search(verdict.summary)
    if told is not None and verdict.story and abs(int(told[1]) - 100 * verdict.story[0].share_of_gap) > 1:
        yield f"the summary tells {told[1]} %, the largest cause has {100 * verdict.story[0].share_of_gap:.0f} %"


def _numbers(verdict: VerdictFile) -> Iterator[str]:
    """Numbers of the summary that have no unit: in brackets stand intervals, whose unit is that of the value before.

    Where nothing was fitted the summary is the reason, which may hold names of files.
    """
    if not verdict.fit:
        return
    text = PLACE.sub("", re.sub(r"\([^()]*\)", "", verdict.summary))
    for found in NUMBER.finditer(text):
        rest = text[found.end() :]
        if not re.match(rf"\s*(?:{UNIT}\b|%|times\b|from|to [\d.]+|small difference|$)", rest):
            yield f"the summary has {found[0]} without a unit"


def _counts(verdict: VerdictFile) -> Iterator[str]:
    """More than a reader keeps in mind, and findings that are too improbable to be told."""
    told = [each for each in _physics(verdict) if not each.minor]
    places: dict[tuple[bool, int | None], int] = {}
    for each in told:
        key = effect_named(each.effect).where == "link", each.joint
        places[key] = places.get(key, 0) + 1
    yield from (f"{count} findings at {place[1]}" for place, count in places.items() if count > MAX_OF_JOINT)
    causes = [each for each in verdict.story or () if any(not verdict.findings[at].minor for at in each.findings)]
    if len(causes) > MAX_CAUSES:
        yield f"{len(causes)} causes are told"


def _rest(verdict: VerdictFile) -> Iterator[str]:
    """What is left that is not the error of the fit, or is less than its own noise."""
    errors = {each.joint: each.heldout_rms_after for each in verdict.fit}
    for each in verdict.left or ():
        if abs(each.rms - errors.get(each.joint, each.rms)) > ROUNDING * each.rms:
            yield f"{each.rms:.3g} is left at joint {each.joint}, its fit leaves {errors[each.joint]:.3g}"
        if each.noise > (1 + ROUNDING) * each.rms:
            yield f"the noise at joint {each.joint} is larger than what is left"
