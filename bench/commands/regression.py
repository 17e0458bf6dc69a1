"""The command that checks for regressions."""

from pathlib import Path

import click

from bench.commands.progress import trial_bar


@click.command()
@click.option("--update-baseline", "task", flag_value="update_baseline", help="Accept the present code as it is.")
@click.option("--calibrate", "task", flag_value="calibrate", help="Compute false-alarm rate and power; takes minutes.")
@click.option("--workers", type=click.IntRange(min=1), help="Processes [default: one a core].")
@click.option("--config", type=click.Path(path_type=Path), default=Path("configs/regression.yaml"), show_default=True)
@click.option("--results", type=click.Path(path_type=Path), default=Path("results"), show_default=True)
@click.pass_context
def regression(context: click.Context, task: str | None, workers: int | None, config: Path, results: Path) -> None:
    """Compare a short fixed sweep with the committed baseline; exit code 1 if a condition number changed."""
    from joblib import cpu_count

    from bench.regression.command import Regression

    report = getattr(Regression(config, results, workers or cpu_count(), trial_bar), task or "check")()
    for line in report.lines:
        click.echo(line)
    context.exit(report.exit_code)
