"""`armlab real`: all public recordings by one procedure."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from identification.peers.report import write_peers
from identification.peers.side_by_side import rows
from identification.real.looks import Looks
from identification.real.recipes import RECIPES
from identification.real.report import write_report
from identification.real.study import study, summary
from problem.errors import InputError
from problem.settings import nearest

LOG = "validation_looks.jsonl"


def identify_public(
    results: Path, recordings: Path, only: Sequence[str] = (), peers: Path | None = None
) -> Iterator[str]:
    """Lines that tell what was found and written; InputError for an unknown name.

    peers: an interpreter with figaroh and mujoco.sysid, which then take part.
    """
    names = [recipe.name for recipe in RECIPES]
    for name in only:
        if name not in names:
            raise InputError(f"unknown recording '{name}': {nearest(name, names)}")
    looks, studies = Looks(results / LOG), []
    for recipe in (each for each in RECIPES if not only or each.name in only):
        found = study(recipe, recordings, looks)
        studies.append(found)
        yield summary(found)
        for error in found.models[-1].errors:
            known = recipe.best_known.get(error.run) if error.role == "validate" else None
            beside = f" (best known {known:g} %)" if known else ""
            recorded = f"{error.recorded_percent:.2f} % of the torque as recorded"
            yield f"  {error.role} {error.run}: {error.relative_percent:.2f} %{beside}, {recorded}"
    table, page = write_report(studies, looks, results)
    yield f"{table}\n{page}"
    if peers is not None:
        folder = recordings / ".peers"
        compared = [row for each in studies for row in rows(each, peers, folder / each.recipe.name, looks)]
        yield str(write_peers(compared, results))
