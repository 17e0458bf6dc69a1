"""`python -m tools.measure_installs`: size and time of an installation per purpose, each in a fresh environment.

Installs this tree from its folder, as a user does, with the newest packages that pip chooses. Then the purposes of
`TRIALS` are tried with nothing else installed: the commands of a diagnosis, or of a comparison. Writes the rows of the
table in docs/installation.md.
"""

import argparse
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path
from time import perf_counter

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "installation.md"
HEAD = "| purpose | packages | added, MB | environment, MB | seconds | tried there |\n" + "| --- " * 6 + "|\n"
PURPOSES = ("diagnose", "diagnose,recordings", "motion", "harness", "peers")
CONFIGURATION = (
    "{name: mine, problem: sphere, algorithms: [de], swarm_size: 5, evaluations: 50, repetitions: 2, seed: 1}"
)
DIAGNOSIS = (
    "recording example log",
    "recording import log/run-1.csv log/run-2.csv --robot log/robot.yaml --validate log/run-2.csv --out recording",
    "recording check recording --out checked.html",
    "diagnose recording --out verdict",
    "identify recording --method physical --out identified",
    "model export verdict/model.yaml corrected.xml",
)
TRIALS = {"diagnose": DIAGNOSIS, "harness": ("run mine.yaml", "report mine.yaml", "paper table3 --dry-run")}
WRITTEN = {"diagnose": "verdict/report.html", "harness": "results/mine_report.html"}


def measure(purpose: str, folder: Path) -> str:
    """A row: packages, MB added to an empty environment, MB of it all, seconds, and what was tried there."""
    environment = folder / "environment"
    subprocess.run([sys.executable, "-m", "venv", environment], check=True)
    empty, started = size_mb(environment), perf_counter()
    pip = [environment / "bin" / "python", "-m", "pip", "--disable-pip-version-check"]
    subprocess.run([*pip, "install", "--quiet", f"{ROOT}[{purpose}]"], check=True, cwd=folder)
    seconds, whole = perf_counter() - started, size_mb(environment)
    listed = subprocess.run([*pip, "list", "--format=freeze"], check=True, capture_output=True, text=True, cwd=folder)
    packages = len(listed.stdout.split()) - 2  # without pip and setuptools
    tried = try_commands(purpose, environment, folder)
    return f"| `{purpose}` | {packages} | {whole - empty:.0f} | {whole:.0f} | {seconds:.0f} | {tried} |\n"


def try_commands(purpose: str, environment: Path, folder: Path) -> str:
    """Runs the commands of a purpose in the environment and says so; raises CalledProcessError where one fails."""
    if purpose not in TRIALS:
        return ""
    (folder / "mine.yaml").write_text(CONFIGURATION, encoding="utf-8")
    own = {name: text for name, text in os.environ.items() if name != "PYTHONPATH"}
    for command in TRIALS[purpose]:
        subprocess.run([environment / "bin" / "armlab", *command.split()], check=True, cwd=folder, env=own)
    written = folder / WRITTEN[purpose]
    return f"{len(TRIALS[purpose])} commands to {written.name} ({written.stat().st_size / 1e3:.0f} kB)"


def size_mb(folder: Path) -> float:
    """Sizes of all files, 10^6 bytes; what a link names is not counted."""
    return sum(path.lstat().st_size for path in folder.rglob("*") if not path.is_dir() or path.is_symlink()) / 1e6


def with_row(page: str, purpose: str, row: str) -> str:
    """The page with the row of a purpose in the table, in the order of `PURPOSES`; other rows stay."""
    start = page.index(HEAD) + len(HEAD)
    table = re.match(r"(?:\|.*\n)*", page[start:])
    assert table is not None
    rows = {line.split("`")[1]: f"{line}\n" for line in table[0].splitlines()} | {purpose: row}
    return page[:start] + "".join(rows[name] for name in PURPOSES if name in rows) + page[start + table.end() :]


def main() -> None:
    """Measures the purposes that are named, all by default; rows of others stay."""
    parser = argparse.ArgumentParser(description="Measure installations.")
    parser.add_argument("purposes", nargs="*", help=f"of {', '.join(PURPOSES)} [default: all]")
    parser.add_argument("--scratch", type=Path, help="where environments are made and removed [default: a new folder]")
    chosen = parser.parse_args()
    for purpose in chosen.purposes or PURPOSES:
        with tempfile.TemporaryDirectory(dir=chosen.scratch) as folder:
            row = measure(purpose, Path(folder))
        PAGE.write_text(with_row(PAGE.read_text(encoding="utf-8"), purpose, row), encoding="utf-8")
        print(row, end="")


if __name__ == "__main__":
    main()
