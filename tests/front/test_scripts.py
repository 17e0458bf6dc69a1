"""Commands for scripts and notebooks: one JSON document, no lines, the installation examined, results as HTML."""

import json
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import click
import pandas as pd
import pytest
from click.testing import CliRunner

import armlab
from armlab.cli import doctor
from armlab.cli.main import main
from armlab.cli.output import prints_result, tell_progress
from armlab.common.documents import FailedResultError, json_text
from armlab.common.markdown import latex_table
from armlab.diagnosis.formats import VerdictFile

EXPERIMENT = "{name: mine, problem: sphere, algorithms: [de], swarm_size: 5, evaluations: 20, repetitions: 2, seed: 1}"


def told(*words):
    """Exit status, standard output and standard error of a command."""
    result = CliRunner().invoke(main, [str(word) for word in words])
    assert result.exception is None or isinstance(result.exception, SystemExit), repr(result.exception)
    return result.exit_code, result.stdout, result.stderr


def document(*words):
    status, out, err = told(*words, "--json")
    assert (status, err) == (0, "")
    return json.loads(out)


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def folder(here, recording_folder):
    recording_folder(here / "rec")
    return here / "rec"


def test_a_document_has_null_for_numbers_that_json_cannot_hold():
    assert json.loads(json_text({"a": float("nan"), "b": [float("inf"), 1.5], "c": Path("x")})) == {
        "a": None,
        "b": [None, 1.5],
        "c": "x",
    }


def test_a_result_is_lines_or_one_document_or_nothing(monkeypatch):
    @click.command()
    @prints_result
    def toy():
        tell_progress("working")
        yield "a line"
        return {"answer": 42}

    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    assert CliRunner().invoke(toy).stdout == "a line\n"
    assert json.loads(CliRunner().invoke(toy, ["--json"]).stdout) == {"answer": 42}
    silent = CliRunner().invoke(toy, ["--quiet"])
    assert (silent.stdout, silent.stderr) == ("", "")


def test_a_failed_result_prints_its_document_and_then_fails():
    @click.command()
    @prints_result
    def toy():
        yield "what is wrong"
        raise FailedResultError("two things are wrong", {"wrong": 2}, status=1)

    result = CliRunner().invoke(toy, ["--json"])
    assert json.loads(result.stdout) == {"wrong": 2}
    assert isinstance(result.exception, FailedResultError)


def test_json_and_quiet_may_stand_before_the_command(folder):
    after = told("recording", "check", folder, "--json")
    assert told("--json", "recording", "check", folder) == after
    assert json.loads(after[1])["refused"] == []
    assert told("--quiet", "bench", "list") == (0, "", "")
    assert told("--json", "--quiet", "bench", "list") == told("bench", "list", "--json")


def test_a_command_without_a_document_refuses_json_before_its_name_too():
    status, out, err = told("--json", "proof", "run")
    assert (status, out) == (2, "")
    assert "Usage: main proof run" in err
    assert "No such option" in err


def test_a_mistake_leaves_the_standard_output_empty_and_its_line_on_the_error_output(here):
    status, out, err = told("identify", "nowhere", "--json")
    assert (status, out) == (2, "")
    assert err.count("\n") == 1
    assert err.startswith("armlab: ")


def test_the_harness_answers_in_json(here):
    (here / "mine.yaml").write_text(EXPERIMENT)
    planned = document("run", "mine.yaml", "--dry-run", "--workers", 1)["experiments"][0]
    assert (planned["name"], planned["trials"], planned["to_do"]) == ("mine", 2, 2)
    ran = document("run", "mine.yaml", "--workers", 1)["experiments"][0]
    assert ran["tables"]["mine.csv"][0]["algorithm"] == "de"
    assert all(Path(file).is_file() for file in ran["files"])
    assert document("bench", "compare", "mine.yaml", "mine.yaml")["comparisons"][0]["change"] == "="
    shared = document("bench", "share", "mine.yaml", "--as", "latex", "--out", "tex")
    assert Path(shared["files"][0]).read_text().startswith(r"\begin{tabular}{lrrrrrrrr}")
    assert "spso" in document("bench", "list")["algorithms"]
    assert len(document("model", "base-parameters", "irb120-arm")["sums"]) == 15


def test_identification_and_prediction_answer_in_json(folder):
    found = document("identify", folder, "--out", "out")
    assert found["model"]["schema"] == "model/1"
    assert [each["role"] for each in found["errors"]] == ["identify", "validate"]
    assert all(Path(file).is_file() for file in found["files"])
    predicted = document("predict", "out/model.yaml", folder)
    plain = [joint.pop("percent_plain") for each in found["errors"] for joint in each["joints"]]
    assert all(share > 0 for share in plain)
    assert not any(joint.pop("percent_plain") for each in predicted["errors"] for joint in each["joints"])
    assert predicted["errors"] == found["errors"]
    load = document("payload", folder, "--without", folder, "--link", 3, "--centre", 0, 0, 0.1)
    assert load["parameters"]["m"]["ci95"][0] <= load["parameters"]["m"]["value"]
    status, out, _ = told("predict", "out/model.yaml", folder, "--quiet")
    assert (status, out) == (0, "")


