"""Findings in words, for the tables of random cases."""

from collections.abc import Sequence

from armlab.effects.library import EFFECT_IDS, effect_named
from armlab.proof.open.real_concealed.examine import ReportedFinding
from armlab.recordings.reading.words import NAMES as MISTAKE_NAMES
from armlab.report.words import effect_in_words


def finding_in_words(finding: ReportedFinding) -> str:
    """A finding with its place, by number as the plan of the concealed effects."""
    place = "the whole robot"
    is_mistake = finding.effect in MISTAKE_NAMES and finding.effect not in EFFECT_IDS
    if finding.joints:
        kind = "link" if not is_mistake and effect_named(finding.effect).where == "link" else "joint"
        place = f"{kind} {' from joint '.join(map(str, finding.joints[:2]))}"
    words = MISTAKE_NAMES[finding.effect] if is_mistake else effect_in_words(finding.effect)
    return f"{words}, {place}"


def list_findings(findings: Sequence[ReportedFinding]) -> str:
    """Findings in a cell."""
    return "; ".join(finding_in_words(each) for each in findings) or "–"
