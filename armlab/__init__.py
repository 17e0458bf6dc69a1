"""Excitation trajectories, identification and diagnosis of robot arms: the public interface.

    import armlab

    recording = armlab.import_recording("log.csv", robot="arm.urdf")
    armlab.diagnose(recording)        # which physics the simulation leaves out
    armlab.identify(recording)        # the parameters of the arm
    armlab.search("joint-fourier")    # a motion that excites the dynamics

A recording may be an object or the path of its folder. A name is imported when it is first used, so `import armlab`
takes milliseconds.
"""

from importlib import import_module as _import_module
from typing import TYPE_CHECKING as _TYPE_CHECKING

if _TYPE_CHECKING:
    from algorithms.contract import Box
    from algorithms.driver import minimise
    from algorithms.registry import load as load_algorithm
    from armlab.common.errors import InputError
    from armlab.diagnosis.changes.comparison import Comparison
    from armlab.experiments import ExperimentResult, run_experiment, search
    from armlab.flows import Prediction, identify, predict
    from armlab.identification.model import Model
    from armlab.recordings.from_python import import_recording
    from armlab.recordings.given import read_recording
    from armlab.recordings.motion import MotionRecording
    from armlab.recordings.recording import Recording
    from armlab.report.diagnose import compare, diagnose
    from armlab.report.verdict import Verdict, read_verdict
    from problem.arm import Arm
    from problem.registry import parse_problem
    from problem.robot_file import load_arm as read_robot

    __version__: str
    read_model = Model.load

_PLACES = {
    "Arm": "problem.arm:Arm",
    "Box": "algorithms.contract:Box",
    "Comparison": "armlab.diagnosis.changes.comparison:Comparison",
    "ExperimentResult": "armlab.experiments:ExperimentResult",
    "InputError": "armlab.common.errors:InputError",
    "Model": "armlab.identification.model:Model",
    "MotionRecording": "armlab.recordings.motion:MotionRecording",
    "Prediction": "armlab.flows:Prediction",
    "Recording": "armlab.recordings.recording:Recording",
    "Verdict": "armlab.report.verdict:Verdict",
    "compare": "armlab.report.diagnose:compare",
    "diagnose": "armlab.report.diagnose:diagnose",
    "identify": "armlab.flows:identify",
    "import_recording": "armlab.recordings.from_python:import_recording",
    "load_algorithm": "algorithms.registry:load",
    "minimise": "algorithms.driver:minimise",
    "parse_problem": "problem.registry:parse_problem",
    "predict": "armlab.flows:predict",
    "read_model": "armlab.identification.model:Model.load",
    "read_recording": "armlab.recordings.given:read_recording",
    "read_robot": "problem.robot_file:load_arm",
    "read_verdict": "armlab.report.verdict:read_verdict",
    "run_experiment": "armlab.experiments:run_experiment",
    "search": "armlab.experiments:search",
}

__all__ = [
    "Arm",
    "Box",
    "Comparison",
    "ExperimentResult",
    "InputError",
    "Model",
    "MotionRecording",
    "Prediction",
    "Recording",
    "Verdict",
    "__version__",
    "compare",
    "diagnose",
    "identify",
    "import_recording",
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


def __getattr__(name: str) -> object:
    """Import a public name at its first use."""
    value: object
    if name == "__version__":
        from importlib.metadata import version

        value = version("armlab")
    elif name in _PLACES:
        module, _, path = _PLACES[name].partition(":")
        value = _import_module(module)
        for part in path.split("."):
            value = getattr(value, part)
    else:
        from difflib import get_close_matches

        close = get_close_matches(name, __all__, n=1, cutoff=0.5)
        hint = f": did you mean '{close[0]}'?" if close else f": it has {', '.join(__all__)}"
        raise AttributeError(f"module 'armlab' has no attribute {name!r}{hint if not name.startswith('_') else ''}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return list(__all__)
