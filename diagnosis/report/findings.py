"""The findings, each with its equation, numbers, evidence and rivals; then what stays unexplained."""

from html import escape

from armlab.diagnosis.result import Claim, Diagnosis
from diagnosis.report.gallery import Gallery
from diagnosis.report.html import bullets, paragraph, section
from diagnosis.report.tables import findings_table, meaning, parameter_table
from diagnosis.report.words import joint_unit, number, place, plain, probability, told


def findings(diagnosis: Diagnosis, gallery: Gallery) -> str:
    """Each finding with its equation, numbers, evidence and rivals; then what stays unexplained."""
    if not diagnosis.claims:
        return section("findings", "Findings", paragraph("Nothing was found that these data ask for."))
    parts = [_finding(diagnosis, claim, picture) for claim, picture in gallery.evidence]
    listed = findings_table(diagnosis)
    return section("findings", "Findings", listed, *parts, _unexplained(diagnosis))


def _finding(diagnosis: Diagnosis, claim: Claim, picture: str) -> str:
    evidence = claim.evidence
    size = joint_unit(diagnosis.simulation.arm, evidence.joint)
    gain = (
        f"Joint {evidence.joint + 1} on held-out data: {number(evidence.rms_before)} {size} without it, "
        f"{number(evidence.rms_after)} {size} with it (whitened, its variance is "
        f"{number(1 + evidence.gain)} times as large without it). "
        f"p-value {probability(evidence.corrected)} after correction for everything that was compared."
    )
    title = told(claim)
    about = meaning(claim.effect)
    return (
        f'<article class="finding"><h3>{escape(title[0].upper() + title[1:])}</h3>{paragraph(about, "pale")}'
        f"<p><code>{escape(claim.equation)}</code></p>"
        f'<div class="pair"><figure>{picture}</figure><div>{parameter_table(claim)}{paragraph(gain)}'
        f"{_rivals(claim)}{paragraph(_next(claim))}</div></div></article>"
    )


def _rivals(claim: Claim) -> str:
    if not claim.rivals:
        return paragraph("No other effect of the library fits these data as well.", "pale")
    lines = []
    for each in claim.rivals:
        why = "no motion of this arm can tell the two apart" if each.identical else (
            f"on this very motion it fits as well ({number(each.deficit)} units of log likelihood worse)"
        )  # fmt: skip
        lines.append(f"{plain(each.effect)}, {place(each.effect, each.joint, each.joints)}: {why}")
    return paragraph("It could also be:") + bullets(lines)


def _next(claim: Claim) -> str:
    return f"To tell: {claim.next_experiment}." if claim.next_experiment else ""


def _unexplained(diagnosis: Diagnosis) -> str:
    if not diagnosis.unexplained:
        return paragraph("No structure is left that a flexible surrogate could predict.", "pale")
    lines = [
        f"Joint {each.joint}: {100 * each.share:.0f} % of the held-out error variance depends on "
        f"{', '.join(name.replace('_', ' of joint ') for name in each.depends_on)}, and no effect of the library has "
        "that form. A surrogate of these variables is in the errors above, not in model.yaml."
        for each in diagnosis.unexplained
    ]
    return f"<h3>Unexplained</h3>{bullets(lines)}"
