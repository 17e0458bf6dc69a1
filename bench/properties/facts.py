"""The facts about one algorithm, and the sentence that they amount to."""

from collections.abc import Sequence
from dataclasses import dataclass

from algorithms.properties import measure
from bench.lookup import find_algorithm
from bench.speed.clock import median_seconds
from bench.speed.overhead import own_task

SAME_PATH = 1e-9  # of the width of the box: far above rounding, far below a step
UNLIKELY = 0.001  # many tests are made at once
ROUNDS = 3


@dataclass(frozen=True)
class Facts:
    """translation, scale: largest deviation of a coordinate of the path, in widths of the box.

    noise_p_value: that best points on pure noise are uniform in the box, with the bound policies `clip` and `reflect`.
    on_bounds: share of their coordinates on a bound, likewise. overhead: microseconds an evaluation with its objective.
    """

    algorithm: str
    translation: float
    scale: float
    noise_p_value_clip: float
    noise_p_value_reflect: float
    on_bounds_clip: float
    on_bounds_reflect: float
    overhead: float

    @property
    def verdict(self) -> str:
        """What a reader of a ranking should know."""
        said = []
        if self.translation > SAME_PATH:
            said.append("depends on where the origin of coordinates lies")
        if self.scale > SAME_PATH:
            said.append("depends on the unit of its coordinates")
        if self.noise_p_value_reflect < UNLIKELY:
            said.append("prefers places of the box without any reason")
        if self.noise_p_value_clip < UNLIKELY <= self.noise_p_value_reflect:
            said.append("piles up on clipped bounds")
        return "; ".join(said) or "no bias seen"


def facts_of(names: Sequence[str]) -> list[Facts]:
    """Facts of algorithms by their registered names, with their default parameters.

    Raises InputError for a name that is not registered.
    """
    algorithms = {name: find_algorithm(name, "properties") for name in names}
    overhead = overheads(names)
    found = []
    for name, algorithm in algorithms.items():
        clip, reflect = (measure(algorithm, bounds=bounds) for bounds in ("clip", "reflect"))
        found.append(
            Facts(
                algorithm=name,
                translation=clip.translation,
                scale=clip.scale,
                noise_p_value_clip=clip.noise_p_value,
                noise_p_value_reflect=reflect.noise_p_value,
                on_bounds_clip=clip.noise_share_on_bounds,
                on_bounds_reflect=reflect.noise_share_on_bounds,
                overhead=overhead[name],
            )
        )
    return found


def overheads(names: Sequence[str]) -> dict[str, float]:
    """Microseconds an evaluation of a whole population of the sphere at once."""
    tasks = {name: own_task(name, one_at_a_time=False) for name in names}
    seconds = median_seconds({name: task for name, (task, _) in tasks.items()}, ROUNDS)
    return {name: 1e6 * seconds[name] / evaluations for name, (_, evaluations) in tasks.items()}
