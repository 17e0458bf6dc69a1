"""Work folders: each belongs to one set, whose settings stand in it."""

import json
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from typing import Any

from armlab.common.errors import InputError

SETTINGS_FILE = "settings.json"


def claim_folder(settings: Any, folder: Path, parts: Iterable[str] = ()) -> None:
    """Writes the settings, a dataclass, into a folder before anything is made there, and makes its parts.

    Raises InputError for a folder of other settings, and for one that holds anything else.
    """
    content = json.dumps(asdict(settings), indent=1) + "\n"
    note = folder / SETTINGS_FILE
    if note.is_file() and note.read_text(encoding="utf-8") != content:
        raise InputError(f"{folder} holds another set (see {note}): choose another folder")
    if not note.is_file() and folder.exists() and any(folder.iterdir()):
        raise InputError(f"{folder} exists and holds no set: choose another folder")
    for part in (".", *parts):
        (folder / part).mkdir(parents=True, exist_ok=True)
    note.write_text(content, encoding="utf-8")
