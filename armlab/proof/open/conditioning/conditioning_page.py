"""The page and the tables: `conditioning.md`, `conditioning.csv` and `conditioning_choices.csv`."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import pandas as pd

from armlab.common.markdown import markdown_page, markdown_table
from armlab.proof.open.conditioning.answer import CHOSEN_SHARE, MEAN, SIGNIFICANCE
from armlab.proof.open.conditioning.arm import SIMULATIONS, WINDOW_BLOCKS, ConditioningStudy
from armlab.proof.open.conditioning.correlation import PERMUTATIONS
from armlab.proof.open.conditioning.windows import BLOCKS

PAGE_NAME, TABLE_NAME, CHOICES_NAME, PICTURE_NAME = (
    "conditioning.md",
    "conditioning.csv",
    "conditioning_choices.csv",
    "conditioning.png",
)
SPECTRAL_NAMES = {
    "cond_si": "cond",
    "cond_unit": "cond (unit columns)",
    "d_optimality_si": "D",
    "d_optimality_unit": "D (unit columns)",
    "e_optimality_si": "E",
    "e_optimality_unit": "E (unit columns)",
}
FITTED = {f"fitted_{name}": shown for name, shown in SPECTRAL_NAMES.items()} | {"v_optimality": "V"}
LINKS = {f"links_{name}": shown for name, shown in SPECTRAL_NAMES.items()}
QUESTION = "fitted_cond_si"  # the criterion that the page asks about
ANSWERS = {
    "helps": "a small condition number goes with a small error.",
    "misleads": "a small condition number goes with a large error.",
    "cannot tell": "these recordings cannot tell.",
}
METHOD_TEXT = f"""\
The identification run of each recording passes the filters of `identify` as a whole (cut-off from its positions) and is
cut into {BLOCKS} equal blocks. A window is a choice of {", ".join(map(str, WINDOW_BLOCKS))} of them, so all windows of
one number of blocks are equally long, and their condition numbers differ. From each window ordinary least squares finds
the base parameters with viscous and Coulomb friction, rotor inertia and offset at each joint (for the KUKA the spring
of its counterbalance). *Error*: `||tau - tau_hat|| / ||tau||` over all joints in percent of the filtered torque, on
the runs that validate, which took no part.

Windows share blocks and are correlated: hundreds of windows of {BLOCKS} blocks are about {BLOCKS} observations. So the
p-value of a correlation is the share of {PERMUTATIONS} permutations of whole blocks that give one as large in size
(Krackhardt 1988), and its 95 % interval is a jackknife over blocks (Tukey 1958). With windows as observations, most
unrelated criteria would look significant (a test holds this). Neighbouring blocks are taken as exchangeable. p-values
of single arms are corrected over the arms (Holm 1979); those of the mean are not, and several criteria and lengths are
looked at. The mean is of these arms, its interval holds for no others. An answer needs a p-value below
{SIGNIFICANCE:g} and an interval without zero; else the recordings cannot tell. The second condition, which can only
withdraw answers, and the longest windows were added after a first look.

Criteria, the smaller the better: the condition number of the observation matrix W, D-optimality `-2 mean(log sigma)`,
E-optimality `-sigma_min`, each in SI units and with columns scaled to unit length in the window; and V-optimality
`trace(Z (W'W)^-1 Z')`, for which one must know the motion Z that will be predicted. A correlation of 1 says that the
criterion sorts the windows as their errors do.

