"""Problems of third parties: found by name, refused in one line, and the tests that they inherit."""

import inspect
from collections.abc import Callable
from importlib.metadata import EntryPoint
from typing import Any, Literal

import numpy as np
import pytest
from refusals import refusal

from problem import registry
from problem.contract import Evaluation
from problem.contract_suite import ProblemContract
from problem.presets import FunctionSettings
from problem.registry import ENTRY_POINT_GROUP, SUITE_GROUP, instances, names, parse_problem, suites

Register = Callable[..., None]


class TestSphere(ProblemContract):
    settings = FunctionSettings(preset="sphere", dimension=3)


class _Restless:
    """A problem whose figures depend on the batch, and which writes into the points."""

    name = "restless"
    lower, upper = np.zeros(2), np.ones(2)

    def evaluate(self, points: Any) -> Evaluation:
        figures = points.sum(axis=1) + points.mean()
        points[...] = 0.5
        return Evaluation(figures, figures, np.zeros(len(points)))


class _RestlessSettings(FunctionSettings):
    preset: Literal["restless"] = "restless"

    def build(self) -> Any:
        return _Restless()


@pytest.fixture
def plug_ins(monkeypatch: pytest.MonkeyPatch) -> Register:
    """Pretend that other packages registered these problems."""

    def register(**values: str) -> None:
        entries = [EntryPoint(name, value, ENTRY_POINT_GROUP) for name, value in values.items()]
        monkeypatch.setattr(registry, "entry_points", lambda group: entries if group == ENTRY_POINT_GROUP else [])

    return register


def test_a_plug_in_is_listed_last_and_its_settings_are_read(plug_ins: Register) -> None:
    plug_ins(mine="problem.presets:FunctionSettings")
    assert names()[-1] == "mine"
    assert "'mine' in" not in refusal(parse_problem, {"preset": "mine", "dimension": 0.5}, "mine.yaml")
    assert "unknown key 'dimensions' in mine.yaml: did you mean 'dimension'?" in refusal(
        parse_problem, {"preset": "mine", "dimensions": 3}, "mine.yaml"
    )


@pytest.mark.parametrize("value", ["no_such_module_anywhere:X", "problem.presets:Missing"])
def test_a_broken_plug_in_is_named_and_troubles_no_other(plug_ins: Register, value: str) -> None:
    plug_ins(broken=value)
    assert parse_problem({"preset": "sphere"}, "mine.yaml").preset == "sphere"
    message = refusal(parse_problem, {"preset": "broken"}, "mine.yaml")
    assert message.startswith(f"mine.yaml: problem 'broken' ({value}) cannot be imported: ")


def test_a_plug_in_that_is_no_class_of_settings_is_refused(plug_ins: Register) -> None:
    plug_ins(odd="problem.functions:sphere")
    assert "should be a class of armlab.common.settings.Settings" in refusal(
        parse_problem, {"preset": "odd"}, "mine.yaml"
    )


def test_a_name_that_is_registered_twice_is_refused(plug_ins: Register) -> None:
    plug_ins(sphere="problem.presets:PaperSettings")
    assert names().count("sphere") == 1
    message = refusal(parse_problem, {"preset": "sphere"}, "mine.yaml")
    assert message == (
        "mine.yaml: preset 'sphere' is registered more than once: problem.presets:PaperSettings; it is built in"
    )


MINE = {"round": FunctionSettings(preset="sphere", dimension=3)}


def test_a_suite_of_a_plug_in_gives_its_problems_by_name_and_a_mistake_in_one_line(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    values = {
        "mine-1": f"{__name__}:MINE",
        "broken-1": "no_such_module_anywhere:X",
        "odd-1": "problem.functions:sphere",
    }
    entries = [EntryPoint(name, value, SUITE_GROUP) for name, value in values.items()]
    monkeypatch.setattr(registry, "entry_points", lambda group: entries if group == SUITE_GROUP else [])
    assert suites()[-3:] == ["broken-1", "mine-1", "odd-1"]
    assert instances("mine-1") == ["mine-1/round"]
    found = parse_problem({"preset": "mine-1/round", "shift_seed": 2}, "mine.yaml")
    assert found == FunctionSettings(preset="sphere", dimension=3, shift_seed=2)
    for preset, message in (
        ("mine-1/rond", "mine.yaml: suite 'mine-1' has no problem 'rond': did you mean 'round'?"),
        ("broken-1/x", "suite 'broken-1' (no_such_module_anywhere:X) cannot be imported: "),
        ("odd-1/x", "suite 'odd-1' (problem.functions:sphere) should map names to settings of problems"),
    ):
        assert refusal(parse_problem, {"preset": preset}, "mine.yaml").startswith(message)


def _test(name: str) -> Callable[[], None]:
    contract = type("Contract", (ProblemContract,), {"settings": _RestlessSettings()})()
    return dict(inspect.getmembers(contract, inspect.ismethod))[name]


@pytest.mark.parametrize(
    "name",
    ["test_a_point_has_the_same_figures_to_the_bit_in_any_batch", "test_it_leaves_the_points_as_they_are"],
)
def test_the_inherited_tests_find_a_broken_promise(name: str) -> None:
    with pytest.raises(AssertionError):
        _test(name)()
