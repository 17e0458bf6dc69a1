"""What `armlab next` writes: the designed motion in all forms of `armlab export`, the card and the picture."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import get_args

from bench.export.formats import FORMATS
from bench.export.sampled import sampled
from bench.files import write_whole
from diagnosis.next.card import content, lines
from diagnosis.next.design import Budget
from diagnosis.next.experiment import Experiment, design
from diagnosis.next.picture import picture
from diagnosis.next.prepare import Links
from problem.errors import InputError

NAMES = {"csv": "next.csv", "ros2": "next.ros2.yaml", "rapid": "next.mod"}


def next_lines(
    verdict: Path,
    robot: str,
    recording: Path | None,
    rivals: str | None,
    budget: Budget,
    links: str | None,
    rate_hz: float,
    out: Path,
) -> Iterator[str]:
    """Designs and writes the next experiment, and tells its card in lines; InputError for what cannot be used."""
    known: Links | None = next((each for each in get_args(Links) if each == links), None)
    experiment = design(verdict, robot, recording, rivals, budget, known)
    yield from lines(experiment)
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"cannot write into {out}: {error.strerror}") from None
    write_whole(out / "next.json", json.dumps(content(experiment), indent=1, allow_nan=False) + "\n")
    yield f"wrote {out / 'next.json'}"
    yield from _motion(experiment, rate_hz, out)


def _motion(experiment: Experiment, rate_hz: float, out: Path) -> Iterator[str]:
    """The files of the motion, where one helps; a form that the arm does not have is told and left out."""
    if experiment.problem is None or experiment.point is None:
        return
    trajectory = sampled(experiment.excitation, experiment.point, rate_hz, "next")
    for form, name in NAMES.items():
        try:
            text = FORMATS[form](trajectory)
        except InputError as error:
            yield f"left out {out / name}: {error}"
            continue
        write_whole(out / name, text)
        yield f"wrote {out / name}"
    write_whole(out / "next.png", picture(experiment))
    yield f"wrote {out / 'next.png'}"
