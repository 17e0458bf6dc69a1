"""What a run store holds, read without the project's own reader."""

import sqlite3
from contextlib import closing
from pathlib import Path


def kept(folder: Path) -> dict[str, float]:
    """The seconds of each trial in the store of a working folder, by key; nothing before there is one."""
    store = folder / ".armlab" / "runs.sqlite"
    if not store.exists():
        return {}
    with closing(sqlite3.connect(store, timeout=30)) as connection:
        tables = connection.execute("SELECT 1 FROM sqlite_master WHERE name = 'trials'").fetchall()
        return dict(connection.execute("SELECT key, seconds FROM trials").fetchall()) if tables else {}