def test_a_check_with_a_refused_run_has_its_document_and_exit_status_2(folder):
    (folder / "validate.csv").write_text("t,q1\n")
    status, out, err = told("recording", "check", folder, "--json")
    assert status == 2
    assert [each["file"] for each in json.loads(out)["refused"]] == ["validate.csv"]
    assert "1 of the run files" in err


def test_an_import_answers_in_json(folder):
    flags = ["--robot", "irb120-arm", "--position", "q*", "--torque", "tau*", "--unit", "position=rad"]
    flags += ["--unit", "torque=N.m", "--unit", "time=s", "--out", "new"]
    imported = document("recording", "import", folder / "identify.csv", *flags)
    assert imported["columns"] == {"time": ["t"], "position": ["q1", "q2", "q3"], "torque": ["tau1", "tau2", "tau3"]}
    assert imported["runs"][0]["rows"] == 1200


def test_a_diagnosis_answers_with_its_verdict(folder):
    verdict = document("diagnose", folder, "--only-setup", "--out", "out")
    assert VerdictFile.model_validate_json(json.dumps(verdict)).status == verdict["status"]
    assert json.loads(Path("out/verdict.json").read_text()) == {
        key: value for key, value in verdict.items() if key != "files"
    }


def test_the_doctor_finds_this_installation_healthy(here):
    found = document("doctor")
    assert found["healthy"]
    names = {each["name"]: each["state"] for each in found["examined"]}
    assert {"Python", "numpy", "problem._kernel", "ARMLAB_RECORDINGS", "self-test of a search"} <= set(names)


def test_the_doctor_names_what_is_broken_with_exit_status_1(here, monkeypatch):
    monkeypatch.setattr(doctor, "KERNELS", {"problem._no_kernel": "nothing"})
    monkeypatch.setattr(doctor, "SELF_TESTS", {})
    status, out, err = told("doctor")
    assert status == 1
    assert "broken  problem._no_kernel: No module named 'problem._no_kernel'; `make install` compiles it" in out
    assert err == "armlab: broken: problem._no_kernel; the lines above say why\n"


@pytest.mark.parametrize(
    ("found", "wanted", "old"),
    [("2.0", ">=2", False), ("2", ">=2.0", False), ("1.9.3", ">=1.10", True), ("3.1", "", False)],
)
def test_a_version_is_too_old_below_the_wanted_one(found, wanted, old):
    assert doctor.is_too_old(found, wanted) == old


def test_an_unknown_command_is_refused_with_the_one_that_was_probably_meant(here):
    status, out, err = told("diagnos", "rec")
    assert (status, out) == (2, "")
    assert "No such command 'diagnos'. Did you mean 'diagnose'?" in err
    assert "Did you mean 'recording import'?" in told("import", "log.csv")[2]


def test_click_completes_commands_and_options_in_a_shell():
    words = {"_ARMLAB_COMPLETE": "bash_complete", "COMP_WORDS": "armlab diagnose --js", "COMP_CWORD": "2"}
    script = "from armlab.cli.main import main; main(prog_name='armlab')"
    command = [sys.executable, "-c", script]
    place = {"PYTHONPATH": str(Path(armlab.__file__).parents[1])}
    done = subprocess.run(command, env=place | words, capture_output=True, text=True, check=False)
    assert done.stdout.strip() == "plain,--json"


def test_results_of_an_experiment_and_a_prediction_show_tables_in_a_notebook(recording):
    columns = {"problem": "p<i>", "swarm_size": 5, "budget": 20, "algorithm": "de", "violation": 0.0}
    trials = pd.DataFrame({**columns, "repetition": [0, 1], "value": [1.0, 3.0], "evaluations": 20, "seconds": 0.1})
    html = armlab.ExperimentResult("mine", trials, ())._repr_html_()
    assert "<th>median</th>" in html
    assert "<td>de</td><td>1</td><td>2</td>" in html
    error = SimpleNamespace(run="a<b", role="identify", relative_percent=1.234, recorded_percent=2.0)
    html = armlab.Prediction(recording, (error,), {})._repr_html_()
    assert "<td>a&lt;b</td><td>identify</td><td>1.23 %</td><td>2.00 %</td>" in html


def test_a_table_of_latex_escapes_what_latex_would_take_for_a_command():
    assert latex_table(["a_b", "c"], [["50 %", r"x\y"]]).splitlines()[2:5] == [
        r"a\_b & c \\",
        r"\midrule",
        r"50 \% & x\textbackslash{}y \\",
    ]


@pytest.mark.parametrize("words", [("paper", "table3", "--dry-run"), ("run", "configs/figure3.yaml", "--dry-run")])
def test_a_command_takes_the_configurations_that_come_with_armlab_where_the_folder_has_none(words, here):
    status, out, err = told(*words)
    assert (status, err) == (0, "")
    assert out
    assert list(here.iterdir()) == []


def test_a_configuration_of_the_folder_goes_before_the_one_that_comes_with_armlab(here):
    (here / "configs").mkdir()
    (here / "configs" / "table3.yaml").write_text("name: 3")
    assert "name" in told("paper", "table3", "--dry-run")[2]
