"""The commands of identification and the studies of it: options only, no logic."""

import json
import os
from collections.abc import Callable, Iterator
from pathlib import Path

import click

from armlab.cli.options import FiniteNumber, OutputPath, lock_option, tip_option
from armlab.cli.output import prints_lines, prints_result, tell_progress
from armlab.common.documents import ResultLines

METHODS = ("weighted", "ordinary", "alike", "huber", "tukey", "total", "likelihood", "instrumental", "physical")


@click.command()
@click.argument("recording", type=click.Path(path_type=Path))
@click.option("--out", type=OutputPath(), help="Folder for model.yaml and report.html [default: RECORDING].")
@click.option(
    "--method",
    type=click.Choice(METHODS),
    default="weighted",
    show_default=True,
    metavar="NAME",
    help=f"Estimator: {', '.join(METHODS)}.",
)
@click.option(
    "--cutoff-hz", type=FiniteNumber(min=0, min_open=True), help="Cut-off of the low-pass [default: from the data]."
)
@click.option(
    "--tolerance",
    type=FiniteNumber(min=0, min_open=True),
    help="Relative width of a prior about the robot's links.",
)
@click.option("--select", "choose", is_flag=True, help="Choose cut-off, components and prior by cross-validation.")
@click.option("--as-read", is_flag=True, help="Do not look for mistakes of signs, columns, units, zeros.")
@prints_result
def identify(
    recording: Path,
    out: Path | None,
    method: str,
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
    return identify_recording(recording, out or recording, options)


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


@click.command()
@click.option("--experiments", type=click.IntRange(min=10), default=1000, show_default=True)
@click.option("--seed", type=int, default=0, show_default=True)
@click.option("--results", type=OutputPath(), default=Path("results"), show_default=True)
@click.option(
    "--part",
    type=click.Choice(["all", "identification", "superiority"]),
    default="all",
    show_default=True,
    help="Measure a part alone; the file keeps the other one.",
)
@prints_lines
def coverage(experiments: int, seed: int, results: Path, part: str) -> Iterator[str]:
    """Measure how often 95 % intervals contain the truth.

    Simulates experiments and identifies them, and compares simulated ends of two algorithms (A12). Writes
    coverage.json.
    """
    from armlab.common.files import write_texts
    from armlab.identification.coverage import measure_coverage
    from bench.statistics.superiority import COVERAGE_SIMULATIONS, describe_coverage, superiority_coverage

    path = results / "coverage.json"
    found = json.loads(path.read_text()) if part != "all" and path.exists() else {}
    if part != "superiority":
        found |= yield from measure_coverage(experiments, seed)
    if part != "identification":
        held = superiority_coverage(seed)
        found["superiority"] = {"seed": seed, "simulations": COVERAGE_SIMULATIONS, "coverage": held}
        yield from describe_coverage(held)
    yield from map(str, write_texts({path.name: json.dumps(found, indent=2, allow_nan=False) + "\n"}, results))


@click.command("real-conditioning")
@click.option("--results", type=OutputPath(), default=Path("results/real"), show_default=True)
@click.option("--recordings", type=OutputPath(), default=Path(".armlab/recordings"), show_default=True)
@click.option("--only", multiple=True, help="Name of a public recording [default: all five arms].")
@prints_lines
def real_conditioning(results: Path, recordings: Path, only: tuple[str, ...]) -> Iterator[str]:
    """Test on real arms whether a small condition number helps.

    Identifies each public recording from many windows and predicts the runs that validate. Writes conditioning.md,
    two tables and a picture.
    """
    from armlab.identification.conditioning.study import study_conditioning

    return study_conditioning(results, recordings, only, tell_progress)


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
    help="Known place of the load in the link's frame, m.",
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
    from armlab.diagnosis.load import nominal_payload_lines
    from armlab.identification.payload import PayloadSetting, Place, payload_lines

    setting = PayloadSetting(Place(link, centre), counterbalance, cutoff_hz)
    if without is None:
        return nominal_payload_lines(loaded, setting, tell_progress)
    return payload_lines(loaded, without, setting)


@click.command()
@click.argument("loaded", type=click.Path(path_type=Path))
@click.option("--without", type=click.Path(path_type=Path), required=True, help="Recording without the load.")
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
    without: Path,
    mass: float,
    centre: tuple[float, float, float],
    link: int | None,
    counterbalance: int | None,
    cutoff_hz: float | None,
) -> ResultLines:
    """Estimate the error of the torque gains of all joints.

    Uses the known load that the arm carries in LOADED, a recording folder.
    """
    from armlab.identification.payload import PayloadSetting, Place, gains_lines

    return gains_lines(loaded, without, mass, PayloadSetting(Place(link, centre), counterbalance, cutoff_hz))


@click.command("lock-joints")
@click.argument("robot", type=click.Path(path_type=Path))
@click.argument("out", type=OutputPath())
@tip_option
@lock_option
@prints_result
def lock_joints(robot: Path, out: Path, tip: str | None, lock: tuple[str, ...]) -> ResultLines:
    """Make one arm of ROBOT and write it to OUT.

    ROBOT: a URDF or MJCF file with a gripper, mimic fingers or several arms.
    OUT: a new file of the same kind. The links of locked joints stay, with mass.
    """
    from armlab.common.errors import InputError
    from armlab.common.files import refuse_existing, write_whole
    from problem.locked_joints import lock_joints as lock_in_file
    from problem.locked_joints import parse_locks

    refuse_existing([out])
    locked = lock_in_file(robot, tip, parse_locks(lock), out.parent)
    if out.suffix != robot.suffix:
        raise InputError(f"{out}: the file should end in {robot.suffix}, as {robot} does")
    original = Path(os.path.relpath(locked.original, out.parent)).as_posix()
    write_whole(out, locked.text(original))
    yield f"{out}: {locked.words}"
    return {"files": [out], "joints": [joint.name for joint in locked.arm.joints], "locked": locked.positions}
