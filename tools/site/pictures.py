"""`python -m tools.site.pictures`: makes the pictures of README and tutorials anew, in docs/pictures/.

The tutorials and the comparison of the README are run as they stand, and their figures are taken; the first screen of
the tutorial's report is photographed in Chromium. Table 3 is drawn from results/table3.csv.
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
FROM_DOCUMENTS = {
    "docs/tutorials/csv.md": {
        "diagnosis.svg": "verdict/figures/torque_joint2.svg",
        "errors.svg": "verdict/figures/errors.svg",
        "report.png": "verdict/report.html",
    },
    "docs/tutorials/algorithm.md": {"ends.svg": "figures/comparison_ends.svg"},
    "README.md": {"convergence.svg": "results/mine_joint-fourier.svg"},
}


WINDOW = {"width": 1000, "height": 530}  # px: what a reader sees first
BROWSERS = ("chromium", "chromium-browser", "google-chrome")


def make_pictures() -> None:
    """Makes all pictures; those of a document in a folder of its own."""
    PICTURES.mkdir(exist_ok=True)
    for document, pictures in FROM_DOCUMENTS.items():
        with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
            for step in read_steps(ROOT / document):
                if document != "README.md" or "mine.yaml" in step.path + step.text:  # a tutorial has its other steps
                    print(step.path or step.text.splitlines()[0])
                    run_step(step)
            for name, place in pictures.items():
                if name.endswith(".png"):
                    photograph(Path(place).absolute(), PICTURES / name)
                else:
                    shutil.copyfile(place, PICTURES / name)
    (PICTURES / "table3.svg").write_bytes(draw_table3(pd.read_csv(ROOT / "results" / "table3.csv")))


def photograph(page: Path, picture: Path) -> None:
    """The first screen of a page as PNG."""
    from playwright.sync_api import sync_playwright

    browser_path = next(filter(None, map(shutil.which, BROWSERS)))
    with sync_playwright() as session:
        browser = session.chromium.launch(executable_path=browser_path, args=["--no-sandbox"])
        opened = browser.new_page(viewport=WINDOW)
        opened.goto(page.as_uri())
        opened.screenshot(path=picture)
        browser.close()


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
