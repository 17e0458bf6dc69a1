"""The two parts of `armlab proof real`: recording folders, which are asked most, and the public recordings."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from armlab.common.errors import InputError
from armlab.common.settings import suggest_name
from armlab.proof.open.real_arms.all_arms import prove_on_public_arms
from armlab.proof.open.real_folders.all_folders import FolderProof, prove_folders
from armlab.proof.open.real_identification.identify_recording import RECIPES
from armlab.recordings.public import LOCAL_COPIES_VARIABLE


@dataclass(frozen=True)
class PublicProof:
    """Where the public recordings and their results are; fields as in `prove_on_public_arms`."""

    results: Path
    recordings: Path
    peers: Path | None


def prove_on_real_arms(
    folders: FolderProof | None,
    public: PublicProof | None,
    only: Sequence[str] = (),
    progress: Callable[[str], None] = lambda message: None,
) -> Iterator[str]:
    """Lines of one part or of both; `only` names recordings, and a part without one of them is left out.

    Folders are left out with a line, too, where there are none and nothing is asked of them alone.
    Raises InputError for a name that is in no part.
    """
    optional = public is not None and folders is not None and folders.facts is None
    own = () if folders is None else _folder_names(folders, optional)
    arms = () if public is None else tuple(recipe.name for recipe in RECIPES)
    for name in only:
        if name not in own and name not in arms:
            raise InputError(f"unknown recording '{name}': {suggest_name(name, [*own, *arms])}")
    if folders is not None and not own:
        yield f"no recording folders: {LOCAL_COPIES_VARIABLE} names none"
    elif folders is not None and (not only or set(only) & set(own)):
        yield from prove_folders(folders, [name for name in only if name in own])
    if public is not None and (not only or set(only) & set(arms)):
        chosen = [name for name in only if name in arms]
        yield from prove_on_public_arms(public.results, public.recordings, chosen, public.peers, progress)


def _folder_names(folders: FolderProof, optional: bool) -> tuple[str, ...]:
    """Names of the folders; none where there are none and they are `optional`, else InputError."""
    try:
        return tuple(each.name for each in folders.find())
    except InputError:
        if optional:
            return ()
        raise
