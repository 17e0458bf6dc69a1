"""Settings refuse what they do not know, and say in one line what would be right."""

from typing import Annotated, Any, Literal

import pytest
from pydantic import Field, ValidationError, field_validator

from armlab.common.errors import InputError
from armlab.common.settings import Settings, validate


class Trajectory(Settings):
    duration: float = 10.0
    kind: Literal["fourier", "circle"] = "fourier"

    @field_validator("duration")
    @classmethod
    def _positive(cls, value: float) -> float:
        if value <= 0:
            raise ValueError("should be above 0")
        return value


class Study(Settings):
    swarm_size: tuple[int, ...] = (50,)
    limit: Annotated[float, Field(allow_inf_nan=True)] = 1.0
    weight: float = 1.0
    trajectory: Trajectory = Trajectory()
    seed: int


def test_lists_become_tuples_and_whole_numbers_become_floats() -> None:
    study = validate(Study, {"seed": 1, "swarm_size": [10, 20], "trajectory": {"duration": 5}}, "study.yaml")
    assert study == Study(seed=1, swarm_size=(10, 20), trajectory=Trajectory(duration=5.0))


def test_settings_cannot_be_changed() -> None:
    with pytest.raises(ValidationError, match="frozen"):
        Trajectory().duration = 3.0


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ({"seed": 1, "swarmsize": 50}, "unknown key 'swarmsize' in study.yaml: did you mean 'swarm_size'?"),
        (
            {"seed": 1, "trajectory": {"dutation": 5}},
            "unknown key 'dutation' in study.yaml at trajectory: did you mean 'duration'?",
        ),
        ({"seed": 1, "trajectory": {"zz": 5}}, "unknown key 'zz' in study.yaml at trajectory: known: duration, kind"),
        ({"Seed": 1}, "unknown key 'Seed' in study.yaml: did you mean 'seed'?"),
        ({}, "missing key 'seed' in study.yaml"),
        ({"seed": 1.0}, "'seed' in study.yaml: should be a valid integer, not 1.0"),
        ({"seed": True}, "'seed' in study.yaml: should be a valid integer, not True"),
        ({"seed": 1, "weight": "3"}, "'weight' in study.yaml: should be a valid number, not '3'"),
        ({"seed": 1, "weight": float("inf")}, "'weight' in study.yaml: should be a finite number, not inf"),
        ({"seed": 1, "swarm_size": 50}, "'swarm_size' in study.yaml: should be a list, not 50"),
        (
            {"seed": 1, "swarm_size": [50, "x"]},
            "'swarm_size[1]' in study.yaml: should be a valid integer, not 'x'",
        ),
        (
            {"seed": 1, "trajectory": {"duration": -1}},
            "'trajectory.duration' in study.yaml: should be above 0, not -1",
        ),
        (
            {"seed": 1, "trajectory": {"kind": "spline"}},
            "'trajectory.kind' in study.yaml: should be 'fourier' or 'circle', not 'spline'",
        ),
        ([1], "study.yaml: should hold keys, not [1]"),
        ({"seed": 1, "trajectory": 3}, "'trajectory' in study.yaml: should hold keys, not 3"),
        (
            {"seed": "a", "weight": "b"},
            "'weight' in study.yaml: should be a valid number, not 'b' (and 1 more)",
        ),
    ],
)
def test_a_mistake_is_told_with_its_key_and_what_would_be_right(data: Any, message: str) -> None:
    with pytest.raises(InputError) as caught:
        validate(Study, data, "study.yaml")
    assert str(caught.value) == message


def test_a_field_may_allow_infinity() -> None:
    assert validate(Study, {"seed": 1, "limit": float("inf")}, "study.yaml").limit == float("inf")
