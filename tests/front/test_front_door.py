"""`import armlab`: light, complete, and with objects that say what they are."""

import ast
import subprocess
import sys
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner

import armlab
from armlab.cli.main import main
from armlab.recordings.recording import Recording
from problem.robot_file import load_arm

HEAVY = ("numpy", "pandas", "scipy", "pydantic", "matplotlib", "yaml", "click", "problem", "bench", "algorithms")


@pytest.fixture(scope="module")
def model(recording):
    return armlab.identify(recording)


def test_importing_armlab_imports_no_heavy_package():
    loaded = f"print([name for name in {HEAVY!r} if name in sys.modules])"
    done = subprocess.run(
        [sys.executable, "-c", f"import sys, armlab; dir(armlab); {loaded}"], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"


def test_every_public_name_can_be_used_and_is_listed():
    for name in armlab.__all__:
        assert getattr(armlab, name) is not None
        assert name in dir(armlab)


def test_an_unknown_name_is_an_attribute_error_with_the_nearest_name():
    with pytest.raises(AttributeError, match="no attribute 'load_recording': did you mean 'read_recording'"):
        armlab.load_recording  # noqa: B018
    assert not hasattr(armlab, "Diagnoze")


def test_the_listed_names_are_the_public_ones_alone():
    assert armlab.InputError
    assert dir(armlab) == armlab.__all__


def test_the_version_is_that_of_the_installed_package():
    assert armlab.__version__ == version("armlab")


def test_a_function_of_ones_own_is_minimised_by_an_algorithm_of_any_name():
    spso, rng = armlab.load_algorithm("spso"), np.random.default_rng(1)
    box = armlab.Box(np.full(3, -1.0), np.full(3, 2.0))
    start = rng.uniform(box.lower, box.upper, (10, 3))
    result = armlab.minimise(spso, spso.Params(), lambda X: np.square(X).sum(axis=1), box, start, 500, rng)
    assert result.best_fitness < 0.01
    assert repr(result).startswith(f"Result: fitness {result.best_fitness:.6g}; 500 evaluations in 50 populations\n")


def test_settings_of_a_problem_build_a_problem():
    problem = armlab.parse_problem({"preset": "sphere"}, "my script").build()
    assert problem.evaluate(problem.lower[None]).violation == 0.0


def test_type_checkers_see_the_same_objects_as_users():
    tree = ast.parse(Path(armlab.__file__).read_text(encoding="utf-8"))
    block = next(node for node in tree.body if isinstance(node, ast.If))
    seen = {}
    for node in block.body:
        if isinstance(node, ast.ImportFrom):
            seen |= {one.asname or one.name: getattr(import_module(node.module), one.name) for one in node.names}
    assert {*seen, "read_model", "__version__"} == set(armlab.__all__)
    for name, value in seen.items():
        assert getattr(armlab, name) is value


def test_a_search_finds_what_the_experiment_with_the_same_settings_finds(tmp_path):
    (tmp_path / "mine.yaml").write_text(
        "{name: mine, problem: sphere, algorithms: [de, {name: spso, params: {inertia: 0.6}}], swarm_size: 10,"
        " evaluations: 200, repetitions: 2, seed: 3}"
    )
    result = armlab.run_experiment(tmp_path / "mine.yaml", tmp_path / "out", tmp_path / "runs.sqlite", workers=1)
    outcome = armlab.search("sphere", "spso", evaluations=200, swarm_size=10, seed=3, params={"inertia": 0.6})
    rows = result.trials.set_index(["algorithm", "repetition"])
    assert rows.loc[("spso", 0), "value"] == outcome.value
    assert list(result.table["algorithm"]) == ["de", "spso"]
    assert all(file.is_file() for file in result.files)
    assert repr(result).splitlines()[0] == "Experiment 'mine'; trials: 4, files: 4"
    assert repr(result).splitlines()[-1].endswith("2 repetitions are too few to tell any pair apart")
    assert repr(outcome).startswith(f"Outcome: value {outcome.value:.6g}, every limit kept; 200 evaluations")


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (("spere",), "unknown preset 'spere': did you mean 'sphere'"),
        (("sphere", "spsso"), "unknown algorithm 'spsso': did you mean 'spso'"),
    ],
)
def test_a_mistake_in_a_search_is_one_line(arguments, complaint):
    with pytest.raises(armlab.InputError, match=complaint):
        armlab.search(*arguments)


