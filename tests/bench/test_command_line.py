"""The command line answers at once, runs what it is told and writes whole results."""

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest
from click.testing import CliRunner

from armlab.cli.commands import MOVED, CommandTable
from armlab.cli.main import main

Armlab = Callable[..., "subprocess.CompletedProcess[str]"]
COLUMNS = "algorithm,minimum,average,standard_deviation,median,lower_quartile,upper_quartile,feasible_share,evaluations"


NOUNS = ("recording", "model", "bench", "paper", "proof", "tools")


@pytest.mark.parametrize("words", [(), *((noun,) for noun in NOUNS)], ids=" ".join)
def test_help_imports_nothing_heavy(words: tuple[str, ...]) -> None:
    command = [sys.executable, "-X", "importtime", "-m", "armlab.cli.main", *words, "--help"]
    imported = subprocess.run(command, capture_output=True, text=True, check=True).stderr
    names = {line.rsplit("|", 1)[-1].strip().split(".")[0] for line in imported.splitlines()}
    assert "click" in names
    assert not names & {"numpy", "pandas", "scipy", "matplotlib", "pydantic", "joblib", "yaml", "tqdm", "algorithms"}


def test_the_help_line_of_every_command_fits_into_a_terminal_of_eighty_columns() -> None:
    for group in ([], *([noun] for noun in NOUNS)):
        told = CliRunner().invoke(main, [*group, "--help"], terminal_width=80)
        assert told.exit_code == 0
        assert "..." not in told.output.partition("Options:")[2]


def test_the_first_screen_has_at_most_eighteen_commands() -> None:
    assert isinstance(main, CommandTable)
    assert len(main.places) <= 18
    assert {name for name, place in main.places.items() if not place} == set(NOUNS)


@pytest.mark.parametrize("name", MOVED)
def test_an_earlier_name_is_refused_in_one_line_with_what_to_write_now(name: str) -> None:
    done = CliRunner().invoke(main, [name, "--workers", "2"])
    assert (done.exit_code, done.stdout) == (2, "")
    assert done.stderr == f"armlab: `armlab {name}` is now `armlab {MOVED[name]}`\n"
    assert CliRunner().invoke(main, [*MOVED[name].split(), "--help"]).exit_code == 0


def test_a_misspelt_command_of_a_noun_is_refused_with_the_nearest() -> None:
    assert "Did you mean 'paper table3'?" in CliRunner().invoke(main, ["tabel3"]).stderr
    assert "Did you mean 'table3'?" in CliRunner().invoke(main, ["paper", "tabel3"]).stderr


def test_run_prints_the_table_and_the_winner_then_the_files(
    armlab_process: Armlab, small: Path, tmp_path: Path
) -> None:
    done = armlab_process("run", small)
    assert done.returncode == 0, done.stderr
    written = sorted(path.name for path in (tmp_path / "results").iterdir())
    assert written == ["small.csv", "small.md", "small.settings.yaml", "small_times.csv"]
    told, files = done.stdout.splitlines()[:-4], done.stdout.splitlines()[-4:]
    assert [Path(line).name for line in files] == ["small.csv", "small.md", "small_times.csv", "small.settings.yaml"]
    assert told[0].split()[:2] == ["algorithm", "median"]
    assert told[-1].endswith("3 repetitions are too few to tell any pair apart")
    lines = (tmp_path / "results" / "small.csv").read_text().splitlines()
    assert lines[0] == COLUMNS
    assert [line.split(",")[0] for line in lines[1:]] == ["spso", "de"]
    assert all(line.endswith(",1,25") for line in lines[1:])


def test_a_second_run_changes_no_byte_of_the_results(armlab: Armlab, small: Path, tmp_path: Path) -> None:
    armlab("run", small)
    first = {path.name: path.read_bytes() for path in (tmp_path / "results").iterdir()}
    armlab("run", small)
    assert {path.name: path.read_bytes() for path in (tmp_path / "results").iterdir()} == first


def test_fresh_computes_again_and_changes_the_times_alone(armlab: Armlab, small: Path, tmp_path: Path) -> None:
    armlab("run", small)
    first = {path.name: path.read_bytes() for path in (tmp_path / "results").iterdir()}
    armlab("run", small, "--fresh")
    second = {path.name: path.read_bytes() for path in (tmp_path / "results").iterdir()}
    assert {name for name in first if first[name] != second[name]} == {"small_times.csv"}


