"""Published trajectories move as their sources say, and stand beside the records with their limits."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import yaml
from refusals import refusal

from armlab.common.settings import read_yaml, validate
from bench.studies.best_known.published import (
    CONFIG_FILE,
    PublishedFile,
    judge_published,
    write_published,
)
from bench.studies.best_known.records import RECORDS_FILE
from bench.studies.best_known.search import CONFIG_FILE as PLAN_FILE

ROOT = Path(__file__).parents[2]
CONFIG, PLAN, RECORDS = ROOT / CONFIG_FILE, ROOT / PLAN_FILE, ROOT / "results" / RECORDS_FILE
TRAJECTORIES = validate(PublishedFile, read_yaml(CONFIG), "test").trajectories


@pytest.fixture
def changed(tmp_path: Path) -> Callable[..., Path]:
    """Writes the Panda's trajectory alone, with some keys replaced."""

    def write(**keys: object) -> Path:
        content = read_yaml(CONFIG)["trajectories"]["panda-gaz-2019"] | keys
        path = tmp_path / "published.yaml"
        path.write_text(yaml.safe_dump({"trajectories": {"panda": content}}))
        return path

    return write


def test_the_panda_ends_where_its_source_recorded_the_robot() -> None:
    motion = TRAJECTORIES["panda-gaz-2019"].motion(3)  # the source stops after 20 s, half a period later again
    end = motion.position[0, 1] + motion.velocity[0, 1] / 4  # half a second along (1 + cos) / 2 to rest
    recorded = [-1.32274, -0.994886, 0.685102, -1.30046, 0.247636, 2.56445, -0.420697]  # exciting_traj_positions.txt
    assert end == pytest.approx(recorded, abs=1e-3)


def test_the_panda_begins_with_the_sum_of_its_sines() -> None:
    speeds = TRAJECTORIES["panda-gaz-2019"].motion(3).velocity[0, 0]
    assert speeds == pytest.approx([-0.6105, -1.1277, -0.2374, 0.7773, 0.4852, -0.1407, -0.8031])


def test_the_ur10e_begins_and_ends_at_rest_in_the_makers_home_pose() -> None:
    motion = TRAJECTORIES["ur10e-mamedov-2020"].motion(101)
    for end in (0, -1):
        assert motion.position[0, end] == pytest.approx(np.zeros(6), abs=1e-6)  # upright: 0, -90, 0, -90, 0, 0 degrees
        assert motion.velocity[0, end] == pytest.approx(np.zeros(6), abs=1e-8)
        assert motion.acceleration[0, end] == pytest.approx(np.zeros(6), abs=1e-8)


@pytest.mark.parametrize("name", TRAJECTORIES)
def test_speed_and_acceleration_are_the_derivatives_of_the_position(name: str) -> None:
    trajectory = TRAJECTORIES[name]
    motion, step = trajectory.motion(2_001), trajectory.duration / 2_000
    for value, rate in ((motion.position, motion.velocity), (motion.velocity, motion.acceleration)):
        assert (value[0, 2:] - value[0, :-2]) / (2 * step) == pytest.approx(rate[0, 1:-1], abs=1e-3)


def test_the_committed_pages_say_what_the_records_say(tmp_path: Path) -> None:
    for page in write_published(tmp_path / "published", RECORDS, CONFIG, PLAN):
        assert page.read_text() == (ROOT / "results" / "published" / page.name).read_text()


def test_published_trajectories_keep_the_limits_and_end_above_the_records() -> None:
    for judgement in judge_published(CONFIG, PLAN, RECORDS)[1]:
        assert max(judgement.limit_use.values()) <= 1
        assert judgement.value > max(judgement.best, judgement.same_family)


def test_a_broken_limit_is_said(changed: Callable[..., Path]) -> None:
    judgement = judge_published(changed(zero=[0, 0, 0, 2.0, 0, 0, 0]), PLAN, RECORDS)[1][0]
    assert judgement.limit_use["position"] > 1
    assert judgement.limit_use["speed"] < 1


def test_mistakes_are_refused_in_one_line(changed: Callable[..., Path], tmp_path: Path) -> None:
    assert "one row a joint" in refusal(judge_published, changed(zero=[0.0, 0.0]), PLAN, RECORDS)
    one = {"SI": "suite-2/ur10-all-si"}
    assert "should have the same columns" in refusal(judge_published, changed(problems=one), PLAN, RECORDS)
    other = changed(problems=one, same_family={"SI": "ur10-rest-50s-si"})
    assert "has 7 joints, 'unisa-ur10' has 6" in refusal(judge_published, other, PLAN, RECORDS)
    nothing = tmp_path / "nothing.json"
    assert "has no record of 'panda-13s-si'" in refusal(judge_published, changed(), PLAN, nothing)


def test_no_record_has_a_smaller_determinant_than_the_least_one_known() -> None:
    rows = [line.split(" | ") for line in (ROOT / "results" / "published" / "records.md").read_text().splitlines()]
    compared = [(float(row[2]), float(row[3])) for row in rows if len(row) == 10 and row[3][0].isdigit()]
    assert len(compared) >= 10
    assert all(least <= determinant for determinant, least in compared)
