"""How sure a finding may be that it is unknown: counted in judged sets, checked on the sets that have no part in it."""

import json
from pathlib import Path

import pandas as pd
import pytest
from click.testing import CliRunner

from armlab.cli.main import main
from armlab.diagnosis.torque.names.decide import unknown_limit
from armlab.proof.blind.score.rows import CLAIM_COLUMNS
from armlab.proof.blind.score.unknown_limit import UnknownLimit, check_limit, limit_of, read_claims


def claims_file(folder: Path, name: str, right: int, wrong: int) -> Path:
    """Claims of a set: findings without a name that are sure, one that is not, and sure names, all right."""

    def row(effect: str, category: str, probability: float | None) -> list[object]:
        return ["0a", "clean", "mujoco", "outside", effect, 1, category, 1, category == "injected", probability]

    rows = [row("unknown", "injected", 0.95)] * right + [row("unknown", "unknown", 1.0)] * wrong
    rows += [row("unknown", "unknown", 0.6), row("unknown", "injected", None)]
    rows += [row("payload", "injected", 0.95)] * 10 + [row("coulomb_friction", "background", 0.99)]
    path = folder / f"{name}.csv"
    pd.DataFrame(rows, columns=CLAIM_COLUMNS).to_csv(path, index=False)
    return path


def test_sure_findings_without_a_name_are_counted(tmp_path: Path) -> None:
    sets = [read_claims(claims_file(tmp_path, "a", 3, 1)), read_claims(claims_file(tmp_path, "b", 2, 2))]
    assert limit_of(sets) == UnknownLimit(findings=8, right=5)
    assert limit_of(sets).value == pytest.approx(0.6)
    assert UnknownLimit(0, 0).value == 0.5


def test_a_set_is_checked_with_the_limit_of_the_others(tmp_path: Path) -> None:
    one, other, unseen = (
        read_claims(claims_file(tmp_path, name, 3, wrong)) for name, wrong in (("a", 1), ("b", 3), ("c", 3))
    )
    scores = check_limit([one, other], [unseen])
    assert [(each.name, each.tier, each.checked) for each in scores] == [
        ("a", "clean", False),
        ("b", "clean", False),
        ("c", "clean", True),
    ]
    assert [each.limit for each in scores] == pytest.approx([4 / 8, 4 / 6, 7 / 12], abs=1e-4)
    for each in scores[1:]:
        stated, limited = each.stated["log_skill"].value, each.limited["log_skill"].value
        assert stated is not None
        assert limited is not None
        assert limited > stated  # sure findings without a name were wrong
        assert each.limited["log_skill"].number == 17  # names, and findings without one


def test_the_command_writes_the_limit_and_its_page(tmp_path: Path) -> None:
    paths = [str(claims_file(tmp_path, name, 3, 1)) for name in "abc"]
    command = ["proof", "calibrate-unknown", "--claims", paths[0], "--claims", paths[1], "--check", paths[2]]
    done = CliRunner().invoke(main, [*command, "--out", str(tmp_path / "out")])
    assert done.exit_code == 0, done.output
    assert "6 of 8 sure findings without a name were right: limit 0.70" in done.output
    content = json.loads((tmp_path / "out" / "unknown_limit.json").read_text(encoding="utf-8"))
    assert content == {
        "schema": "unknown-limit/1",
        "sets": ["a", "b"],
        "findings": 8,
        "right": 6,
        "limit": 0.7,
    }
    page = (tmp_path / "out" / "unknown.md").read_text(encoding="utf-8")
    assert "6 of 8 findings" in page
    assert "| c (marked) | clean |" in page


@pytest.mark.parametrize(
    ("content", "said"),
    [(None, "cannot read"), ("effect,joint\npayload,1\n", "lacks the columns"), ("", "cannot read")],
)
def test_what_is_no_table_of_claims_is_refused_in_one_line(content: str | None, said: str, tmp_path: Path) -> None:
    path = tmp_path / "claims.csv"
    if content is not None:
        path.write_text(content, encoding="utf-8")
    done = CliRunner().invoke(
        main, ["proof", "calibrate-unknown", "--claims", str(path), "--out", str(tmp_path / "out")]
    )
    assert done.exit_code != 0
    assert said in done.output
    assert len(done.output.strip().splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_one_set_cannot_be_left_out(tmp_path: Path) -> None:
    path = claims_file(tmp_path, "a", 3, 1)
    done = CliRunner().invoke(
        main, ["proof", "calibrate-unknown", "--claims", str(path), "--out", str(tmp_path / "out")]
    )
    assert "two judged sets or more" in done.output
    assert not (tmp_path / "out").exists()


def test_the_limit_that_is_shipped_is_a_probability() -> None:
    assert 0.5 < unknown_limit() < 0.9
