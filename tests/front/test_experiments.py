"""Experiments from Python: a dictionary, keywords, and functions of one's own without a file."""

import numpy as np
import pytest
from refusals import refusal

import armlab
from bench.errors import TrialsFailedError

KEYS = {"algorithms": ["spso", "random-search"], "repetitions": 8, "swarm_size": 10, "evaluations": 300, "seed": 3}
BOX = {"lower": [-5, -5], "upper": np.array([5, 5])}


def bowl(x):
    return float(((x - 1) ** 2).sum())


@pytest.fixture(autouse=True)
def _here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def run(**keys):
    return armlab.run_experiment(**{**KEYS, "workers": 1, **keys})


def test_a_dictionary_its_file_and_keywords_are_one_experiment(tmp_path):
    keys = {"name": "mine", "problem": "sphere", **KEYS}
    (tmp_path / "mine.yaml").write_text(str(keys).replace("'", ""))
    found = [armlab.run_experiment(each, workers=1) for each in (keys, "mine.yaml")]
    found.append(armlab.run_experiment(workers=1, **keys))
    assert all(each.trials["value"].equals(found[0].trials["value"]) for each in found)
    assert sorted(path.name for path in tmp_path.iterdir()) == [".armlab", "mine.yaml"]


def test_files_are_written_where_a_folder_is_given(tmp_path):
    result = run(problem="sphere", results="out")
    assert [file.name for file in result.files] == [
        "experiment.csv",
        "experiment.md",
        "experiment_times.csv",
        "experiment.settings.yaml",
    ]


def test_a_function_is_compared_without_any_file(tmp_path):
    result = run(problem=bowl, **BOX)
    assert list(result.trials["problem"].unique()) == ["bowl"]
    assert result.table.set_index("algorithm")["median"]["spso"] < 0.1
    (duel,) = result.duels.to_dict("records")
    assert (duel["subject"], duel["rival"], duel["winner"]) == ("spso", "random-search", "spso")
    assert duel["p_holm"] == pytest.approx(2**-7)
    assert repr(result).splitlines()[-1] == "  SPSO beats random-search (Wilcoxon, paired, Holm, 5 %)"
    assert list(tmp_path.iterdir()) == []


def test_functions_with_one_box_are_two_problems_with_results_of_their_own():
    problems = [{"preset": bowl, **BOX}, {"preset": lambda x: 3.0, "label": "flat", **BOX}]
    result = run(problem=problems, repetitions=2)
    ends = result.trials.groupby("problem")["value"].max()
    assert ends["flat"] == 3.0
    assert ends["bowl"] < 3.0


def test_a_function_runs_in_several_processes_with_the_same_results():
    assert run(problem=bowl, **BOX).trials["value"].equals(run(problem=bowl, **BOX, workers=2).trials["value"])


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"problem": bowl}, "problem is a function: give lower= and upper=, the ends of its box"),
        ({"problem": bowl, "lower": [1], "upper": [0]}, "each below its partner"),
        ({"problem": bowl, "bounds": [(-5, 5)]}, "give the box of a function as lower=[...] and upper=[...]"),
        ({"problem": lambda x: x, **BOX}, "function <lambda> should return a number for a point (2,), not array"),
        ({"problem": lambda x: -1.0, **BOX}, "function <lambda> is -1 in the middle of its box: add a constant"),
        (
            {"problem": bowl, **BOX, "results": "out"},
            "problem 'bowl' is a function, and nothing tells",
        ),
        (
            {"problem": "sphere", "algorithm": ["de"]},
            "unknown key 'algorithm' in the configuration",
        ),
        ({"problem": "sphere", "configuration": {"name": "a"}}, "give a configuration or its keys, not both"),
        ({"problem": "spere"}, "unknown preset 'spere': did you mean 'sphere'"),
    ],
)
def test_a_mistake_is_one_line_with_the_fix(keys, message):
    assert message in refusal(run, **keys)


def test_what_is_no_experiment_is_refused():
    assert "takes a YAML file, a dictionary of its keys, or the keys themselves" in refusal(armlab.run_experiment, 42)
    assert refusal(armlab.run_experiment).endswith("not nothing")


def test_an_error_in_a_function_fails_its_trials_with_its_place():
    def fails_outside(x):
        if abs(x).max() > 1:
            raise ZeroDivisionError("too far")
        return 1.0

    with pytest.raises(TrialsFailedError, match="ZeroDivisionError: too far"):
        run(problem=fails_outside, **BOX)
