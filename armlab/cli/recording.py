"""Commands `armlab recording ...`: options and messages; heavy imports wait until a command runs."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import click

from armlab.cli.options import OutputPath, PagePath, lock_option, tip_option
from armlab.cli.output import can_ask, prints_result, tell_progress
from armlab.common.documents import FailedResultError, ResultLines

PUBLIC_RECORDING_NAMES = (
    "kuka-kr300",
    "emps",
    "staubli-tx40",
    "unisa-ur10",
    "unisa-panda",
    "friction-damper-20-lb",
    "friction-damper-25-lb",
    "friction-damper-35-lb",
    "friction-damper-80-lb",
)
PUBLIC_MOTION_NAMES = ("so101", "xl330-kp-100", "xl330-kp-200", "xl330-kp-400", "xl330-kp-800")
ASKED_SIGNALS = ("time", "position", "torque")
OPTIONAL_SIGNALS = (
    "velocity",
    "temperature",
    "voltage",
    "link_position",
    "reference_position",
    "reference_velocity",
    "simulated_torque",
    "simulated_position",
)


@click.command()
@click.argument("folder", type=click.Path(path_type=Path))
@click.option("--out", type=PagePath(), help="HTML file to write [default: NAME-check.html].")
@prints_result
def check(folder: Path, out: Path | None) -> ResultLines:
    """Check and draw a recording.

    Lists errors, repairs and suspicious channels, and draws the signals on one HTML page.
    """
    from armlab.recordings.check import check_recording
    from armlab.recordings.check_report import write_check_page

    found = check_recording(folder, tell_progress)
    tell_progress("drawing the page")
    page = write_check_page(found, out or Path(f"{found.recording.name}-check.html"))
    document = found.document | {"files": [page]}
    yield from found.lines or ("nothing was repaired and nothing looks wrong",)
    yield f"page: {page}"
    if found.refused:
        count = len(found.refused)
        message = f"{count} of the run files of {folder} cannot be used; the lines above say why"
        raise FailedResultError(message, document, status=2)
    return document


@click.command()
@click.argument("name", metavar="NAME", type=click.Choice((*PUBLIC_RECORDING_NAMES, *PUBLIC_MOTION_NAMES)))
@click.option("--out", type=OutputPath(), help="New folder for the recording [default: NAME].")
@prints_result
def fetch(name: str, out: Path | None) -> ResultLines:
    """Fetch a public recording of a real arm.

    The recording is written as a recording folder.
    """
    from armlab.recordings.public import PUBLIC_RECORDINGS, fetch_recording
    from armlab.recordings.public_motion import fetch_motion_recording

    if name in PUBLIC_MOTION_NAMES:
        folder = fetch_motion_recording(name, out or Path(name))
        yield f"{folder}: motion only; its recording.yaml names the source"
        return {"recording": folder}
    folder, public = fetch_recording(name, out or Path(name)), PUBLIC_RECORDINGS[name]
    yield f"{folder}: from {public.source}, licence {public.licence}"
    return {"recording": folder, "source": public.source, "licence": public.licence}


@click.command()
@click.argument("folder", type=OutputPath())
def example(folder: Path) -> None:
    """Write the log of a simulated arm, to try the commands.

    Two runs as CSV, the robot file, and in hidden.yaml what the robot file lacks.
    """
    from armlab.effects.example import write_example

    for path in write_example(folder):
        click.echo(path)


@click.command()
@click.argument("folder", type=click.Path(path_type=Path))
@click.argument("out", type=OutputPath())
@click.option("--task", default="Move the arm.", show_default=True, help="What the arm does, in a sentence.")
@click.option("--fps", type=click.IntRange(min=1), help="Frames a second [default: the rate of the first run].")
@prints_result
def export(folder: Path, out: Path, task: str, fps: int | None) -> ResultLines:
    """Write FOLDER as a LeRobot dataset.

    FOLDER: a recording of motion only. Writes a new folder OUT, version 3.0: an episode a run, the command as action,
    angles in degrees.
    """
    from armlab.recordings.lerobot_dataset import write_lerobot

    dataset = write_lerobot(folder, out, task, fps)
    yield f"{dataset}: a LeRobot dataset, version 3.0"
    return {"dataset": dataset}


def _column_options(command: Callable[..., None]) -> Callable[..., None]:
    for signal in reversed((*ASKED_SIGNALS, *OPTIONAL_SIGNALS)):
        flag = f"--{signal.replace('_', '-')}"
        command = click.option(flag, signal, metavar="NAMES", help=f"Column(s) of {signal.replace('_', ' ')}.")(command)
    return command


@click.command()
@click.argument("files", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--robot", help="Built-in robot, or path of a robot file.")
@tip_option
@lock_option
@click.option("--repair", is_flag=True, help="Write the nearest bodies for links of the robot that no body can be.")
@click.option("--out", type=OutputPath(), help="New folder for the recording.")
@_column_options
@click.option("--unit", "units", multiple=True, metavar="SIGNAL=UNIT", help="Unit of a signal, such as position=deg.")
@click.option("--gains", metavar="NUMBERS", help="Gain of each channel, N.m per A or V.")
@click.option(
    "--gear-ratio",
    metavar="NUMBERS",
    help="For signals of the motors: turns of the motor in one turn of the joint, one a joint, with its sign.",
)
@click.option(
    "--motor-side",
    type=click.Choice(["both", "position", "torque"]),
    help="With --gear-ratio: what was measured at the motors (velocities and commands go with the position). "
    "[default: both]",
)
@click.option("--joints", metavar="NAMES", help="Motion only: joints of the robot in the order of the columns.")
@click.option(
    "--controller",
    metavar="KEY=VALUES ...",
    help="Motion only: the drive, as 'kp=25 kd=5 delay=0.1', SI units, or a .py file with actuators of Isaac Lab.",
)
@click.option("--validate", multiple=True, type=click.Path(path_type=Path), help="File with role validate.")
@click.option("--separator", help="Separator of a text file: a character or a word (tab, blank).")
@click.option("--decimal", type=click.Choice([".", ","]), help="Decimal sign of a text file.")
@click.option("--topic", help="Topic of the joint or controller states in a bag.")
@click.option("--command-topic", metavar="TOPIC", help="Topic of the commands in a bag.")
@prints_result
def import_(files: tuple[Path, ...], **options: Any) -> ResultLines:
    """Convert files of other formats.

    Reads .mat, .npz, ROS bags, MCAP, Parquet, JSON, CSV of any layout and LeRobot datasets, packed or not, and writes
    a new recording folder.
    Without --torque, --reference-position makes a recording of motion only, and
    so does a bag with the states of a controller or with --command-topic.

    In a terminal the command shows what it recognised and asks for the rest.
    Elsewhere, and with --quiet or --json, one message names all missing options.

    NAMES are column names with commas between them; * and ? stand for any characters.
    """
    from armlab.cli.import_form import command_of, fill_in
    from armlab.recordings.imports.files import write_plan
    from armlab.recordings.imports.plan import plan_import
    from armlab.recordings.imports.sources import read_sources

    read = partial(read_sources, progress=tell_progress)
    imported = write_plan(fill_in(files, options) if can_ask() else plan_import(files, options, read))
    yield from imported.lines
    if imported.plan.options != options:
        yield f"the same without questions: {command_of(files, imported.plan.options)}"
    return imported.document
