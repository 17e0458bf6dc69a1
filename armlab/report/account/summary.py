"""The verdict in three sentences: where the error comes from, how large that is, and what is gained and left."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from armlab.common.report.wording import count_of, format_number, join_words
from armlab.diagnosis.result import Diagnosis, JointFit, JointFriction
from armlab.diagnosis.torque.names.findings import FRICTION, STATED_SHARE, StatedCause
from armlab.diagnosis.torque.predict.parts import LINKS, UNKNOWN_CAUSE
from armlab.effects.library import effect_named
from armlab.effects.links import PAYLOAD_FACTS
from armlab.effects.words import place_in_words
from armlab.identification.torque_model import TorqueModel
from armlab.recordings.recording import ROLES
from armlab.report.account.account import Account, StatedFinding, account_of
from armlab.report.torque.sentences import claim_figures, model_in_words
from armlab.report.words import (
    LINKS_IN_WORDS,
    STARTED,
    claim_name,
    effect_in_words,
    format_fixed,
    format_percent,
    how_it_falls,
    is_negative_load,
    is_of_unknown_links,
    joint_unit,
)
from problem.joint_words import joint_in_words, joints_in_words, links_in_words

MAX_SENTENCES, MAX_WORDS = 3, 70  # of a summary
MAX_FIRST_WORDS = 30  # of its first sentence
MAX_FIGURES = 3  # in its second sentence


def summary_of(diagnosis: Diagnosis) -> str:
    """How the recording is to be read where that is wrong, then the physics."""
    return " ".join(each for each in (reading_in_words(diagnosis), physics_in_words(diagnosis)) if each)


def reading_in_words(diagnosis: Diagnosis) -> str:
    """How the recording is to be read where that is wrong."""
    return " ".join(_reading_sentences(diagnosis))


def _reading_sentences(diagnosis: Diagnosis) -> tuple[str, ...]:
    """So few that the physics has a sentence at least, and room for it."""
    every = diagnosis.setup.sentences[: MAX_SENTENCES - 1] if diagnosis.setup else ()
    is_long = len(" ".join(every).split()) > MAX_WORDS - MAX_FIRST_WORDS
    return every[:1] if is_long and diagnosis.fit else every


def physics_in_words(diagnosis: Diagnosis) -> str:
    """As many sentences and words as the reading leaves; of a recording without a model, why there is none."""
    return " ".join(sentences_of(diagnosis)) if diagnosis.fit else diagnosis.reason


def sentences_of(diagnosis: Diagnosis) -> tuple[str, ...]:
    """The sentences of the physics, as many as the reading leaves, the first one the most important."""
    most = MAX_SENTENCES - len(_reading_sentences(diagnosis))
    if diagnosis.unnamed is not None and diagnosis.model is not None:
        return _describe_unnamed(diagnosis.unnamed, diagnosis.model)[:most]
    account = account_of(diagnosis)
    if not diagnosis.claims:
        worst = max((each.after for each in diagnosis.fit), default=0.0)
        model = model_in_words(diagnosis.simulation)
        return (f"Nothing is missing: {model} explains the recording down to its noise (at most {worst:.3g} N m).",)
    if not account.findings:
        small, change = count_of(len(account.minor), "small difference"), "change" if account.minor[1:] else "changes"
        first = f"Nothing of practical size is missing: {small} {change} no held-out error by 5 %."
        return (first, _rest(account, diagnosis))[:most]
    return _Writer(diagnosis, account).sentences(most)


def _rest(account: Account, diagnosis: Diagnosis) -> str:
    """What is left at the joint where that is the largest share of its torque."""
    worst = max(account.left, key=lambda each: each.share_of_torque)
    arm = diagnosis.simulation.arm
    size = f"{format_fixed(worst.rms)} {joint_unit(arm, worst.joint - 1)}"
    usual = "as real arms leave" if worst.usual else "more than real arms leave"
    where = f"{joint_in_words(arm, worst.joint)}, {size}"
    return f"What is left is at most {format_percent(worst.share_of_torque)} of the torque ({where}), {usual}."


@dataclass(frozen=True, eq=False)
class _Writer:
    diagnosis: Diagnosis
    account: Account

    def sentences(self, most: int) -> tuple[str, ...]:
        """Where the error comes from, then what is left, then the sizes in between, as far as there is room."""
        first, last = self._where(), self._gain()
        if most < MAX_SENTENCES:
            return (first, last)[:most]
        left = MAX_WORDS - len(first.split()) - len(last.split())
        shown = list[str]()
        for each in self._figures():
            longer = [*shown, each]
            if len(longer) > MAX_FIGURES or len("; ".join(longer).split()) > left:
                break
            shown = longer
        size = "; ".join(shown)
        return tuple(each for each in (first, f"{size[:1].upper()}{size[1:]}." if size else "", last) if each)

    def _where(self) -> str:
        """The leading causes with their shares; a share of several is never 100 %."""
        first, *others = self.account.leading
        most = 100 - max(round(100 * sum(each.share for each in others)), 1) if others else 100
        share = min(round(100 * first.share), most)
        is_alone = len(self.account.causes) > 1 and not others and share == 100
        amount = "More than 99" if is_alone else "Less than 1" if share < 1 else str(share)
        starts = [f"{amount} % of the error comes from", *(f"{100 * each.share:.0f} % from" for each in others)]
        forms = [
            (f"{start} {cause_name(each, self.account.findings_of(each))}", f"{start} {self.cause_in_words(each)}")
            for start, each in zip(starts, self.account.leading, strict=True)
        ]
        unexplained = open_share(self.account)
        if unexplained > 1 - STATED_SHARE:
            forms.append((f"{100 * unexplained:.0f} % cannot be named",) * 2)
        return f"{list_while_short(forms)}."

    def cause_in_words(self, cause: StatedCause) -> str:
        """The cause with its place: by its name where its findings have one."""
        own = self.account.findings_of(cause)
        name, place = cause_name(cause, own), cause_place(self.diagnosis, cause, own)
        if cause.cause == LINKS:
            return f"{name} of {place or 'the links'}"
        return f"{name} at {place}" if place else name

    def _figures(self) -> Iterator[str]:
        for cause in self.account.leading:
            yield from self._friction_figures(cause)
            if cause.cause not in (FRICTION, UNKNOWN_CAUSE):
                yield from self._other_figures(cause)

    def _friction_figures(self, cause: StatedCause) -> Iterator[str]:
        sizes = friction_sizes(self.diagnosis, self.account, cause)
        if len(sizes) == 1:
            yield f"friction is {sizes[0]}"
        elif sizes:
            yield f"friction at higher speeds is {' to '.join(sizes)}"

    def _other_figures(self, cause: StatedCause) -> Iterator[str]:
        largest = self.account.findings_of(cause)[:1]
        for each in largest:
            numbers, arm = claim_figures(each.claim, self.diagnosis.simulation), self.diagnosis.simulation.arm
            if not numbers:
                continue
            if each.claim.effect == PAYLOAD_FACTS.id:
                mass = numbers.split(" at ")[0]
                yield f"{'it lacks' if is_negative_load(each.claim) else 'the load is'} {mass}"
                continue
            place = place_in_words(arm, each.claim.effect, each.claim.joint, each.claim.joints)
            name = LINKS_IN_WORDS if cause.cause == LINKS else effect_in_words(each.claim.effect)
            yield f"{name} {'of' if cause.cause == LINKS else 'at'} {place}: {numbers}"

    def _gain(self) -> str:
        """How far the held-out error falls where it falls most, and what that leaves of the torque.

        Of a model that does not carry over, what it leaves of the variation of both, and what to do.
        """
        if not self.diagnosis.carries_over:
            fitted, held_out = (format_percent(self.diagnosis.left[role]) for role in ROLES)
            return (
                f"Of the variation of the torque the model leaves {fitted} where it was fitted, and {held_out} where "
                "it was not: record longer runs in which all joints move."
            )
        fit, before = self._largest_fall()
        arm, unit = self.diagnosis.simulation.arm, joint_unit(self.diagnosis.simulation.arm, fit.joint - 1)
        left = next((each for each in self.account.left if each.joint == fit.joint), None)
        of = "torque" if unit == "N m" else "force"
        share = "" if left is None else f" ({format_percent(left.share_of_torque)} of its {of})"
        falls = how_it_falls(arm, fit.joint, fit.after < before)
        return (
            f"On held-out data the error of {STARTED[self.diagnosis.simulation.kind]} {falls}: "
            f"from {format_fixed(before)} to {format_fixed(fit.after)} {unit}{share}."
        )

    def _largest_fall(self) -> tuple[JointFit, float]:
        """The joint of a finding at which the error falls by most N m (N), and the error that it starts at."""
        start = errors_at_start(self.diagnosis)
        joints = {each.claim.evidence.joint for each in self.account.findings}
        fits = [each for each in self.diagnosis.fit if each.joint - 1 in joints]
        best = max(fits, key=lambda each: start[each.joint - 1] - each.after)
        return best, float(start[best.joint - 1])


def list_while_short(forms: Sequence[tuple[str, str]]) -> str:
    """As many parts as MAX_FIRST_WORDS allow, then as many of them as these allow in their longer form.

    forms: a short and a longer form of each part; the first part stands there at any length.
    """

    def is_short(parts: Sequence[str]) -> bool:
        return len(" ".join(parts).split()) <= MAX_FIRST_WORDS

    parts = [short for short, _ in forms]
    while len(parts) > 1 and not is_short(parts):
        parts.pop()
    for number, (_, longer) in enumerate(forms[: len(parts)]):
        tried = [*parts[:number], longer, *parts[number + 1 :]]
        parts = tried if is_short(tried) or len(parts) == 1 else parts
    return ", ".join(parts)


def cause_name(cause: StatedCause, own: Sequence[StatedFinding]) -> str:
    """What is wrong, by the names of its findings where these are sure and few."""
    if cause.cause == UNKNOWN_CAUSE:
        return "something without a name"
    if cause.cause == LINKS:
        return _name_of_links(own)
    return _name_of_friction(own) if cause.cause == FRICTION else _name_of(own)


def cause_place(diagnosis: Diagnosis, cause: StatedCause, own: Sequence[StatedFinding]) -> str:
    """The joints or links of a cause; empty for the whole arm, and for links of which the data do not tell."""
    arm = diagnosis.simulation.arm
    joints = sorted({each.claim.joint for each in own if each.claim.joint is not None})
    if cause.cause != LINKS:
        return joints_in_words(arm, joints) if joints else ""
    return "" if all(is_of_unknown_links(each.claim) for each in own) else links_in_words(arm, joints)


def friction_sizes(diagnosis: Diagnosis, account: Account, cause: StatedCause) -> tuple[str, ...]:
    """The friction of a cause: of one joint at both speeds, of several the least and the most at their higher speeds.

    Also where friction stands behind play; empty where none is known to be there.
    """
    arm = diagnosis.simulation.arm
    joints = {each.claim.joint for each in account.findings_of(cause) if each.is_friction}
    own = (each for each in account.friction if each.joint in joints and each.interval[1][0] > 0)
    rows = sorted(own, key=lambda each: each.torque[1])
    if not rows:
        return ()
    low, high = rows[0], rows[-1]
    if low is high:
        unit = joint_unit(arm, high.joint - 1)
        pairs = zip(friction_in_words(high, unit), high.speeds, strict=True)
        return (join_words([f"{size} at {format_speed(at, unit)}" for size, at in pairs]),)
    return tuple(
        f"{format_number(each.torque[1])} {joint_unit(arm, each.joint - 1)} ({joint_in_words(arm, each.joint)})"
        for each in (low, high)
    )


def friction_in_words(friction: JointFriction, unit: str) -> tuple[str, ...]:
    """Its size at both speeds; its upper bound where it may be none, because no friction drives a joint."""
    return tuple(
        f"{format_fixed(size)} {unit}" if low > 0 else f"at most {format_fixed(max(high, 0.0))} {unit}"
        for size, (low, high) in zip(friction.torque, friction.interval, strict=True)
    )


def open_share(account: Account) -> float:
    """The share of the error that no cause explains."""
    return 1 - sum(each.share for each in account.causes)


def errors_at_start(diagnosis: Diagnosis) -> Sequence[float]:
    """Held-out error of each joint, N m (N), of what is compared: the simulation as given, else the refitted links."""
    observed, given = diagnosis.observed, diagnosis.nominal
    if observed is None or given is None or diagnosis.simulation.kind == "refit":
        return [each.before for each in diagnosis.fit]
    out = []
    for joint in range(observed.joints):
        rows = observed.rows_held_out(joint)
        out.append(float(np.sqrt(np.mean(given[rows, joint] ** 2))))
    return out


def format_speed(speed: float, torque_unit: str) -> str:
    """`0.15 rad/s` of a joint with torque, `0.07 mm/s` of one with a force."""
    unit = "rad/s" if torque_unit == "N m" else "m/s"
    return f"{format_number(1000 * speed, 2)} m{unit}" if 0 < speed < 0.001 else f"{format_number(speed, 2)} {unit}"


def _name_of_friction(own: Sequence[StatedFinding]) -> str:
    """By its laws where all of them are sure and few: `Coulomb and viscous friction`, `too much viscous friction`."""
    laws = list(dict.fromkeys(claim_name(each.claim) for each in own))
    if any(each.statement.kind != "name" for each in own) or len(laws) > 2:
        return FRICTION
    return shorter_list(laws)


def shorter_list(names: Sequence[str]) -> str:
    """`Coulomb and viscous friction` of `Coulomb friction` and `viscous friction`."""
    if len(names) > 1 and all(name.endswith(f" {FRICTION}") for name in names):
        return f"{join_words([name.removesuffix(f' {FRICTION}') for name in names])} {FRICTION}"
    return join_words(list(names))


def _name_of_links(own: Sequence[StatedFinding]) -> str:
    if len(own) == 1 and own[0].claim.effect == PAYLOAD_FACTS.id and own[0].statement.kind == "name":
        return "less mass" if is_negative_load(own[0].claim) else effect_in_words(PAYLOAD_FACTS.id)
    return LINKS_IN_WORDS


def _name_of(own: Sequence[StatedFinding]) -> str:
    """Of findings with one effect: its name, the names of its class, or its name with a doubt."""
    first = own[0].statement
    if first.kind == "class":
        return join_words([effect_named(each).words for each in first.effects], "or")
    name = effect_named(first.effects[0]).words
    behind = f"{FRICTION} behind " if own[0].is_friction else ""
    return f"{behind}{name}{' (not certain)' if first.kind == 'cause' else ''}"


def _describe_unnamed(joint: JointFit, model: TorqueModel) -> tuple[str, str]:
    """What is known where a model predicts better and none of its parts is sure enough for a name."""
    parts = [model.structure.components[index] for index in sorted(model.unclaimed)]
    names = dict.fromkeys(effect_in_words(each.effect) for each in parts if each.joint == joint.joint)
    here, where = join_words(list(names)) if names else "the links as fitted", joint_in_words(model.arm, joint.joint)
    fall = f"from {format_fixed(joint.before)} to {format_fixed(joint.after)} {joint_unit(model.arm, joint.joint - 1)}"
    return (
        f"Something is missing at {where}, and these data cannot name it surely: with what the model holds "
        f"without a claim ({here}) the error on held-out data falls {fall}.",
        "Record longer motion with more reversals and speeds.",
    )
