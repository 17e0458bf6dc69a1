"""One trial: what is run, and the key under which its outcome is kept."""

import dataclasses
import hashlib
import json
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from problem.registry import ProblemSettings


@dataclass(frozen=True)
class Trial:
    """One run of one algorithm on one problem; what it holds decides the outcome to the bit.

    params: the algorithm's own `Params`. evaluations: the budget. repetition: counts from 0.
    """

    problem: ProblemSettings
    algorithm: str
    params: Any
    swarm_size: int
    evaluations: int
    bounds: str
    seed: int
    repetition: int

    @property
    def problem_text(self) -> str:
        """The problem's settings as canonical text."""
        return _problem_text(self.problem)

    @property
    def params_text(self) -> str:
        """The hyper-parameters as canonical text."""
        return canonical(dataclasses.asdict(self.params))

    def key(self, code: str) -> str:
        """SHA-256 of the trial's content and of the code (see `fingerprint`) that would run it."""
        content = {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}
        content |= {"problem": self.problem_text, "params": self.params_text, "code": code}
        return hashlib.sha256(canonical(content).encode()).hexdigest()

    def __str__(self) -> str:
        return (
            f"{self.algorithm} on {self.problem_text}, swarm size {self.swarm_size}, "
            f"{self.evaluations} evaluations, repetition {self.repetition}"
        )


def canonical(content: Any) -> str:
    """JSON with sorted keys and no spaces: equal content gives equal text."""
    return json.dumps(content, sort_keys=True, separators=(",", ":"))


@lru_cache(maxsize=64)
def _problem_text(problem: ProblemSettings) -> str:
    return canonical(problem.model_dump(mode="json"))  # once for all trials on it
