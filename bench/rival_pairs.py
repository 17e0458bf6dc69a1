"""Which of our algorithms stands beside which of another package's."""

from collections.abc import Iterable
from typing import cast

from algorithms.registry import load, peer_names
from bench.plan import Entry


def rival_pairs(entries: Iterable[Entry]) -> list[tuple[str, str]]:
    """Labels of ours and theirs, for every peer whose rival takes part."""
    labels = dict.fromkeys((entry.algorithm, entry.trial.algorithm) for entry in entries)
    ours = {name: label for label, name in reversed(labels)}
    peers = [(label, _rival(name)) for label, name in labels if name in peer_names()]
    return [(ours[rival], label) for label, rival in peers if rival in ours]


def _rival(name: str) -> str:
    from algorithms.adapters.peer import Peer  # only where a peer takes part

    return cast(type[Peer], load(name)).rival
