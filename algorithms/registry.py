"""Algorithms by name: built-in ones, and third parties' of the entry-point group `armlab.algorithms`.

Beside them stand peers: other packages' algorithms, for comparison, which need the extra `peers`.

Names are found without importing anything, so a broken plug-in troubles only those who ask for it.
"""

from difflib import get_close_matches
from importlib.metadata import EntryPoint, entry_points

from algorithms.contract import AnyAlgorithm

GROUP = "armlab.algorithms"

_BUILT_IN = {
    "mupso": "algorithms.mupso:MuPSO",
    "spso": "algorithms.spso:SPSO",
    "woa": "algorithms.woa:WOA",
    "gwo": "algorithms.gwo:GWO",
    "goa": "algorithms.goa:GOA",
    "de": "algorithms.de:DE",
    "random-search": "algorithms.random_search:RandomSearch",
    "cma-es": "algorithms.cmaes:CMAES",
    "ipop-cma-es": "algorithms.ipop_cmaes:IPOPCMAES",
    "l-shade": "algorithms.lshade:LSHADE",
}

_PEERS = {
    "scipy-de": "algorithms.adapters.scipy_peer:ScipyDE",
    "pygmo-pso": "algorithms.adapters.pygmo_peers:PygmoPSO",
    "pygmo-gwo": "algorithms.adapters.pygmo_peers:PygmoGWO",
    "pygmo-de": "algorithms.adapters.pygmo_peers:PygmoDE",
    "mealpy-pso": "algorithms.adapters.mealpy_peers:MealpyPSO",
    "mealpy-woa": "algorithms.adapters.mealpy_peers:MealpyWOA",
    "mealpy-gwo": "algorithms.adapters.mealpy_peers:MealpyGWO",
    "mealpy-goa": "algorithms.adapters.mealpy_peers:MealpyGOA",
    "mealpy-de": "algorithms.adapters.mealpy_peers:MealpyDE",
    "pymoo-pso": "algorithms.adapters.pymoo_peers:PymooPSO",
    "pymoo-de": "algorithms.adapters.pymoo_peers:PymooDE",
    "nevergrad-pso": "algorithms.adapters.nevergrad_peers:NevergradPSO",
    "nevergrad-de": "algorithms.adapters.nevergrad_peers:NevergradDE",
    "pycma": "algorithms.adapters.cma_peer:Pycma",
}


class UnknownAlgorithmError(ValueError):
    """No algorithm is registered under that name."""


class BrokenAlgorithmError(ValueError):
    """The name is registered, but what stands behind it cannot be used."""


def names() -> list[str]:
    """Registered names, without peers: the built-in ones in the paper's order, then the plug-ins'."""
    plug_ins = sorted(entry.name for entry in entry_points(group=GROUP))
    return list(dict.fromkeys([*_BUILT_IN, *plug_ins]))


def peer_names() -> list[str]:
    """Names of other packages' algorithms; their packages may be missing."""
    return list(_PEERS)


def load(name: str) -> AnyAlgorithm:
    """The algorithm class registered under a name.

    Raises UnknownAlgorithmError with the nearest name, BrokenAlgorithmError if it is registered twice or
    cannot be imported.
    """
    entries = [entry for entry in _entries() if entry.name == name]
    if not entries:
        raise UnknownAlgorithmError(f"unknown algorithm {name!r}: {_advice(name)}")
    if len(entries) > 1:
        places = " and ".join(entry.value for entry in entries)
        raise BrokenAlgorithmError(f"algorithm {name!r} is registered more than once: {places}")
    return _import(entries[0])


def _entries() -> list[EntryPoint]:
    built_in = [EntryPoint(name, value, GROUP) for name, value in (_BUILT_IN | _PEERS).items()]
    return [*built_in, *entry_points(group=GROUP)]


def _advice(name: str) -> str:
    near = get_close_matches(name, [*names(), *peer_names()], n=1)
    return f"did you mean {near[0]!r}?" if near else f"choose one of {', '.join(names())}"


def _import(entry: EntryPoint) -> AnyAlgorithm:
    try:
        algorithm: AnyAlgorithm = entry.load()
    except ModuleNotFoundError as error:
        if entry.name not in _PEERS:
            raise _not_imported(entry, error) from error
        missing = f"algorithm {entry.name!r} needs the package {error.name!r}"
        raise BrokenAlgorithmError(f"{missing}: pip install 'armlab[peers]'") from error
    except (ImportError, AttributeError, SyntaxError) as error:
        raise _not_imported(entry, error) from error
    return algorithm


def _not_imported(entry: EntryPoint, error: Exception) -> BrokenAlgorithmError:
    return BrokenAlgorithmError(f"algorithm {entry.name!r} ({entry.value}) cannot be imported: {error}")
