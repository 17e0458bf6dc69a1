"""All pictures of a diagnosis, drawn once for the page and for the files beside it."""

from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from armlab.common.report.charts import draw_chart
from armlab.diagnosis.result import Claim, Diagnosis
from armlab.effects.library import effect_named
from armlab.report.account.account import account_of
from armlab.report.torque.arm_picture import JointMark, clearest_posture, draw_arm
from armlab.report.torque.motion_pictures import draw_motion, draw_motion_differences
from armlab.report.torque.residuals import ShownResiduals, space_rows
from armlab.report.torque.torque_pictures import (
    draw_errors,
    draw_errors_by_joint,
    draw_evidence,
    draw_located_errors,
    torque_charts,
)
from armlab.report.words import SOMETHING_UNKNOWN, claim_in_words

MAX_POSTURES = 100  # recorded ones, of which the most telling is drawn
MAX_LOCATED_JOINTS = 4  # joints whose error is drawn against every variable


@dataclass(frozen=True, eq=False)
class Gallery:
    """SVG pictures. motions: simulated anew; differences: from a reference; their texts say what they are."""

    data: ShownResiduals
    arm: Markup
    errors_by_joint: Markup
    torques: list[Markup]
    errors: list[Markup]
    evidence: list[tuple[Claim, Markup]]
    located: list[tuple[int, list[Markup]]]
    motions: list[Markup]
    motion_text: str
    differences: list[Markup]
    difference_text: str

    @property
    def files(self) -> dict[str, str]:
        """Names of the files and their content."""
        out: dict[str, str] = {"arm.svg": self.arm, "errors.svg": self.errors_by_joint}
        out |= {f"torque_joint{number}.svg": each for number, each in enumerate(self.torques, 1)}
        out |= {f"error_joint{number}.svg": each for number, each in enumerate(self.errors, 1)}
        for number, (claim, each) in enumerate(self.evidence, 1):
            out[f"finding{number}_{_file_name(claim.effect)}.svg"] = each
        for joint, pictures in self.located:
            out |= {f"where_joint{joint}_{number}.svg": each for number, each in enumerate(pictures, 1)}
        out |= {f"motion{number}.svg": each for number, each in enumerate(self.motions, 1)}
        return out | {f"difference_joint{number}.svg": each for number, each in enumerate(self.differences, 1)}


def draw_gallery(diagnosis: Diagnosis, data: ShownResiduals) -> Gallery:
    """Draws everything."""
    arm = diagnosis.simulation.arm
    postures = data.observed.kept("position")[space_rows(np.arange(data.observed.rows), MAX_POSTURES)]
    position = clearest_posture(arm, postures)
    whole = [claim_in_words(each.claim) for each in account_of(diagnosis).findings if each.claim.joint is None]
    worst = [each.joint for each in diagnosis.located[:MAX_LOCATED_JOINTS]]
    located = [(joint, draw_located_errors(diagnosis, data, joint - 1)) for joint in worst]
    motions, motion_text = draw_motion(diagnosis)
    differences, difference_text = draw_motion_differences(diagnosis)
    return Gallery(
        data,
        draw_arm(arm, position, joint_marks(diagnosis), whole),
        draw_errors_by_joint(diagnosis, data),
        [draw_chart(each.title, each.x, each.y, each.layers) for each in torque_charts(diagnosis, data)],
        draw_errors(diagnosis, data),
        [(claim, draw_evidence(diagnosis, data, claim)) for claim in diagnosis.claims],
        located,
        motions,
        motion_text,
        differences,
        difference_text,
    )


def joint_marks(diagnosis: Diagnosis) -> dict[int, JointMark]:
    """What was found at each joint, in the picture of the arm: what is stated, by its share of the error."""
    causes: dict[int, dict[str, None]] = {}
    for claim in (each.claim for each in account_of(diagnosis).findings):
        if claim.joint is not None:
            is_link = effect_named(claim.effect).where == "link"
            causes.setdefault(claim.joint, {})[f"{'link: ' if is_link else ''}{claim_in_words(claim)}"] = None
    return {joint: JointMark(tuple(names), SOMETHING_UNKNOWN in names) for joint, names in causes.items()}


def _file_name(effect: str) -> str:
    """An effect's id as part of a file name: a user's own may hold anything."""
    return "".join(letter if letter.isalnum() or letter == "_" else "_" for letter in effect)
