"""All pictures of a diagnosis, drawn once for the page and for the files beside it."""

from dataclasses import dataclass

import numpy as np

from armlab.diagnosis.result import Claim, Diagnosis
from diagnosis.report.arm_picture import Mark, arm_picture, telling_position
from diagnosis.report.difference_pictures import motion_differences
from diagnosis.report.evidence_picture import evidence_picture
from diagnosis.report.fit_pictures import error_pictures, errors_picture, torque_pictures
from diagnosis.report.located_picture import located_pictures
from diagnosis.report.motion_pictures import motion
from diagnosis.report.rows import Shown, spaced
from diagnosis.report.words import OF_LINKS, plain

POSTURES = 100  # recorded ones, of which the most telling is drawn
MOST_LOCATED = 4  # joints whose error is drawn against every variable


@dataclass(frozen=True, eq=False)
class Gallery:
    """SVG texts. motions: simulated anew; differences: from a reference; their texts say what they show, or why not."""

    data: Shown
    arm: str
    errors_by_joint: str
    torques: list[str]
    errors: list[str]
    evidence: list[tuple[Claim, str]]
    located: list[tuple[int, list[str]]]
    motions: list[str]
    motion_text: str
    differences: list[str]
    difference_text: str

    @property
    def files(self) -> dict[str, str]:
        """Names of the files and their content."""
        out = {"arm.svg": self.arm, "errors.svg": self.errors_by_joint}
        out |= {f"torque_joint{number}.svg": each for number, each in enumerate(self.torques, 1)}
        out |= {f"error_joint{number}.svg": each for number, each in enumerate(self.errors, 1)}
        for number, (claim, each) in enumerate(self.evidence, 1):
            out[f"finding{number}_{_file_name(claim.effect)}.svg"] = each
        for joint, pictures in self.located:
            out |= {f"where_joint{joint}_{number}.svg": each for number, each in enumerate(pictures, 1)}
        out |= {f"motion{number}.svg": each for number, each in enumerate(self.motions, 1)}
        return out | {f"difference_joint{number}.svg": each for number, each in enumerate(self.differences, 1)}


def gallery(diagnosis: Diagnosis, data: Shown) -> Gallery:
    """Draws everything."""
    arm = diagnosis.simulation.arm
    postures = data.observed.kept("position")[spaced(np.arange(data.observed.rows), POSTURES)]
    position = telling_position(arm, postures)
    whole = [plain(claim.effect) for claim in diagnosis.claims if claim.joint is None]
    worst = [each.joint for each in diagnosis.located[:MOST_LOCATED]]
    located = [(joint, located_pictures(diagnosis, data, joint - 1)) for joint in worst]
    return Gallery(
        data,
        arm_picture(arm, position, marks_of(diagnosis), whole),
        errors_picture(diagnosis, data),
        torque_pictures(diagnosis, data),
        error_pictures(diagnosis, data),
        [(claim, evidence_picture(diagnosis, data, claim)) for claim in diagnosis.claims],
        located,
        *motion(diagnosis),
        *motion_differences(diagnosis),
    )


def marks_of(diagnosis: Diagnosis) -> dict[int, Mark]:
    """What is said of each joint in the picture of the arm."""
    texts: dict[int, list[str]] = {}
    unknown: dict[int, bool] = {}
    for claim in diagnosis.claims:
        if claim.joint is not None:
            name = f"{plain(claim.effect)} (link)" if claim.effect in OF_LINKS else plain(claim.effect)
            texts.setdefault(claim.joint, []).append(name)
            unknown[claim.joint] = unknown.get(claim.joint, True) and claim.effect == "unknown"
    return {joint: Mark(_brief(found), unknown[joint]) for joint, found in texts.items()}


def _brief(names: list[str]) -> str:
    return names[0] if len(names) == 1 else f"{names[0]} + {len(names) - 1}"


def _file_name(effect: str) -> str:
    """An effect's id as part of a file name: a user's own may hold anything."""
    return "".join(letter if letter.isalnum() or letter == "_" else "_" for letter in effect)