*Simulated*: the same windows, with the torque of the model that the whole run gives and noise of the size and colour
of what that model leaves (random phases, the same at all joints; Prichard and Theiler 1994), in the run that identifies
and in those that validate: {SIMULATIONS} draws. There the model is true; what is left out of it on the real arm is not
in the simulation, nor is noise of the positions."""
LINKS_TEXT = """\
The paper's condition number is that of the links' columns alone. Friction is fitted all the same."""


def conditioning_page(studies: Sequence[ConditioningStudy], table: pd.DataFrame, choices: pd.DataFrame) -> str:
    """The whole page; every number comes from the tables."""
    parts = [*answer_lines(table, choices), f"![Errors and rank correlations]({PICTURE_NAME})", "## What was done"]
    parts += [METHOD_TEXT, setting_table(studies)]
    for blocks in WINDOW_BLOCKS:
        rows = table[table["blocks"] == blocks]
        parts += [
            f"## Windows of {blocks} of {BLOCKS} blocks",
            "Recorded torque: correlation (95 % interval), p of the permutations.",
            recorded_table(rows, FITTED),
            "Simulated torque: median (95 % of the draws). In bold how often a draw is as far from the median as the "
            "recorded torque is, where that is below 5 %: there the true model does not tell what happens on the arm.",
            simulated_table(rows, FITTED),
            LINKS_TEXT,
            recorded_table(rows, LINKS),
            f"Error in percent, median: of all windows, of the {CHOSEN_SHARE:.0%} that a criterion prefers, and of the "
            f"{CHOSEN_SHARE:.0%} with the least error.",
            choices_text(choices[choices["blocks"] == blocks]),
        ]
    return markdown_page("Does a small condition number help on real arms?", *parts)


def answer_lines(table: pd.DataFrame, choices: pd.DataFrame) -> Iterator[str]:
    """The answer, a paragraph for each length of the windows, and what choosing by the condition number is worth."""
    for blocks in WINDOW_BLOCKS:
        rows = table[(table["blocks"] == blocks) & (table["criterion"] == QUESTION)].set_index("arm")
        mean, arms = rows.loc[MEAN], rows.drop(index=MEAN)
        counts = ", ".join(f"{word} at {', '.join(found.index)}" for word, found in arms.groupby("verdict", sort=False))
        yield (
            f"**Windows of {blocks} of {BLOCKS} blocks: {ANSWERS[str(mean['verdict'])]}** Condition number and error "
            f"of the predicted torque have a mean rank correlation of {mean['correlation']:.2f} ({mean['low']:.2f} to "
            f"{mean['high']:.2f}; p {mean['p']:.2g}) over {len(arms)} arms. By arm: {counts}. With simulated torque of "
            f"a true model it is {mean['simulated']:.2f} ({mean['simulated_low']:.2f} to "
            f"{mean['simulated_high']:.2f}). " + _best_criterion(table[table["blocks"] == blocks])
        )
    yield _worth_sentence(choices)


def _worth_sentence(choices: pd.DataFrame) -> str:
    """How the error of the preferred windows compares with all windows and with the whole run."""
    rows = choices[choices["blocks"] == WINDOW_BLOCKS[0]].set_index("arm")
    preferred, whole = rows[QUESTION] / rows["all windows"], rows["whole run"] / rows["all windows"]
    by_arm = ", ".join(f"{arm} {preferred[arm]:.2f} ({whole[arm]:.2f})" for arm in rows.index)
    return (
        f"What it is worth: the tenth of the windows of {WINDOW_BLOCKS[0]} blocks with the least condition number has "
        f"this multiple of the median error of all of them (in brackets: the fit to the whole run): {by_arm}."
    )


def _best_criterion(rows: pd.DataFrame) -> str:
    means = rows[(rows["arm"] == MEAN) & rows["criterion"].isin(list(FITTED))].set_index("criterion")
    best = means.index[int(means["correlation"].argmax())]
    helpful = [FITTED[name] for name in FITTED if means.loc[name, "verdict"] == "helps"]
    return (
        f"The highest mean has {FITTED[best]} ({means.loc[best, 'correlation']:.2f}, p {means.loc[best, 'p']:.2g}); "
        f"on the mean of these arms help, not corrected for their number: {', '.join(helpful) or 'none'}."
    )


def setting_table(studies: Sequence[ConditioningStudy]) -> str:
    """What is identified from what, a row an arm."""
    rows = []
    for study in studies:
        for each in study.lengths:
            cond = each.criteria[QUESTION]
            rows.append(
                [
                    study.name,
                    f"{study.run_s:.1f}",
                    f"{each.window_s:.2f} ({each.windows.chosen} blocks)",
                    len(each.windows),
                    f"{study.cutoff_hz:.1f}",
                    f"{study.columns} ({study.base})",
                    f"{cond.min():.3g} to {cond.max():.3g}",
                    f"{each.errors.min():.1f} to {each.errors.max():.3g}",
                    f"{study.whole_error:.1f}",
                ]
            )
    headings = ["arm", "run s", "window s", "windows", "cut-off Hz", "columns (of links)"]
    return markdown_table([*headings, "condition number", "error %", "error of the whole run %"], rows)


def recorded_table(rows: pd.DataFrame, names: dict[str, str]) -> str:
    """Correlations with the recorded torque, a row an arm."""
    return _criteria_table(rows, names, _recorded_cell)


def simulated_table(rows: pd.DataFrame, names: dict[str, str]) -> str:
    """Correlations with simulated torque, a row an arm."""
    return _criteria_table(rows, names, _simulated_cell)


def _criteria_table(rows: pd.DataFrame, names: dict[str, str], cell: Callable[[Any], str]) -> str:
    lines = []
    for arm, found in rows.groupby("arm", sort=False):
        by_name = found.set_index("criterion")
        lines.append([str(arm), *(cell(by_name.loc[name]) for name in names)])
    return markdown_table(["arm", *names.values()], lines)


def _recorded_cell(row: Any) -> str:
    if pd.isna(row["correlation"]):
        return "–"
    return f"{row['correlation']:.2f} ({row['low']:.2f} to {row['high']:.2f}), {row['p_holm']:.2g}"


def _simulated_cell(row: Any) -> str:
    if pd.isna(row["simulated"]):
        return "–"
    text = f"{row['simulated']:.2f} ({row['simulated_low']:.2f} to {row['simulated_high']:.2f})"
    return text + (f", **{row['p_simulated']:.2g}**" if row["p_simulated"] < SIGNIFICANCE else "")


def choices_text(choices: pd.DataFrame) -> str:
    """What choosing by each criterion gets, a row an arm."""
    names = {name: FITTED.get(name, name) for name in choices.columns if name != "blocks"}
    rows = [[row["arm"], *(f"{row[name]:.2f}" for name in names if name != "arm")] for _, row in choices.iterrows()]
    return markdown_table(list(names.values()), rows)


def table_csv(frame: pd.DataFrame) -> str:
    """A table as text, four digits."""
    return str(frame.to_csv(index=False, float_format="%.4g", lineterminator="\n"))
