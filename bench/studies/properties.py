"""Properties of the algorithms, `armlab bench properties`: behaviour on a problem that is shifted, scaled or pure
noise, and overhead.
"""

import json
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from multiprocessing import get_context
from pathlib import Path

import pandas as pd

from algorithms.properties import measure_properties
from algorithms.registry import is_our_code
from algorithms.registry import names as registered
from armlab.common.files import write_whole
from armlab.common.markdown import markdown_page, markdown_table
from bench.config import find_algorithm
from bench.fingerprint import algorithm_fingerprint
from bench.result_sets.formats import make_folder
from bench.store import RunStore
from bench.studies.speed.clock import median_seconds
from bench.studies.speed.overhead import armlab_task
from bench.tables import as_csv

MAX_PATH_DEVIATION = 1e-9  # of the width of the box: far above rounding, far below a step
MAX_BIAS_P_VALUE = 0.001  # many tests are made at once
TIMING_ROUNDS = 3


@dataclass(frozen=True)
class AlgorithmProperties:
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
        """What the properties mean for a ranking, in words."""
        said = []
        if self.translation > MAX_PATH_DEVIATION:
            said.append("depends on where the origin of coordinates lies")
        if self.scale > MAX_PATH_DEVIATION:
            said.append("depends on the unit of its coordinates")
        if self.noise_p_value_reflect < MAX_BIAS_P_VALUE:
            said.append("favours some places of the search box even where the objective is pure noise")
        if self.noise_p_value_clip < MAX_BIAS_P_VALUE <= self.noise_p_value_reflect:
            said.append("piles up on clipped bounds")
        return "; ".join(said) or "no bias seen"


def properties_of_algorithms(names: Sequence[str]) -> list[AlgorithmProperties]:
    """Properties of algorithms by their registered names, with their default parameters.

    Raises InputError for a name that is not registered.
    """
    algorithms = {name: find_algorithm(name, "properties") for name in names}
    overhead = measure_overheads(names)
    found = []
    for name, algorithm in algorithms.items():
        clip = measure_properties(algorithm, bounds="clip")
        reflect = measure_properties(algorithm, bounds="reflect")
        found.append(
            AlgorithmProperties(
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


def stored_properties(name: str, store: RunStore) -> AlgorithmProperties | None:
    """`measure_isolated`, from the store where the same code was measured before."""
    key = algorithm_fingerprint(find_algorithm(name, "properties"), __name__)
    content = store.measured(key)
    if content is not None:
        return AlgorithmProperties(**json.loads(content))
    found = measure_isolated(name)
    if found is not None:
        store.keep_measured(key, json.dumps(asdict(found)))
    return found


def measure_isolated(name: str) -> AlgorithmProperties | None:
    """Properties of one algorithm. Another package's code runs in a process of its own; None where that fails."""
    if is_our_code(name):
        return properties_of_algorithms([name])[0]
    try:
        with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
            return pool.submit(properties_of_algorithms, [name]).result()[0]
    except Exception:  # whatever a third party raises: its trials tell it
        return None


def measure_overheads(names: Sequence[str]) -> dict[str, float]:
    """Microseconds an evaluation of a whole population of the sphere at once."""
    tasks = {name: armlab_task(name, one_at_a_time=False) for name in names}
    seconds = median_seconds({name: task for name, (task, _) in tasks.items()}, TIMING_ROUNDS)
    return {name: 1e6 * seconds[name] / evaluations for name, (_, evaluations) in tasks.items()}


PROPERTY_HEADINGS = (
    "algorithm",
    "moved",
    "scaled",
    "noise p, clip",
    "noise p, reflect",
    "on bounds, clip",
    "on bounds, reflect",
    "us an evaluation",
    "in words",
)
PROPERTY_READING = """\
50 points, 30 iterations, default parameters. "Moved", "scaled": box, first population and objective are moved by five
units, or made 16 times larger; the figure is by how much the path leaves its own, in widths of the box: 0 up to
rounding where nothing depends on it. "Noise": the objective is chance alone; p of the Kolmogorov-Smirnov test that the
best points of 40 runs are uniform in the box, and the share of their coordinates on a bound, with points outside
clipped to the box or reflected. Microseconds: median time an evaluation of the sphere in 15 dimensions, measured on
this machine."""


def property_rows(facts: Sequence[AlgorithmProperties]) -> list[list[str]]:
    """Cells of the table, one row an algorithm."""
    return [
        [
            fact.algorithm,
            _format_deviation(fact.translation),
            _format_deviation(fact.scale),
            f"{fact.noise_p_value_clip:.2g}",
            f"{fact.noise_p_value_reflect:.2g}",
            f"{fact.on_bounds_clip:.0%}",
            f"{fact.on_bounds_reflect:.0%}",
            f"{fact.overhead:.1f}",
            fact.verdict,
        ]
        for fact in facts
    ]


def _format_deviation(share: float) -> str:
    return "0" if share < 1e-9 else f"{share:.2g}"


def write_properties(names: Sequence[str], folder: Path) -> list[Path]:
    """Write `properties.md` and `properties.csv` of the algorithms, all registered ones if none is named."""
    facts = properties_of_algorithms(names or registered())
    table = pd.DataFrame([asdict(fact) | {"in_words": fact.verdict} for fact in facts])
    make_folder(folder)
    files = {
        "properties.md": markdown_page(
            "Properties of the algorithms", markdown_table(PROPERTY_HEADINGS, property_rows(facts)), PROPERTY_READING
        ),
        "properties.csv": as_csv(table),
    }
    for name, content in files.items():
        write_whole(folder / name, content)
    return [folder / name for name in files]
