"""The commands of identification, without any logic of their own."""

from pathlib import Path

import click

METHODS = ("weighted", "ordinary", "alike", "huber", "tukey", "total", "likelihood", "instrumental", "physical")


@click.command()
@click.argument("recording", type=click.Path(path_type=Path))
@click.option(
    "--out", type=click.Path(path_type=Path), help="Folder for model.yaml and report.html [default: RECORDING]."
)
@click.option("--method", type=click.Choice(METHODS), default="weighted", show_default=True, help="Estimator.")
@click.option(
    "--cutoff-hz", type=click.FloatRange(min=0, min_open=True), help="Of the low-pass [default: from the data]."
)
@click.option(
    "--tolerance", type=click.FloatRange(min=0, min_open=True), help="Draw links to the robot's own, so far off."
)
@click.option("--select", "choose", is_flag=True, help="Choose cut-off, components and prior by cross-validation.")
def identify(
    recording: Path, out: Path | None, method: str, cutoff_hz: float | None, tolerance: float | None, choose: bool
) -> None:
    """Identify the parameters of the arm of RECORDING, a recording folder."""
    from identification.command import Options, identify_recording

    for line in identify_recording(recording, out or recording, Options(method, cutoff_hz, tolerance, choose)):
        click.echo(line)


@click.command()
@click.argument("model", type=click.Path(path_type=Path))
@click.argument("recording", type=click.Path(path_type=Path))
@click.option("--out", type=click.Path(path_type=Path), help="Folder for the predicted torques, a CSV a run.")
def predict(model: Path, recording: Path, out: Path | None) -> None:
    """Compare the torque of MODEL, a model.yaml, with that of RECORDING."""
    from identification.command import predict_recording

    for line in predict_recording(model, recording, out):
        click.echo(line)


@click.command()
@click.option("--results", type=click.Path(path_type=Path), default=Path("results/real"), show_default=True)
@click.option("--recordings", type=click.Path(path_type=Path), default=Path(".armlab/recordings"), show_default=True)
@click.option("--only", multiple=True, help="Name of a public recording [default: all].")
def real(results: Path, recordings: Path, only: tuple[str, ...]) -> None:
    """Identify the public recordings of real arms: identification.csv and a page with pictures."""
    from identification.real.command import identify_public

    for line in identify_public(results, recordings, only):
        click.echo(line)


@click.command()
@click.option("--experiments", type=click.IntRange(min=10), default=1000, show_default=True)
@click.option("--seed", type=int, default=0, show_default=True)
@click.option("--results", type=click.Path(path_type=Path), default=Path("results"), show_default=True)
def coverage(experiments: int, seed: int, results: Path) -> None:
    """How often 95 % intervals hold the truth, over simulated experiments: coverage.json."""
    from identification.coverage.command import write_coverage

    for line in write_coverage(experiments, seed, results):
        click.echo(line)


@click.command("export-model")
@click.argument("model", type=click.Path(path_type=Path))
@click.argument("out", type=click.Path(path_type=Path))
def export_model(model: Path, out: Path) -> None:
    """Write MODEL, a model.yaml with links, as OUT: a .urdf or an MJCF .xml file."""
    from identification.export.command import export_model as write

    for line in write(model, out):
        click.echo(line)
