"""What a finding means beside the control, in which nothing is concealed."""

from dataclasses import dataclass

from armlab.proof.open.real_concealed.conceal import (
    EQUIVALENT_AT_ONLY_JOINT,
    EQUIVALENT_NAMES,
    SoughtEffect,
)
from armlab.proof.open.real_concealed.examine import ExaminedCase, ReportedFinding

Findings = tuple[ReportedFinding, ...]


@dataclass(frozen=True)
class BesideControl:
    """What a finding means beside the control. joints: of the arm."""

    control: ExaminedCase
    joints: int

    def common_key(self, effect: str, joints: tuple[int, ...]) -> tuple[str, tuple[int, ...]]:
        """Effect and joints, equal for two names that nothing separates at a place."""
        one = EQUIVALENT_NAMES.get(effect, effect)
        return (EQUIVALENT_AT_ONLY_JOINT.get(one, one), ()) if self.joints == 1 else (one, joints)

    def findings_in_control(self, finding: ReportedFinding) -> list[ReportedFinding]:
        """What the control says of the same effect at the same place."""
        wanted = self.common_key(finding.effect, finding.joints)
        return [each for each in self.control.findings if self.common_key(each.effect, each.joints) == wanted]

    def is_in_control(self, finding: ReportedFinding) -> bool:
        """Whether the control says the same, its numbers within the intervals found here."""
        old = {size.name: size.value for each in self.findings_in_control(finding) for size in each.sizes}
        pairs = [(old[size.name], size.interval) for size in finding.sizes if size.name in old]
        return bool(self.findings_in_control(finding)) and all(
            span is None or span[0] <= value <= span[1] for value, span in pairs
        )

    def answers(self, finding: ReportedFinding, sought: SoughtEffect) -> bool:
        """Whether a finding has a name that is sought, at the place."""
        return self.common_key(finding.effect, finding.joints) in self.common_keys(sought)

    def common_keys(self, sought: SoughtEffect) -> set[tuple[str, tuple[int, ...]]]:
        """The same of all names that answer."""
        return {self.common_key(effect, sought.joints) for effect in (*sought.effects, *sought.identical)}

    def is_cancelled(self, sought: SoughtEffect, findings: Findings) -> bool:
        """Whether less should be left of what the control names there, and nothing of it is named now."""
        if any(self.answers(each, sought) for each in findings):
            return False
        for each in (each for each in self.control.findings if self.answers(each, sought)):
            for size in each.sizes:
                truth = sought.numbers.get(each.effect, {}).get(size.name)
                if truth is not None and abs(size.value + truth) < abs(size.value):
                    return True
        return False


def is_same_kind(finding: ReportedFinding, sought: SoughtEffect) -> bool:
    """Whether it is another law of a kind that is withheld at the joint."""
    return finding.effect in sought.laws and finding.joints == sought.joints
