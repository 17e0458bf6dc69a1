"""`armlab confusability`: the card of a planned motion, printed and written."""

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from armlab.diagnosis.verdict_files import write_texts
from armlab.effects.library import library
from diagnosis.confusability.card import VIEWS, confusability
from diagnosis.confusability.page import card_page
from diagnosis.confusability.picture import heat_map
from diagnosis.confusability.planned import planned_motions
from diagnosis.confusability.tables import as_csv, as_json, markdown, terminal_lines
from problem.arm import Arm
from problem.errors import InputError
from problem.robot_file import load_arm
from recordings.run import Array


def write_card(
    robot: str, trajectory: str, joints: int | None, noise: tuple[float, ...], out: Path | None
) -> Iterator[str]:
    """The card in lines, and as files where a folder is given; InputError, in one line, for what does not fit."""
    arm = load_arm(robot)
    if joints is not None:
        if joints > len(arm):
            raise InputError(f"--joints {joints}: {arm.name} has {len(arm)}")
        arm = arm.first(joints)
    motions = planned_motions(trajectory, arm)
    try:
        card = confusability(arm, motions, library(), _noise(noise, arm))
    except ValueError as error:
        raise InputError(f"{trajectory}: {error}") from None
    yield from terminal_lines(card)
    if out is not None:
        maps = {
            f"figures/{view}_joint{joint}.svg": heat_map(card, view, joint) + "\n"
            for view in VIEWS
            for joint in range(1, len(arm) + 1)
        }
        texts = {
            "confusability.html": card_page(card),
            "confusability.md": markdown(card),
            "confusability.csv": as_csv(card),
            "confusability.json": json.dumps(as_json(card), indent=1, allow_nan=False) + "\n",
        }
        write_texts(texts | maps, out)
        yield f"wrote {out}: {', '.join(texts)}, {len(maps)} pictures in figures"


def _noise(given: tuple[float, ...], arm: Arm) -> Array | None:
    """One number for all joints, or one a joint; None for the default."""
    if not given:
        return None
    if len(given) not in (1, len(arm)):
        raise InputError(f"--noise takes one number or {len(arm)}, one a joint, not {len(given)}")
    if min(given) <= 0:
        raise InputError("--noise should be above zero, in N m (N)")
    return np.broadcast_to(np.array(given, dtype=float), (len(arm),)).copy()
