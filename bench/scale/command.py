"""What `armlab scale` does: measure, and write the pages."""

from pathlib import Path

from bench.files import write_whole
from bench.scale.kills import Kill, Victim, killed
from bench.scale.page import kills_page, scale_page
from bench.scale.sweep import Tell, measure
from bench.sharing.tidy import make_folder

_VICTIMS: tuple[Victim, ...] = ("driver", "worker")


def write_scale(configs: Path, trials: int, results: Path, tell: Tell) -> Path:
    """Measure sweeps of so many trials, and a tenth of them, as `scale.yaml` in `configs` says; write `scale.md`.

    Raises InputError for a number of trials that does not fit the configuration.
    """
    make_folder(results)
    write_whole(results / "scale.md", scale_page(measure(configs / "scale.yaml", trials, tell)))
    return results / "scale.md"


def write_kills(configs: Path, count: int, results: Path, tell: Tell) -> tuple[Path, bool]:
    """Kill the command, and its workers, that often while they run `scale_kills.yaml`; write `kills.md`.

    Returns the page, and whether every kill was without a loss.
    """
    make_folder(results)
    kills: dict[str, list[Kill]] = {
        victim: killed(configs / "scale_kills.yaml", count, victim, tell) for victim in _VICTIMS
    }
    write_whole(results / "kills.md", kills_page(kills))
    return results / "kills.md", all(kill.exact for some in kills.values() for kill in some)
