"""Excitation trajectories, identification and diagnosis of robot arms: the public interface.

    import armlab

    recording = armlab.read_recording("my-recording")
    armlab.diagnose(recording)        # which physics the simulation leaves out
    armlab.identify(recording)        # the parameters of the arm
    armlab.search("joint-fourier")    # a motion that excites the dynamics

A name is imported when it is first used, so `import armlab` takes milliseconds.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from algorithms.contract import Box
    from algorithms.driver import minimise
    from algorithms.registry import load as load_algorithm
    from armlab.common.errors import InputError
    from armlab.diagnosis.changes.comparison import Comparison, compare
    from armlab.diagnosis.formats import read_verdict_file as read_verdict
    from armlab.diagnosis.result import Diagnosis
    from armlab.flows import ExperimentResult, Prediction, identify, predict, run_experiment, search
    from armlab.identification.model import Model
    from armlab.recordings.load import load_recording as read_recording
    from armlab.recordings.recording import Recording
    from armlab.report.diagnose import diagnose
    from problem.arm import Arm
    from problem.registry import parse_problem
    from problem.robot_file import load_arm as read_robot

    __version__: str
    read_model = Model.load

_PLACES = {
    "Arm": "problem.arm:Arm",
    "Box": "algorithms.contract:Box",
    "Comparison": "armlab.diagnosis.changes.comparison:Comparison",
    "Diagnosis": "armlab.diagnosis.result:Diagnosis",
    "ExperimentResult": "armlab.flows:ExperimentResult",
    "InputError": "armlab.common.errors:InputError",
    "Model": "armlab.identification.model:Model",
    "Prediction": "armlab.flows:Prediction",
    "Recording": "armlab.recordings.recording:Recording",
    "compare": "armlab.diagnosis.changes.comparison:compare",
    "diagnose": "armlab.report.diagnose:diagnose",
    "identify": "armlab.flows:identify",
    "load_algorithm": "algorithms.registry:load",
    "minimise": "algorithms.driver:minimise",
    "parse_problem": "problem.registry:parse_problem",
    "predict": "armlab.flows:predict",
    "read_model": "armlab.identification.model:Model.load",
    "read_recording": "armlab.recordings.load:load_recording",
    "read_robot": "problem.robot_file:load_arm",
    "read_verdict": "armlab.diagnosis.formats:read_verdict_file",
    "run_experiment": "armlab.flows:run_experiment",
    "search": "armlab.flows:search",
}

__all__ = [
    "Arm",
    "Box",
    "Comparison",
    "Diagnosis",
    "ExperimentResult",
    "InputError",
    "Model",
    "Prediction",
    "Recording",
    "__version__",
    "compare",
    "diagnose",
    "identify",
    "load_algorithm",
    "minimise",
    "parse_problem",
    "predict",
    "read_model",
    "read_recording",
    "read_robot",
    "read_verdict",
    "run_experiment",
    "search",
]


def __getattr__(name: str) -> Any:
    """Import a public name at its first use."""
    if name == "__version__":
        from importlib.metadata import version

        value: Any = version("armlab")
    elif name in _PLACES:
        module, _, path = _PLACES[name].partition(":")
        value = import_module(module)
        for part in path.split("."):
            value = getattr(value, part)
    else:
        raise AttributeError(f"module 'armlab' has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