def test_dry_run_lists_the_trials_and_runs_nothing(armlab: Armlab, small: Path, tmp_path: Path) -> None:
    lines = armlab("run", small, "--dry-run", "--workers", "2").stdout.splitlines()
    assert lines[:3] == [
        "sphere: spso, swarm size 5, 25 evaluations: 3 repetitions, 0 done",
        "sphere: de, swarm size 5, 25 evaluations: 3 repetitions, 0 done",
        "6 trials, 0 done, 6 to do",
    ]
    assert lines[3].startswith("about 0.")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["small.yaml"]
    armlab("run", small)
    assert "6 trials, 6 done, 0 to do" in armlab("run", small, "--dry-run").stdout


def test_a_sweep_has_a_row_for_each_problem_and_swarm_size(armlab: Armlab, small: Path, tmp_path: Path) -> None:
    problems = "[{preset: sphere, dimension: 3}, {preset: sphere, dimension: 2, label: plane}]"
    text = small.read_text().replace("{preset: sphere, dimension: 3}", problems)
    small.write_text(text.replace("swarm_size: 5", "swarm_size: [5, 6]"))
    assert armlab("run", small).returncode == 0
    table = pd.read_csv(tmp_path / "results" / "small.csv")
    assert list(table.columns[:3]) == ["problem", "swarm_size", "algorithm"]
    assert len(table) == 2 * 2 * 2
    assert set(table["problem"]) == {"sphere", "plane"}
    assert list(table["evaluations"].unique()) == [25, 30]


def test_a_trial_that_raises_ends_the_run_with_exit_code_1_and_a_table_of_the_others(
    armlab: Armlab, small: Path, tmp_path: Path, plug_in: Callable[[str], Path]
) -> None:
    plug_in("raise ZeroDivisionError('of a third party')")
    small.write_text(small.read_text().replace("[spso, de]", "[plug-in, de]"))
    done = armlab("run", small, "--workers", "2")
    assert done.returncode == 1
    assert "3 trials failed" in done.stderr
    assert "ZeroDivisionError: of a third party" in done.stderr
    table = pd.read_csv(tmp_path / "results" / "small.csv").set_index("algorithm")
    assert table["feasible_share"].to_dict() == {"plug-in": 0.0, "de": 1.0}
    dry = armlab("run", small, "--dry-run")
    assert "6 trials, 3 done, 3 to do" in dry.stdout
    assert dry.returncode == 1
    assert "plug-in on" in dry.stderr


def test_what_a_plug_in_prints_does_not_stand_in_the_document(
    armlab_process: Armlab, small: Path, plug_in: Callable[[str], Path]
) -> None:
    plug_in("print('from a plug-in', flush=True)")
    small.write_text(small.read_text().replace("[spso, de]", "[plug-in]"))
    done = armlab_process("run", small, "--workers", "1", "--json")
    assert json.loads(done.stdout)["experiments"][0]["name"] == "small"
    assert "from a plug-in" in done.stderr


def test_a_plug_in_that_ends_its_process_fails_alone(
    armlab_process: Armlab, small: Path, plug_in: Callable[[str], Path]
) -> None:
    plug_in("__import__('os')._exit(7)")
    small.write_text(small.read_text().replace("[spso, de]", "[plug-in, de]"))
    done = armlab_process("run", small, "--workers", "1")
    assert done.returncode == 1
    assert "3 trials failed" in done.stderr
    small.write_text(small.read_text().replace("[plug-in, de]", "[de]"))
    assert "3 trials, 3 done, 0 to do" in armlab_process("run", small, "--dry-run").stdout


def test_list_names_algorithms_and_problems(armlab: Armlab) -> None:
    said = armlab("bench", "list").stdout
    assert "mupso, spso, woa, gwo, goa, de" in said
    assert "sphere" in said


def test_check_tells_an_algorithm_that_keeps_its_promises(armlab: Armlab) -> None:
    assert armlab("check", "de").stdout == "de keeps its promises\n"


def test_check_names_the_broken_promise(armlab: Armlab, plug_in: Callable[[str], Path]) -> None:
    plug_in("population = population[:1]")
    done = armlab("check", "plug-in")
    assert done.returncode == 1
    assert "PlugIn" in done.stderr or "plug-in" in done.stderr
    assert "Traceback" not in done.stderr


def test_a_reader_that_goes_away_is_no_traceback(small: Path) -> None:
    command = f"{sys.executable} -m armlab.cli.main bench list | true"
    done = subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=False)
    assert done.stderr == ""
