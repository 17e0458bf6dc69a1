"""Commands on results that are there: report, compare, share, salvage.

RESULTS is a configuration file, whose outcomes are in the run store, or a folder of tidy tables as `share` writes it.
"""

from pathlib import Path

import click

_PATH = click.Path(path_type=Path)
_STORE = click.option(
    "--store", type=_PATH, default=Path(".armlab/runs.sqlite"), show_default=True, help="File with finished trials."
)


@click.command()
@click.argument("results", type=_PATH)
@_STORE
@click.option("--out", type=_PATH, help="HTML file [default: results/NAME_report.html].")
def report(results: Path, store: Path, out: Path | None) -> None:
    """One self-contained HTML page about RESULTS: a configuration file, or a folder that `share` wrote."""
    from bench.report.command import write_report

    click.echo(write_report(results, store, out))


@click.command()
@click.argument("first", type=_PATH)
@click.argument("second", type=_PATH)
@_STORE
@click.option("--out", type=_PATH, help="Folder for comparison.md and .csv [default: print only].")
def compare(first: Path, second: Path, store: Path, out: Path | None) -> None:
    """What changed from the results FIRST to SECOND, algorithm by algorithm and problem by problem."""
    from bench.comparing.command import compare_results

    click.echo(compare_results(first, second, store, out), nl=False)


@click.command()
@click.argument("results", type=_PATH)
@_STORE
@click.option("--as", "form", type=click.Choice(["csv", "parquet", "ioh"]), default="csv", show_default=True)
@click.option("--out", type=_PATH, required=True, help="Folder to write into.")
def share(results: Path, store: Path, form: str, out: Path) -> None:
    """Write RESULTS as tidy tables (csv, parquet) or in the format of IOHprofiler (ioh)."""
    from bench.sharing.command import share as share_results

    for path in share_results(results, store, form, out):
        click.echo(path)


@click.command()
@click.argument("damaged", type=_PATH)
@click.option("--out", type=_PATH, required=True, help="File of the new store.")
def salvage(damaged: Path, out: Path) -> None:
    """Take what is readable of a DAMAGED run store into a new one; the rest is computed again by the next run."""
    from bench.salvage import salvage as save

    click.echo(f"{save(damaged, out)} outcomes of {damaged} are in {out}")
