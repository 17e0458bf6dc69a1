"""Commands `armlab model ...`: robot files and models, and what a motion shows of them."""

import os
from pathlib import Path

import click

from armlab.cli.options import FiniteNumber, OutputPath, lock_option, tip_option
from armlab.cli.output import prints_result
from armlab.common.documents import ResultLines


@click.command()
@click.argument("model", type=click.Path(path_type=Path))
@click.argument("out", type=click.Path(path_type=Path))
@click.option(
    "--into",
    type=click.Path(path_type=Path),
    help="Robot file that takes the numbers [default: that of the model, the whole one where joints are locked].",
)
@lock_option
@prints_result
def export_model(model: Path, out: Path, into: Path | None, lock: tuple[str, ...]) -> ResultLines:
    """Export MODEL as URDF or MJCF.

    MODEL: a model.yaml with links. OUT: a .urdf file, or an .xml file for MJCF. Where the joints of a gripper were
    locked for the recording, they move in OUT; --lock says where they stood if the file of MODEL does not.
    """
    from armlab.identification.write_simulator import export_model as write
    from problem.locked_joints import parse_locks

    return write(model, out, into, parse_locks(lock))


@click.command()
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


@click.command()
@click.argument("robot")
@click.option("--columns", type=click.Choice(["later_columns", "earlier_columns"]), default="later_columns")
@prints_result
def base_parameters(robot: str, columns: str) -> ResultLines:
    """Show the base parameters of ROBOT.

    ROBOT: the name of a built-in arm, a robot file or a URDF.
    """
    from problem.base_parameters import base_parameters as group_parameters
    from problem.robot_file import load_arm

    found = group_parameters(load_arm(robot), columns)
    yield f"{len(found)} base parameters:\n  " + "\n  ".join(found.sums)
    yield f"{len(found.alone)} identifiable alone: " + " ".join(found.alone)
    yield f"{len(found.grouped)} only in sums: " + " ".join(found.grouped)
    yield f"{len(found.unidentifiable)} without effect: " + " ".join(found.unidentifiable)
    return {
        "sums": found.sums,
        "alone": found.alone,
        "only_in_sums": found.grouped,
        "without_effect": found.unidentifiable,
    }


@click.command()
@click.argument("robot")
@click.argument("trajectory")
@click.option(
    "--noise",
    multiple=True,
    type=FiniteNumber(min=0, min_open=True),
    help="Of the torque, N m: once, or once a joint [default: 1 %].",
)
@click.option("--joints", type=click.IntRange(min=1), help="How many of its first joints move [default: all].")
@click.option("--out", type=OutputPath(), help="Folder for the card as page, tables and pictures.")
@prints_result
def confusability(
    robot: str, trajectory: str, noise: tuple[float, ...], joints: int | None, out: Path | None
) -> ResultLines:
    """List the effects that TRAJECTORY cannot tell apart.

    Needs no recording: it tells before anyone records the trajectory.

    ROBOT: a file or a built-in name. TRAJECTORY: a CSV with t, q1, ... in s and rad, a recording folder, or the name
    of a trajectory in results/best_known.json.
    """
    from armlab.report.confusability.confusability_report import write_card

    return write_card(robot, trajectory, joints, noise, out)
