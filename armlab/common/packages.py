"""Packages that only some purposes need: which extra of armlab has each, and what is said where one is missing."""

from importlib import import_module
from typing import Any

from armlab.common.errors import InputError

EXTRA_OF_MODULE = {
    "clarabel": "diagnose",
    "pooch": "recordings",
    "pyarrow": "recordings",
    "rosbags": "recordings",
    "zstandard": "recordings",  # it comes with rosbags
    "mujoco": "motion",
    "cmaes": "harness",
    "markdown_it": "harness",
    "threadpoolctl": "harness",
    "distributed": "cluster",
    "ray": "cluster",
    "casadi": "peers",
    "cma": "peers",
    "ioh": "peers",
    "mealpy": "peers",
    "nevergrad": "peers",
    "optuna": "peers",
    "pinocchio": "peers",
    "pygmo": "peers",
    "pymoo": "peers",
    "sklearn": "proof",
}  # by the name that is imported


class MissingPackageError(InputError):
    """A package that is not installed; the message names the extra that has it."""

    def __init__(self, module: str, purpose: str) -> None:
        """purpose: what needs the package, the subject of the message."""
        super().__init__(f"{purpose} needs the package '{module}': {install_line(EXTRA_OF_MODULE[module])}")


def import_package(module: str, purpose: str) -> Any:
    """The module; MissingPackageError where it is not installed. purpose: what needs it, the subject of the message."""
    try:
        return import_module(module)
    except ImportError:
        raise MissingPackageError(module, purpose) from None


def missing_package(error: BaseException | None, purpose: str) -> str | None:
    """The line for an import that failed because a package of an extra is missing; None for any other error."""
    module = (error.name or "").partition(".")[0] if isinstance(error, ModuleNotFoundError) else ""
    return str(MissingPackageError(module, purpose)) if module in EXTRA_OF_MODULE else None


def install_line(extra: str) -> str:
    """The command that adds what an extra has."""
    return f"pip install 'armlab[{extra}]'"
