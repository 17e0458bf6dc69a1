"""Files of a verdict, written whole or not at all."""

import json
import os
import shutil
from collections.abc import Iterable, Mapping
from pathlib import Path

import yaml

from diagnosis.augmented import augmented_model
from diagnosis.result import Diagnosis
from diagnosis.verdict import verdict
from problem.errors import InputError
from recordings.recording import Recording

MODEL = "model.yaml"


def verdict_texts(diagnosis: Diagnosis, folder: Path) -> dict[str, str]:
    """verdict.json and, where something was fitted, model.yaml, as they are to stand in a folder."""
    texts = {"verdict.json": json.dumps(verdict(diagnosis), indent=1, allow_nan=False) + "\n"}
    if diagnosis.inertial is not None:
        model = augmented_model(diagnosis, folder)
        texts[MODEL] = yaml.safe_dump(model, sort_keys=False, default_flow_style=None, width=110)
    return texts


def write_verdict(diagnosis: Diagnosis, folder: Path) -> tuple[Path, ...]:
    """Writes verdict.json and, where something was fitted, model.yaml; InputError where that cannot be done."""
    return write_texts(verdict_texts(diagnosis, folder), folder)


def check_out(folder: Path, recording: Recording) -> None:
    """Makes sure, before any work, that the files of a verdict may stand there; InputError where they may not."""
    if folder.exists() and not folder.is_dir():
        raise InputError(f"--out {folder} is a file: give a folder")
    if recording.simulation is not None and recording.simulation.resolve() == (folder / MODEL).resolve():
        raise InputError(f"--out {folder} holds {MODEL}, the simulation of {recording.name}: give another folder")
    nearest = next(each for each in (folder.absolute(), *folder.absolute().parents) if each.exists())
    if not nearest.is_dir() or not os.access(nearest, os.W_OK):
        raise InputError(f"cannot write into {nearest}: give --out a folder that can be written")


def write_texts(texts: Mapping[str, str], folder: Path) -> tuple[Path, ...]:
    """Writes all texts under their names, or none: first into a folder of their own, then by renames.

    Other files that stand in the folder are left alone.
    """
    folder = folder.absolute()
    there = folder.is_dir()
    draft = (folder if there else folder.parent) / f".armlab.{os.getpid()}"
    try:
        for name, text in texts.items():
            (draft / name).parent.mkdir(parents=True, exist_ok=True)
            (draft / name).write_text(text, encoding="utf-8")
        if not there:
            draft.replace(folder)
        else:
            _moved(draft, texts, folder)
    except OSError as error:
        raise InputError(f"cannot write into {folder}: {error.strerror}") from None
    finally:
        shutil.rmtree(draft, ignore_errors=True)
    return tuple(folder / name for name in texts)


def _moved(draft: Path, names: Iterable[str], folder: Path) -> None:
    places = {name: folder / name for name in names}
    for place in places.values():
        place.parent.mkdir(parents=True, exist_ok=True)
        if place.is_dir():
            raise InputError(f"{place} is a folder, where a file of the verdict should stand")
    for name, place in places.items():
        (draft / name).replace(place)
