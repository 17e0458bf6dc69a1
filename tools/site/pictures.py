"""`python -m tools.site.pictures`: makes the pictures of README and tutorials anew, in docs/pictures/.

The tutorials are run as they stand, and their figures are taken; Table 3 is drawn from results/table3.csv.
"""

import contextlib
import shutil
import tempfile
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from bench.figures import line_style, render_figure
from bench.printed import display_name, read_printed
from tools.site.examples import read_steps, run_step

ROOT = Path(__file__).parents[2]
PICTURES = ROOT / "docs" / "pictures"
FROM_TUTORIALS = {
    "csv.md": {"diagnosis.svg": "verdict/figures/torque_joint2.svg", "errors.svg": "verdict/figures/errors.svg"},
    "algorithm.md": {"ends.svg": "figures/comparison_ends.svg"},
}


def make_pictures() -> None:
    """Makes all pictures; those of a tutorial in a folder of its own."""
    PICTURES.mkdir(exist_ok=True)
    for document, pictures in FROM_TUTORIALS.items():
        with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
            for step in read_steps(ROOT / "docs" / "tutorials" / document):
                print(step.path or step.text.splitlines()[0])
                run_step(step)
            for name, place in pictures.items():
                shutil.copyfile(place, PICTURES / name)
    (PICTURES / "table3.svg").write_bytes(draw_table3(pd.read_csv(ROOT / "results" / "table3.csv")))


def draw_table3(table: pd.DataFrame) -> bytes:
    """SVG bytes: minimum, quartiles and median of each algorithm, beside the paper's minimum and average.

    table: as `results/table3.csv`.
    """
    printed = read_printed().table3.rows

    def fill(figure: Figure) -> None:
        axes = figure.subplots()
        places = np.arange(len(table))[::-1]
        ours, theirs = line_style(0).color, line_style(1).color
        axes.hlines(places + 0.1, table["minimum"], table["upper_quartile"], color=ours, linewidth=1)
        axes.hlines(places + 0.1, table["lower_quartile"], table["upper_quartile"], color=ours, linewidth=6, alpha=0.4)
        axes.plot(
            table["median"],
            places + 0.1,
            "o",
            color=ours,
            label="ours, algorithms as read here: minimum, quartiles, median",
        )
        rows = [printed[name] for name in table["algorithm"]]
        axes.plot([row.minimum for row in rows], places - 0.2, "<", color=theirs, label="paper: minimum")
        axes.plot([row.average for row in rows], places - 0.2, "D", color=theirs, mfc="none", label="paper: average")
        axes.set_yticks(places, [display_name(name) for name in table["algorithm"]])
        axes.set(xscale="log", xlabel="condition number of the best trajectory (logarithmic)")
        axes.set_xticks([5, 10, 20, 40], ["5", "10", "20", "40"])
        axes.minorticks_off()
        figure.legend(loc="outside lower center", ncols=2)

    return render_figure((7.2, 3.4), fill)["svg"]


if __name__ == "__main__":
    make_pictures()
