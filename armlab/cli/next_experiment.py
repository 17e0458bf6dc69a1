"""Write the next experiment: the designed motion in all forms of `armlab bench export`, the card and the picture.

Apart from the click commands, since it imports the diagnosis, and `armlab --help` imports all modules of commands.
"""

import json
from collections.abc import Callable
from pathlib import Path
from typing import get_args

from armlab.common.documents import ResultLines
from armlab.common.errors import InputError
from armlab.common.files import refuse_inputs, write_texts
from armlab.diagnosis.next.experiment import Experiment, design_experiment
from armlab.diagnosis.next.experiment_card import card_content, card_lines, draw_card
from armlab.diagnosis.next.motion import Budget
from armlab.diagnosis.next.prepare import LinkKnowledge
from bench.trajectory_files import TRAJECTORY_FORMATS, sample_trajectory
from problem.safe_motion import SafetySettings

CARD, PICTURE = "next.json", "next.png"
MOTION_FILES = {"csv": "next.csv", "ros2": "next.ros2.yaml", "rapid": "next.mod"}


def write_next_experiment(
    verdict: Path,
    robot: str,
    recording: Path | None,
    rivals: str | None,
    budget: Budget,
    links: str | None,
    safety: SafetySettings,
    rate_hz: float,
    out: Path,
    progress: Callable[[str], None] = lambda message: None,
) -> ResultLines:
    """Designs and writes the next experiment, and yields the lines of its card.

    progress: is told what is being done. Raises InputError for a file or an option that cannot be used.
    """
    refuse_inputs(
        (verdict, Path(robot)), (out / name for name in (CARD, PICTURE, *MOTION_FILES.values())), "the motion"
    )
    known_links: LinkKnowledge | None = next((each for each in get_args(LinkKnowledge) if each == links), None)
    experiment = design_experiment(verdict, robot, recording, rivals, budget, known_links, safety, progress)
    yield from card_lines(experiment)
    card = card_content(experiment)
    files: dict[str, str | bytes] = {CARD: json.dumps(card, indent=1, allow_nan=False) + "\n"}
    motion, left_out = _motion_files(experiment, rate_hz)
    written = write_texts(files | motion, out)
    yield from (f"wrote {path}" for path in written)
    yield from (f"left out {out / name}: {reason}" for name, reason in left_out.items())
    return card | {"files": written, "left_out": left_out}


def _motion_files(experiment: Experiment, rate_hz: float) -> tuple[dict[str, str | bytes], dict[str, str]]:
    """Files of the motion by name, none without a motion, and why a format cannot hold the motion of this arm."""
    if experiment.problem is None or experiment.point is None:
        return {}, {}
    trajectory = sample_trajectory(experiment.excitation, experiment.point, rate_hz, "next")
    files, left_out = dict[str, str | bytes](), dict[str, str]()
    for form, name in MOTION_FILES.items():
        try:
            files[name] = TRAJECTORY_FORMATS[form](trajectory)
        except InputError as error:
            left_out[name] = str(error)
    return {**files, PICTURE: draw_card(experiment)}, left_out
