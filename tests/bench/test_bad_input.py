"""Every mistake of a user is one clear line on the error output, and exit code 2."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from armlab.cli.main import main


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS", "VECLIB_MAXIMUM_THREADS"):
        monkeypatch.setenv(name, "1")


def _run(*arguments: object) -> Result:
    return CliRunner().invoke(main, ["run", *map(str, arguments), "--workers", "1"])


def _refusal(*arguments: object) -> str:
    result = _run(*arguments)
    assert result.exit_code == 2, result.output
    assert result.stdout == ""
    assert result.stderr.count("\n") == 1
    return result.stderr.strip()


@pytest.mark.parametrize(
    ("right", "wrong", "said"),
    [
        ("swarm_size", "swarmsize", "unknown key 'swarmsize' in small.yaml: did you mean 'swarm_size'?"),
        ("swarm_size: 5", "swarm_size: fifty", "should be a valid integer, not 'fifty'"),
        ("swarm_size: 5", "swarm_size: [5, 0]", "should be greater than or equal to 1, not 0"),
        ("swarm_size: 5", "swarm_size: []", "'swarm_size' in small.yaml"),
        ("swarm_size: 5", "swarm_size: [5, 5]", "'swarm_size' holds an entry twice"),
        ("seed: 1", "seed: .nan", "small.yaml, line 7: .nan is not a number"),
        ("seed: 1", "seed: 1.5", "'seed' in small.yaml: should be a valid integer"),
        ("seed: 1", "", "missing key 'seed' in small.yaml"),
        ("iterations: 4", "", "exactly one of 'iterations' and 'evaluations'"),
        ("iterations: 4", "iterations: 4\nevaluations: 25", "exactly one of 'iterations' and 'evaluations'"),
        ("iterations: 4", "evaluations: 4", "enough for one population"),
        ("name: small", "name: ../small", "'name' in small.yaml"),
        ("[spso, de]", "[spsoo, de]", "unknown algorithm 'spsoo': did you mean 'spso'?"),
        ("[spso, de]", "[de, de]", "'algorithms' holds an entry twice"),
        ("[spso, de]", "[]", "'algorithms' in small.yaml"),
        ("[spso, de]", "[{name: de, prams: {}}]", "unknown key 'prams' in small.yaml at algorithms[0]"),
        ("[spso, de]", "[{name: spso, params: {inertai: 1}}]", "did you mean 'inertia'?"),
        ("[spso, de]", "[{name: spso, params: {inertia: big}}]", "params of spso in small.yaml: should be"),
        ("preset: sphere", "preset: spere", "sphere"),
        ("dimension: 3", "dimensoin: 3", "unknown key 'dimensoin' in problem of small.yaml"),
        ("dimension: 3", "dimension: many", "'dimension' in problem of small.yaml: should be a valid integer"),
        ("{preset: sphere, dimension: 3}", "[3]", "'problem[0]"),
        ("seed: 1", "seed: 1\nbounds: clipp", "'bounds' in small.yaml: should be 'clip', 'reflect' or 'wrap'"),
        ("seed: 1", "seed: 1\noutput: convergence\nprinted: 1", "'printed' in small.yaml"),
        ("seed: 1", "seed: 1\noutput: convergence\nswarm_size: 6", "key 'swarm_size' stands there twice"),
        ("swarm_size: 5", "output: convergence\nswarm_size: [5, 6]", "should have one 'swarm_size'"),
    ],
)
def test_a_mistake_in_the_configuration(small: Path, right: str, wrong: str, said: str) -> None:
    assert right in small.read_text()
    small.write_text(small.read_text().replace(right, wrong))
    assert said in _refusal(small.name)


def test_a_missing_file() -> None:
    assert _refusal("missing.yaml") == "armlab: cannot read missing.yaml: No such file or directory"


def test_a_bomb(small: Path) -> None:
    layers = "\n".join(f"a{k + 1}: &a{k + 1} [*a{k}, *a{k}]" for k in range(60))
    small.write_text(f"a0: &a0 [1]\n{layers}\n")
    assert "aliases unfold" in _refusal(small.name)


def test_a_results_folder_that_is_a_file(small: Path) -> None:
    Path("results").touch()
    assert _refusal(small.name) == "armlab: cannot write to the results folder results: File exists"


@contextmanager
def _as_ordinary_user() -> Iterator[None]:
    """The superuser may write anywhere: for once, be someone who may not."""
    is_superuser = os.geteuid() == 0
    try:
        if is_superuser:
            os.seteuid(65534)
        yield
    finally:
        if is_superuser:
            os.seteuid(0)


def test_a_results_folder_that_is_read_only(tmp_path: Path) -> None:
    from armlab.common.errors import InputError
    from bench.files import check_folder

    folder = tmp_path / "results"
    folder.mkdir()
    for parent in [tmp_path, *list(tmp_path.parents)[:3]]:
        parent.chmod(0o755)
    folder.chmod(0o555)
    with _as_ordinary_user(), pytest.raises(InputError, match=r"cannot write to the results folder .*: Permission"):
        check_folder(folder, "small", "name: small\n")


def test_results_of_another_configuration_are_refused_unless_told_to_replace_them(small: Path) -> None:
    assert _run(small.name).exit_code == 0
    before = Path("results/small.csv").read_bytes()
    assert _run(small.name).exit_code == 0
    small.write_text(small.read_text().replace("seed: 1", "seed: 2"))
    assert _refusal(small.name) == (
        "armlab: results holds results of another configuration ('seed: 1' there, 'seed: 2' here): "
        "choose another folder with --results, or replace them with --overwrite"
    )
    assert Path("results/small.csv").read_bytes() == before
    assert _run(small.name, "--overwrite").exit_code == 0
    assert Path("results/small.csv").read_bytes() != before


def test_results_of_unknown_origin_are_refused(small: Path) -> None:
    Path("results").mkdir()
    Path("results/small.csv").write_text("precious")
    assert "results/small.csv stands without small.settings.yaml" in _refusal(small.name)
    assert Path("results/small.csv").read_text() == "precious"


def test_a_store_that_is_no_store(small: Path) -> None:
    Path("store").write_text("not a database" * 1000)
    assert _refusal(small.name, "--store", "store") == "armlab: cannot use the run store store: file is not a database"


def test_an_unknown_algorithm_to_check() -> None:
    result = CliRunner().invoke(main, ["check", "gow"])
    assert result.exit_code == 2
    assert "unknown algorithm 'gow': did you mean 'gwo'?" in result.stderr
