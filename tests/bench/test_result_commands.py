"""The commands on results, as they are called from a shell."""

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from small_results import Ran

from armlab.cli.bench import compare, draw, share
from armlab.cli.experiments import report
from bench.config import read_experiment
from bench.plan import plan_trials
from bench.store import open_store
from bench.tables import convergence_table


@pytest.fixture
def shell(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> CliRunner:
    monkeypatch.chdir(tmp_path)
    return CliRunner()


def test_share_then_report_and_compare_need_no_store(shell: CliRunner, small_run: Ran, tmp_path: Path) -> None:
    arguments = [str(small_run.config), "--store", str(small_run.store)]
    done = shell.invoke(share, [*arguments, "--out", "tables"], catch_exceptions=False)
    assert done.exit_code == 0
    assert "tables/trials.csv" in done.output
    done = shell.invoke(report, ["tables"], catch_exceptions=False)
    assert done.output.endswith("\nresults/small_report.html\n")
    assert "repetitions are too few" in done.output or "Wilcoxon" in done.output
    assert (tmp_path / "results" / "small_report.html").exists()
    done = shell.invoke(compare, ["tables", "tables"], catch_exceptions=False)
    assert "6 not told apart" in done.output
    done = shell.invoke(draw, ["tables", "--out", "pictures", "--records", "none.json"], catch_exceptions=False)
    assert "pictures/small_ranking.svg" in done.output
    assert not (tmp_path / ".armlab").exists()
    done = shell.invoke(draw, ["tables", "--out", "printed", "--records", "none.json", "--as", "pdf"])
    assert done.exit_code == 0
    files = sorted(Path("printed").iterdir())
    assert files
    assert all(path.suffix == ".pdf" and path.read_bytes().startswith(b"%PDF") for path in files)
    assert not any(b"/Type3" in path.read_bytes() for path in files)
    done = shell.invoke(share, ["tables", "--as", "pdf", "--out", "printed"], catch_exceptions=False)
    assert done.output == "printed/small.pdf\n"
    assert Path("printed/small.pdf").read_bytes().startswith(b"%PDF")


def test_convergence_of_populations_that_shrink_or_restart_is_averaged_at_equal_evaluations(small_run: Ran) -> None:
    entries = [entry for entry in plan_trials(read_experiment(small_run.config), "test") if entry.problem == "sphere"]
    with open_store(small_run.store) as store:
        table = convergence_table(entries, store)
        ends = [store.get(entry.key).value for entry in entries if entry.algorithm == "l-shade"]
    rows = table[table["algorithm"] == "l-shade"]
    assert rows["evaluations"].iloc[[0, -1]].tolist() == [6, 60]
    assert (np.diff(rows["evaluations"]) < 6).any()
    assert rows["best_so_far"].iloc[-1] == pytest.approx(np.mean(ends))
