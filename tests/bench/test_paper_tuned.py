"""Table 3, tuned: which claims hold follows from the judged ends, and from nothing else."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from armlab.common.errors import InputError
from bench.printed import read_printed
from bench.studies.paper.tuned import TunedEvidence, read_tuned_evidence, tuned_section
from bench.studies.tuning.judged import TUNED, JudgedRuns, count_wins, ends_table
from bench.studies.tuning.tuning_settings import TuningSettings, read_tuning

ROOT = Path(__file__).parents[2]
SIX = ("mupso", "spso", "woa", "gwo", "goa", "de")
REPETITIONS = 14  # with fewer, ties take a permutation test, which is slow


@pytest.fixture(scope="module")
def settings() -> TuningSettings:
    whole = read_tuning(ROOT / "configs" / "tune.yaml")
    sweep = whole.sweep and whole.sweep.model_copy(update={"values": (0.1, 0.2, 0.5)})
    algorithms = {name: whole.algorithms[name] for name in SIX}
    return whole.model_copy(update={"algorithms": algorithms, "judge": whole.judge[:2], "sweep": sweep})


def judged(settings: TuningSettings, **levels: float) -> JudgedRuns:
    """Ends of 20 for every label, but for those with a level; a percent more with each repetition."""
    runs = JudgedRuns(settings, pd.DataFrame())
    labels = [*runs.labels(tuned=False), *runs.labels(tuned=True), *runs.sweep_labels.values()]
    rows = [
        {
            "problem": problem,
            "swarm_size": 50,
            "budget": 1550,
            "algorithm": label,
            "repetition": repetition,
            "value": levels.get(label, 20.0 + place) * (1 + 0.01 * repetition),
            "violation": 0.0,
        }
        for problem in settings.judge
        for place, label in enumerate(labels)
        for repetition in range(REPETITIONS)
    ]
    return JudgedRuns(settings, pd.DataFrame(rows))


def section(runs: JudgedRuns) -> str:
    study = ROOT / "results" / "study"
    tables = (pd.read_csv(study / name) for name in ("study_mupso.csv", "study_mupso_duels.csv"))
    return "\n\n".join(tuned_section(TunedEvidence(runs, *tables), read_printed()))


def line_of(text: str, says: str) -> list[str]:
    (line,) = [line for line in text.splitlines() if line.startswith(f"| {says}")]
    return [cell.strip() for cell in line.split("|")[2:-1]]


def test_a_claim_that_fails_as_published_holds_where_tuned_mupso_beats_all(settings: TuningSettings) -> None:
    text = section(judged(settings, **{"mupso": 50.0, f"mupso{TUNED}": 5.0}))
    assert line_of(text, "MuPSO 'best minimized the problem'") == [
        *("minimum 50, rank 6 of 6", "does not hold"),
        *("minimum 5, rank 1 of 6", "holds"),
    ]
    assert line_of(text, "MuPSO 'dominated other algorithms'") == [
        *("better in 0, worse in 10 of 10 duels on 2 problems", "does not hold"),
        *("better in 10, worse in 0 of 10 duels on 2 problems", "holds"),
    ]
    assert "Tuned, MuPSO has place 1 of 6" in text


def test_only_the_speed_limits_with_which_mupso_beats_the_others_win(settings: TuningSettings) -> None:
    text = section(judged(settings, **{"mupso velocity_limit=0.1": 5.0, "mupso velocity_limit=0.2": 19.0}))
    assert "against the others as published it wins with 0.1, 0.2 (the best limit, 0.1, has place 1 (1.00), " in text
    nobody = section(judged(settings))
    assert nobody.count("it wins with none") == 2


def test_an_infeasible_end_is_the_worst_of_its_problem(settings: TuningSettings) -> None:
    runs = judged(settings, mupso=5.0)
    runs.frame.loc[runs.frame["algorithm"] == "mupso", "violation"] = 1.0
    assert count_wins(runs.subject_duels(tuned=False), "mupso") == (0, 10, 10)
    assert np.isinf(runs.medians().loc["mupso"]).all()


def test_ends_that_are_missing_or_of_another_form_are_told_with_the_command(
    settings: TuningSettings, tmp_path: Path
) -> None:
    study = ROOT / "results" / "study"
    with pytest.raises(InputError, match=r"cannot read .*tune_ends.csv, which `armlab bench tune` writes"):
        read_tuned_evidence(tmp_path, study)
    ends_table(judged(settings).frame).drop(columns="violation").to_csv(tmp_path / "tune_ends.csv", index=False)
    with pytest.raises(InputError, match="lacks the columns violation: `armlab bench tune` writes it anew"):
        read_tuned_evidence(tmp_path, study)
    with pytest.raises(InputError, match=r"cannot read .*study_mupso.csv, which `armlab paper study` writes"):
        read_tuned_evidence(tmp_path, tmp_path)
