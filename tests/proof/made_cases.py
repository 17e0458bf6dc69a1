"""Cases of the real tier as the command that makes them leaves them, without any recording in them."""

from pathlib import Path


def write_made_cases(folder: Path, recording: str, cases: int) -> None:
    """Observations and answers of a recording, the control first."""
    for number in range(cases + 1):
        key = f"{recording}-{number}"
        (folder / "observations" / key).mkdir(parents=True)
        (folder / "observations" / key / "runs.json").write_text("{}")
        (folder / "truth").mkdir(exist_ok=True)
        (folder / "truth" / f"{key}.json").write_text("{}")