def test_wrong_parameters_and_budgets_of_a_search_are_refused():
    with pytest.raises(armlab.InputError, match="did you mean 'inertia'"):
        armlab.search("sphere", "spso", params={"inertias": 1.0})
    with pytest.raises(armlab.InputError, match="evaluations is 0: it must be at least 1"):
        armlab.search("sphere", evaluations=0)


def test_identification_finds_the_friction_and_predicts_the_other_run(recording, model):
    friction = {
        part.effect: model.component_parameters(k)[0].value for k, part in enumerate(model.structure.components)
    }
    assert friction["viscous_friction"] == pytest.approx(0.5, abs=0.05)
    prediction = armlab.predict(model, recording)
    assert [each.role for each in prediction.errors] == ["identify", "validate"]
    assert prediction.errors[1].relative_percent < 2.0
    assert prediction.torque["validate.csv"].shape == recording.runs[1].torque.shape
    assert len(repr(prediction).splitlines()) == 3


def test_a_saved_model_is_read_back(model, tmp_path):
    model.save(tmp_path / "model.yaml")
    assert np.array_equal(armlab.read_model(tmp_path / "model.yaml").base_values, model.base_values)


def test_identification_refuses_an_unknown_method_and_a_recording_without_a_run_to_identify(recording):
    with pytest.raises(armlab.InputError, match="unknown method 'weigthed': did you mean 'weighted'"):
        armlab.identify(recording, "weigthed")
    only = Recording(recording.folder, recording.robot, recording.arm, recording.runs[1:], recording.transmission)
    with pytest.raises(armlab.InputError, match="no run to identify from"):
        armlab.identify(only)


def test_a_prediction_for_another_arm_is_refused(recording, model):
    other = Recording(Path("other"), "irb120", load_arm("irb120"), (), recording.transmission)
    with pytest.raises(armlab.InputError, match="the model has 3 joints, other has 6"):
        armlab.predict(model, other)


def test_objects_say_what_they_are_in_a_few_lines(recording, model):
    assert repr(recording) == (
        "Recording 'my-recording' of irb120-arm; joints: 3, runs: 2\n"
        "  identify.csv (identify): 1200 samples at 100 Hz\n"
        "  validate.csv (validate): 1200 samples at 100 Hz\n"
        "  findings: 0 repairs, 0 warnings"
    )
    assert repr(armlab.read_robot("irb120-arm")).startswith("Arm 'irb120-arm'; joints: 3 (RRR)\n  links: ")
    assert repr(model).startswith("Model of irb120-arm; joints: 3, base parameters: 15\n  components: ")
    assert "3 viscous_friction" in repr(model)
    for each in (recording, model, recording.arm):
        assert len(repr(each).splitlines()) <= 6


def test_a_comparison_names_effects_with_their_places(recording):
    pair, changes = (recording, recording), (SimpleNamespace(changed=True),)
    named = (SimpleNamespace(effect="coulomb_friction", joint=2, equation="tau_2 += 0.4"),)
    compared = armlab.Comparison("changed", pair, None, findings=named, changes=changes)
    assert "  coulomb_friction@2: tau_2 += 0.4\n  parameters compared: 1" in repr(compared)
    assert repr(armlab.Comparison("inconclusive", pair, None, reason="Too short.")).endswith(
        "inconclusive\n  Too short."
    )


def test_identify_is_what_the_command_does(recording_folder, tmp_path):
    folder = tmp_path / "my-recording"
    recording_folder(folder)
    told = CliRunner().invoke(main, ["identify", str(folder), "--out", str(tmp_path / "out")])
    assert told.exit_code == 0, told.output
    stored, live = armlab.read_model(tmp_path / "out" / "model.yaml"), armlab.identify(folder)
    assert (stored.cutoff_hz, stored.provenance["settings"]) == (live.cutoff_hz, live.provenance["settings"])
    np.testing.assert_allclose(stored.values, live.values, rtol=1e-12)
