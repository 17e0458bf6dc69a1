"""What the value of a problem is, for the axes of figures."""

from problem.callables import CallableSettings
from problem.presets import FunctionSettings
from problem.registry import ProblemSettings, is_plug_in

CONDITION_NUMBER = "condition number (-)"


def value_name(problem: ProblemSettings) -> str:
    """The name of a problem's own value; a problem of another package may give it as `value_name` of its settings."""
    if is_plug_in(problem):
        return str(getattr(problem, "value_name", "value"))
    return "function value (-)" if isinstance(problem, FunctionSettings | CallableSettings) else CONDITION_NUMBER
