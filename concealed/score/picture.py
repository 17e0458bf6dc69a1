"""One case on its held-out run at one joint: the torque, and what is left of it before and after the diagnosis."""

from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from concealed.score.held_out import CUTOFF_HZ, HeldOut, rms
from concealed.score.style import BLACK, BLUE, GREY, ORANGE, SKY, figure_of
from recordings.run import Array

SIZE, DPI = (7.8, 4.9), 100
COLOURS = 48  # of the palette of a picture: a file of some 30 kB, and no difference that one could see
BAND = 2  # times the noise floor


def shown_joint(run: HeldOut, joint: int | None) -> int:
    """The joint to draw, from 0: the one asked for, else where the simulation as given misses most, in noise floors."""
    return int(np.argmax(rms(run.given) / rms(run.floor))) if joint is None else joint - 1


def draw(run: HeldOut, joint: int, title: str, with_friction: bool, path: Path) -> None:
    """Writes the picture of one joint, from 0, as a small PNG.

    with_friction: also what rigid links and plain friction, refitted, leave: where friction is in the background it
    hides all else.
    """
    figure, (above, middle, below) = figure_of(SIZE, rows=3)
    time, floor = run.time, float(rms(run.floor)[joint])
    above.plot(time, run.torque[:, joint], color=BLACK, lw=1.1, label="measured")
    above.plot(time, (run.torque - run.given)[:, joint], color=ORANGE, lw=1.0, ls="--", label="simulation as given")
    _residual(middle, time, run.given[:, joint], ORANGE, "simulation as given")
    _residual(middle, time, run.refit[:, joint], BLUE, "rigid links refitted", "--")
    if with_friction:
        _residual(below, time, run.friction[:, joint], SKY, "before: rigid links and\nplain friction refitted")
    if run.after is not None:
        _residual(below, time, run.after[:, joint], BLACK, "after: model of the verdict")
    else:
        below.text(0.5, 0.8, "the verdict came without a prediction", transform=below.transAxes, ha="center")
    for axes in (middle, below):
        axes.axhspan(-BAND * floor, BAND * floor, color=GREY, alpha=0.45, lw=0, zorder=0)
    below.fill_between(
        [], [], color=GREY, alpha=0.45, lw=0, label=f"noise floor, ±{BAND} rms of\nthe true model's {floor:.3g}"
    )
    figure.suptitle(title, fontsize=8, x=0.01, ha="left")
    for axes, what in ((above, "torque"), (middle, "left before"), (below, "left after")):
        axes.set_ylabel(f"{what}, N m", fontsize=8)
        axes.tick_params(labelsize=7.5)
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=7, frameon=False)
        axes.set_xlim(time[0], time[-1])
    below.set_xlabel(f"time in the held-out run, s (all low-passed at {CUTOFF_HZ:g} Hz)", fontsize=8)
    figure.align_ylabels()
    _write(figure, path)


def _residual(axes: Any, time: Array, residual: Array, colour: str, what: str, line: str = "-") -> None:
    error = float(np.sqrt(np.mean(residual**2)))
    axes.plot(time, residual, color=colour, lw=1.0, ls=line, label=f"{what},\nrms {error:.3g}")


def _write(figure: Any, path: Path) -> None:
    """With few colours, and nothing in the file that depends on the day."""
    from PIL import Image

    drawn = BytesIO()
    figure.savefig(drawn, format="png", dpi=DPI, metadata={"Software": None})
    drawn.seek(0)
    with Image.open(drawn) as image:
        image.convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE).save(path, optimize=True)
