"""Algorithms by name: built-in ones, and third parties' of the entry-point group `armlab.algorithms`.

There are also peers for comparison: algorithms of other packages, which need the extra `peers`. And there are
algorithms that ask for derivatives, which not every problem offers.

Names are found without importing anything, so a broken plug-in raises an error only where its name is used.
"""

from difflib import get_close_matches
from importlib.metadata import EntryPoint, entry_points

from algorithms.contract import AnyAlgorithm
from armlab.common.packages import missing_package
from armlab.common.plug_ins import BrokenPlugInError, load_plug_in

ENTRY_POINT_GROUP = "armlab.algorithms"

_BUILT_IN = {
    "mupso": "algorithms.mupso:MuPSO",
    "spso": "algorithms.spso:SPSO",
    "woa": "algorithms.woa:WOA",
    "gwo": "algorithms.gwo:GWO",
    "goa": "algorithms.goa:GOA",
    "de": "algorithms.de:DE",
    "random-search": "algorithms.random_search:RandomSearch",
    "cma-es": "algorithms.cmaes:CMAES",
    "ipop-cma-es": "algorithms.cmaes:IPOPCMAES",
    "l-shade": "algorithms.lshade:LSHADE",
}

_PEERS = {
    "scipy-de": "algorithms.peers.scipy_adapter:ScipyDE",
    "pygmo-pso": "algorithms.peers.pygmo_adapter:PygmoPSO",
    "pygmo-gwo": "algorithms.peers.pygmo_adapter:PygmoGWO",
    "pygmo-de": "algorithms.peers.pygmo_adapter:PygmoDE",
    "mealpy-pso": "algorithms.peers.mealpy_adapter:MealpyPSO",
    "mealpy-woa": "algorithms.peers.mealpy_adapter:MealpyWOA",
    "mealpy-gwo": "algorithms.peers.mealpy_adapter:MealpyGWO",
    "mealpy-goa": "algorithms.peers.mealpy_adapter:MealpyGOA",
    "mealpy-de": "algorithms.peers.mealpy_adapter:MealpyDE",
    "pymoo-pso": "algorithms.peers.pymoo_adapter:PymooPSO",
    "pymoo-de": "algorithms.peers.pymoo_adapter:PymooDE",
    "nevergrad-pso": "algorithms.peers.nevergrad_adapter:NevergradPSO",
    "nevergrad-de": "algorithms.peers.nevergrad_adapter:NevergradDE",
    "pycma": "algorithms.peers.cma_adapter:Pycma",
}

_WITH_DERIVATIVES = {
    "sqp": "algorithms.sqp:SQP",
    "spso-sqp": "algorithms.sqp:SPSOThenSQP",
    "ipopt": "algorithms.peers.ipopt_adapter:Ipopt",
}

_RUN_BY_OTHERS = {*_PEERS, "ipopt"}


class UnknownAlgorithmError(ValueError):
    """No algorithm is registered under that name."""


class BrokenAlgorithmError(ValueError):
    """The name is registered, but what stands behind it cannot be used."""


def names() -> list[str]:
    """Names of all that need no derivatives, without peers: the built-in ones in the paper's order, the plug-ins'."""
    plug_ins = sorted(entry.name for entry in entry_points(group=ENTRY_POINT_GROUP))
    return list(dict.fromkeys([*_BUILT_IN, *plug_ins]))


def peer_names() -> list[str]:
    """Names of other packages' algorithms; their packages may be missing."""
    return list(_PEERS)


def names_with_derivatives() -> list[str]:
    """Names of algorithms that ask for derivatives; `ipopt` needs the extra `peers`."""
    return list(_WITH_DERIVATIVES)


def is_our_code(name: str) -> bool:
    """Whether an algorithm's loop stands in this package: neither a plug-in nor one that runs another package's."""
    return name in (_BUILT_IN | _WITH_DERIVATIVES).keys() - _RUN_BY_OTHERS


def load(name: str) -> AnyAlgorithm:
    """The algorithm class registered under a name.

    Raises UnknownAlgorithmError with the nearest name, BrokenAlgorithmError if it is registered twice or
    cannot be imported.
    """
    entries = [entry for entry in _entries() if entry.name == name]
    if not entries:
        raise UnknownAlgorithmError(f"unknown algorithm {name!r}: {_name_hint(name)}")
    if len(entries) > 1:
        places = " and ".join(entry.value for entry in entries)
        raise BrokenAlgorithmError(f"algorithm {name!r} is registered more than once: {places}")
    return _load_entry(entries[0])


def _entries() -> list[EntryPoint]:
    built_in = [
        EntryPoint(name, value, ENTRY_POINT_GROUP) for name, value in (_BUILT_IN | _PEERS | _WITH_DERIVATIVES).items()
    ]
    return [*built_in, *entry_points(group=ENTRY_POINT_GROUP)]


def _name_hint(name: str) -> str:
    near = get_close_matches(name, [*names(), *peer_names(), *names_with_derivatives()], n=1)
    return f"did you mean {near[0]!r}?" if near else f"choose one of {', '.join(names())}"


def _load_entry(entry: EntryPoint) -> AnyAlgorithm:
    try:
        algorithm: AnyAlgorithm = load_plug_in(entry)
    except BrokenPlugInError as error:
        missing = missing_package(error.__cause__, f"algorithm {entry.name!r}")
        if missing is not None:
            raise BrokenAlgorithmError(missing) from error
        place = f"algorithm {entry.name!r} ({entry.value})"
        raise BrokenAlgorithmError(f"{place} cannot be imported: {error}") from error
    return algorithm
