"""Which names are to be told apart: the rivals of a verdict, or those that a person named."""

from collections.abc import Sequence

from diagnosis.next.question import Name
from diagnosis.next.verdict_file import Finding, VerdictFile
from problem.errors import InputError
from recordings.vocabulary import EFFECT_IDS, effect_named

Asked = tuple[Name, ...]


def asked_of(verdict: VerdictFile, named: str | None) -> tuple[Asked, ...]:
    """Groups of names of which one is right, the finding first; InputError where there is nothing to decide.

    named: like `viscous_friction,time_delay` or `viscous_friction@2,coulomb_friction@2`.
    """
    if named:
        return (_named(verdict, named),)
    groups = [_distinct(finding) for finding in verdict.findings if finding.rivals]
    groups = [group for group in groups if len(group) > 1 and group[0].effect != "unknown"]
    unique = {frozenset(group): group for group in reversed(groups)}
    if not unique:
        raise InputError(
            f"{verdict.path}: no finding has rivals, so nothing is to be decided; --rivals a,b names what to tell apart"
        )
    return tuple(reversed(unique.values()))


def _distinct(finding: Finding) -> Asked:
    return tuple(dict.fromkeys((finding.name, *finding.rivals)))


def _named(verdict: VerdictFile, named: str) -> Asked:
    parts = [part.strip().partition("@") for part in named.split(",")]
    if len(parts) < 2:
        raise InputError(f"--rivals {named}: should be two names or more, like viscous_friction@2,time_delay")
    place = next((each.name.joint for each in verdict.findings if each.name.effect in {p[0] for p in parts}), None)
    return tuple(dict.fromkeys(_name(effect, joint, place, verdict) for effect, _, joint in parts))


def _name(effect: str, joint: str, place: int | None, verdict: VerdictFile) -> Name:
    if effect not in EFFECT_IDS or effect == "unknown":
        try:
            effect_named(effect)
        except ValueError as error:
            raise InputError(f"--rivals: {error}") from None
        raise InputError("--rivals: 'unknown' has no columns to design a motion for")
    if effect_named(effect).where == "robot":
        return Name(effect, None)
    if joint:
        if not joint.isdigit() or not 1 <= int(joint) <= max(len(verdict.noise), 1):
            raise InputError(f"--rivals {effect}@{joint}: the joint should be a number from 1 to {len(verdict.noise)}")
        return Name(effect, int(joint))
    own: Sequence[int | None] = [each.name.joint for each in verdict.findings if each.name.effect == effect]
    found = own[0] if own else place
    if found is None:
        raise InputError(f"--rivals: at which joint? write {effect}@2 for joint 2")
    return Name(effect, found)
