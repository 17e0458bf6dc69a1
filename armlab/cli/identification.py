"""Commands of identification: `armlab identify`, `predict`, `payload` and `recording gains`."""

from collections.abc import Callable
from pathlib import Path

import click

from armlab.cli.options import FiniteNumber, OutputPath
from armlab.cli.output import prints_result, tell_progress
from armlab.common.documents import ResultLines

METHODS = (
    "weighted",
    "excited",
    "ordinary",
    "alike",
    "huber",
    "tukey",
    "total",
    "likelihood",
    "instrumental",
    "physical",
)


@click.command()
@click.argument("recording", type=click.Path(path_type=Path))
@click.option("--out", type=OutputPath(), help="Folder for model.yaml and report.html [default: RECORDING].")
@click.option(
    "--method",
    type=click.Choice(METHODS),
    metavar="NAME",
    help=f"Estimator: {', '.join(METHODS)} [default: the one that predicts best].",
)
@click.option(
    "--cutoff-hz", type=FiniteNumber(min=0, min_open=True), help="Cut-off of the low-pass [default: from the data]."
)
@click.option(
    "--tolerance",
    type=FiniteNumber(min=1e-6, max=1e6),
    help="Relative width of a prior about the robot's links.",
)
@click.option("--select", "choose", is_flag=True, help="Choose cut-off, components and prior by cross-validation.")
@click.option("--as-read", is_flag=True, help="Do not look for mistakes of signs, columns, units, zeros.")
@prints_result
def identify(
    recording: Path,
    out: Path | None,
    method: str | None,
    cutoff_hz: float | None,
    tolerance: float | None,
    choose: bool,
    as_read: bool,
) -> ResultLines:
    """Identify the parameters of an arm from RECORDING.

    RECORDING: a recording folder. A recording that is read wrongly is refused, with the correction.
    """
    from armlab.identification.identify import IdentifyOptions, identify_recording

    options = IdentifyOptions(method, cutoff_hz, tolerance, choose, as_read)
    return identify_recording(recording, out or recording, options, tell_progress)


@click.command()
@click.argument("model", type=click.Path(path_type=Path))
@click.argument("recording", type=click.Path(path_type=Path))
@click.option("--out", type=OutputPath(), help="Folder for the predicted torques, a CSV a run.")
@prints_result
def predict(model: Path, recording: Path, out: Path | None) -> ResultLines:
    """Compare the torque of MODEL with that of RECORDING.

    MODEL: a model.yaml. RECORDING: a recording folder.
    """
    from armlab.identification.identify import predict_recording

    return predict_recording(model, recording, out)


def _add_load_options(command: Callable[..., None]) -> Callable[..., None]:
    """Options of the commands about loads."""
    options = (
        click.option("--link", type=click.IntRange(min=1), help="Link that carries the load [default: the last]."),
        click.option(
            "--counterbalance", type=click.IntRange(min=1), help="Joint that has a counterbalance (a spring)."
        ),
        click.option(
            "--cutoff-hz",
            type=FiniteNumber(min=0, min_open=True),
            help="Cut-off of the low-pass [default: from the data].",
        ),
    )
    for option in reversed(options):
        command = option(command)
    return command


@click.command()
@click.argument("loaded", type=click.Path(path_type=Path))
@click.option(
    "--without", type=click.Path(path_type=Path), help="Recording without the load [default: the robot file]."
)
@click.option(
    "--centre",
    type=FiniteNumber(min=-100, max=100),
    nargs=3,
    help="Known place of the load in the link's frame, m; it is a point there, without inertia of its own.",
)
@_add_load_options
@prints_result
def payload(
    loaded: Path,
    without: Path | None,
    centre: tuple[float, float, float] | None,
    link: int | None,
    counterbalance: int | None,
    cutoff_hz: float | None,
) -> ResultLines:
    """Identify the load that an arm carries in LOADED.

    LOADED: a recording folder. Without --without the robot file stands for the arm without the load, and what else it
    lacks is found as `diagnose` finds it.
    """
    from armlab.diagnosis.torque.carried_load import nominal_payload_lines
    from armlab.identification.payload import PayloadSetting, Place, payload_lines

    setting = PayloadSetting(Place(link, centre), counterbalance, cutoff_hz)
    if without is None:
        return nominal_payload_lines(loaded, setting, tell_progress)
    return payload_lines(loaded, without, setting)


@click.command()
@click.argument("loaded", type=click.Path(path_type=Path))
@click.option(
    "--without",
    type=click.Path(path_type=Path),
    help="Recording without the load [default: the robot file's links stand for it].",
)
@click.option("--mass", type=FiniteNumber(min=0, max=1e5, min_open=True), required=True, help="Of the load, kg.")
@click.option(
    "--centre",
    type=FiniteNumber(min=-100, max=100),
    nargs=3,
    required=True,
    help="Its centre of mass in the link's frame, m.",
)
@_add_load_options
@prints_result
def gains(
    loaded: Path,
    without: Path | None,
    mass: float,
    centre: tuple[float, float, float],
    link: int | None,
    counterbalance: int | None,
    cutoff_hz: float | None,
) -> ResultLines:
    """Estimate the error of the torque gains of all joints.

    Uses the known load that the arm carries in LOADED, a recording folder.
    """
    from armlab.diagnosis.torque.carried_load import nominal_gains_lines
    from armlab.identification.payload import PayloadSetting, Place, gains_lines

    setting = PayloadSetting(Place(link, centre), counterbalance, cutoff_hz)
    if without is None:
        return nominal_gains_lines(loaded, mass, setting, tell_progress)
    return gains_lines(loaded, without, mass, setting)
