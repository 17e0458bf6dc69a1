"""The flows of `armlab identify` and `armlab predict`: from a recording folder to lines, a model file and a page."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pandas as pd

from armlab.common.documents import ResultLines
from armlab.common.errors import DataError, InputError
from armlab.common.files import write_texts
from armlab.common.report.page import Table, png_address, render_page
from armlab.common.report.palette import figure_style
from armlab.common.report.wording import format_number, format_unit
from armlab.effects.contract import Candidate
from armlab.effects.library import effect_named
from armlab.identification.identifier import USUAL_METHOD, Identifier
from armlab.identification.identifier_choice import choose_identifier
from armlab.identification.model import Model
from armlab.identification.model_file import model_content, model_text
from armlab.identification.priors import NO_PULL, Pull
from armlab.identification.selection import (
    candidate_groups,
    candidate_pulls,
    components_of,
    describe_choice,
    select_structure,
)
from armlab.identification.torque_model import is_told, parameter_line
from armlab.identification.validation import (
    RunError,
    error_table,
    filter_of_errors,
    format_percent,
    run_error,
    total_error_line,
)
from armlab.recordings.cutoff_trial import choose_cutoff_hz
from armlab.recordings.dead_joints import NO_TORQUE
from armlab.recordings.identifiable import require_identifiable, require_possible, require_torque
from armlab.recordings.load import load_recording
from armlab.recordings.plain_least_squares import PlainModel, fit_plain_rows, prepare_rows
from armlab.recordings.reading.answer import Answer, read_rightly
from armlab.recordings.reading.corrected import CORRECTED_FOLDER, corrected_texts
from armlab.recordings.reading.tuning import ReadingTuning
from armlab.recordings.recording import ROLES, Recording, Role, Run


def identification_page(recording: Recording, identifier: Identifier, errors: tuple[RunError, ...]) -> str:
    """The page, as HTML."""
    model = identifier.model_
    with figure_style():
        pictures = [(run.name, png_address(model.plot(run))) for run in recording.runs]
    return render_page(
        "armlab.identification",
        "identification.html",
        f"Identification of {recording.name}",
        summary=f"Cut-off {model.cutoff_hz:.4g} Hz; condition number {identifier.condition_number_:.4g} (columns at "
        "unit length); each 95 % interval is for correlated errors.",
        choices=model.provenance.get("choices", []),
        errors=_joint_errors(errors),
        filtered=filter_of_errors(errors),
        totals=[total_error_line(each) for each in errors],
        parameters=_parameters(model),
        untold=untold_names(model),
        warnings=[*overfit_warnings(errors), *impossible_warnings(model)],
        pictures=pictures,
    )


def parameter_lines(model: Model) -> Iterator[str]:
    """Each parameter that the data tell with its interval; the names of the others, which may as well be zero."""
    told = [(part, each) for part, each in model.named_parameters() if is_told(each)]
    yield from (f"{part}: {parameter_line(each)}" for part, each in told)
    others = untold_names(model)
    if others:
        yield f"not told by these data, each may be zero: {', '.join(others)}"


def untold_names(model: Model) -> list[str]:
    """What the data do not tell: components as they are labelled, base parameters by the first of their sum."""
    untold = [(part, each) for part, each in model.named_parameters() if not is_told(each)]
    names = ((part, each.name.split(" ")[0]) for part, each in untold)
    return [name if part == "base parameters" else f"{part}: {name}" for part, name in names]


def overfit_warnings(errors: tuple[RunError, ...]) -> Iterator[str]:
    """A line for each joint that held-out runs leave much more of than the runs that were fitted, in percent."""
    fitted, held_out = (_percent_by_joint(errors, role) for role in ROLES)
    if all(percent > NOTHING_EXPLAINED for percent in (held_out or fitted).values()):
        yield "warning: the model explains no joint's torque: another robot, or columns that are no torque?"
    for joint, percent in held_out.items():
        known = fitted.get(joint)
        if known and percent > MAX_HELD_OUT_RATIO * known:
            yield (
                f"warning: joint {joint} leaves {percent:.0f} % of its torque held out and {known:.0f} % of what was "
                "fitted: the model does not carry over; record longer motion, or fit fewer numbers (--tolerance)"
            )


def impossible_warnings(model: Model) -> Iterator[str]:
    """A line for each number of a joint whose whole interval is below zero, where no joint has one."""
    for index, part in enumerate(model.structure.components):
        positive = {each.name for each in effect_named(part.effect).parameters if each.positive}
        for each in model.component_parameters(index):
            if each.name in positive and isinstance(each.interval, tuple) and np.max(each.interval) < 0:
                yield (
                    f"warning: {part.label}: {parameter_line(each)}, which cannot be below zero: the data do not tell "
                    "it from the links; take --method physical, or record faster motion"
                )


def _percent_by_joint(errors: tuple[RunError, ...], role: Role) -> dict[int, float]:
    """The mean error of each joint over the runs of a role, percent of the torque."""
    own = [each for each in errors if each.role == role]
    return {
        joint.joint: float(np.mean([each.joints[number].percent or 0.0 for each in own]))
        for number, joint in enumerate(own[0].joints if own else ())
    }


def _joint_errors(errors: tuple[RunError, ...]) -> Table:
    rows = [
        [
            each.run,
            each.role,
            str(joint.joint),
            f"{joint.rms:.4g}",
            format_percent(joint.percent),
            format_percent(joint.percent_plain),
            format_percent(joint.percent_rated),
        ]
        for each in errors
        for joint in each.joints
    ]
    return Table(
        ["run", "role", "joint", "rms, N m", "of torque", "plain least squares", "of rated torque"],
        rows,
        (0, 1),
        stacked=True,
    )


def _parameters(model: Model) -> Table:
    """Each parameter that the data tell with its 95 % interval and its unit; a dash where it has none."""
    rows = []
    for part, each in model.named_parameters():
        if not is_told(each):
            continue
        interval = "–"
        if each.interval is not None:
            interval = " to ".join(format_number(float(end), 4) for end in np.asarray(each.interval))
        value = format_number(float(np.asarray(each.value)), 4)
        rows.append([f"{part.replace('_', ' ')}: {each.name}", value, interval, format_unit(each.unit)])
    return Table(["parameter", "value", "95 % interval", "unit"], rows, (0, 3), stacked=True)


NOTHING_EXPLAINED = 90.0  # percent of the torque, that a model leaves of noise, or more (chosen by eye)
MIN_PERIODS = 5  # of a cut-off that is given, within the longest run
MAX_HELD_OUT_RATIO = 2.0  # of the errors on runs that were held out to those that were fitted (chosen by eye)
NO_VALIDATION_WARNING = (
    "no run validates: these are errors on the identification runs themselves, so they are too small"
)


@dataclass(frozen=True)
class IdentifyOptions:
    """method: one of METHODS, chosen if left out (`choose_identifier`). tolerance: of a prior about the robot's own
    links. choose: by cross-validation.

    as_read: the recording and the robot file are not doubted. components: other ones than the usual.
    """

    method: str | None = None
    cutoff_hz: float | None = None
    tolerance: float | None = None
    choose: bool = False
    as_read: bool = False
    components: tuple[Candidate, ...] | None = None


def fit_identifier(
    recording: Recording, options: IdentifyOptions, progress: Callable[[str], None] = lambda message: None
) -> tuple[Identifier, list[str]]:
    """The fitted identifier of a recording that is read rightly, and lines that say what was chosen.

    Raises InputError, in one line, for a recording that cannot be used.
    """
    require_possible(recording)
    runs = recording.runs_to_identify()
    progress("choosing cut-off and components" if options.choose else "choosing the cut-off")
    try:
        identifier, how = _build_identifier(recording, options)
        progress("fitting")
        identifier.fit(runs)
    except DataError as error:
        raise InputError(f"{recording.folder}: {error}") from None
    facts = {"recording": recording.name, "runs": [run.name for run in runs], "version": version("armlab")}
    facts |= {"choices": how} if how else {}
    identifier.model_.provenance.update(facts)
    return identifier, how


def identify_recording(
    folder: Path, out: Path, options: IdentifyOptions, progress: Callable[[str], None] = lambda message: None
) -> ResultLines:
    """Identifies, writes model.yaml and report.html into `out`, and yields lines with parameters and errors.

    The document has the content of the model and the errors of each run. progress: is told what is being done.

    Raises InputError, in one line, for a recording that cannot be used or is read wrongly, and options that do not fit
    it. `corrected/` in `out` then holds the recording as it should be read.
    """
    progress("reading the recording")
    recording = load_recording(folder)
    require_identifiable(recording)
    if options.tolerance and recording.arm.links is None:
        raise InputError(f"--tolerance needs nominal `links`, and the robot {recording.arm.name} has none")
    if not options.as_read:
        progress("asking how it is to be read")
        _refuse_wrong_reading(recording, out)
    identifier, how = fit_identifier(recording, options, progress)
    model = identifier.model_
    plain = _plain_beside(recording, model)
    errors = tuple(run_error(model, model.signals(run), plain, recording.arm) for run in recording.runs)
    yield from how
    yield from (each.text for each in recording.findings if each.kind == NO_TORQUE)
    yield from parameter_lines(model)
    yield from (f"{part.label}: no motion separates it from the links, left out" for part in identifier.absorbed_)
    yield f"condition number: {identifier.condition_number_:.4g} (columns at unit length)"
    yield error_table(errors)
    if not recording.with_role("validate"):
        yield NO_VALIDATION_WARNING
    yield from overfit_warnings(errors)
    yield from impossible_warnings(model)
    progress("drawing the page")
    page = identification_page(recording, identifier, errors)
    file, report = write_texts({"model.yaml": model_text(model, out), "report.html": page}, out)
    yield f"model: {file}"
    yield f"page: {report}"
    return {
        "recording": recording.name,
        "model": model_content(model, out),
        "condition_number": identifier.condition_number_,
        "left_out": [part.label for part in identifier.absorbed_],
        "errors": errors,
        "validated": bool(recording.with_role("validate")),
        "files": [file, report],
    }


def _plain_beside(recording: Recording, model: Model) -> PlainModel | None:
    """Plain least squares on the same runs behind the same cut-off; None where these are too short for it."""
    cutoff = model.signals(recording.runs[0]).filter.cutoff_hz
    try:
        rows = [prepare_rows(run, cutoff) for run in recording.runs_to_identify()]
        return fit_plain_rows(recording.arm, rows, cutoff)
    except DataError:
        return None


def wrong_reading(recording: Recording) -> Answer | None:
    """What is wrong with the reading of a recording; None where nothing is."""
    answer = read_rightly(
        recording, recording.arm.parameters if recording.arm.links is not None else None, ReadingTuning()
    )
    return answer if answer.mistakes else None


def _refuse_wrong_reading(recording: Recording, out: Path) -> None:
    """Raises InputError for a recording that is read wrongly, once the corrected one is written."""
    answer = wrong_reading(recording)
    if answer is None:
        return
    hint = "give --as-read to identify it all the same"
    if answer.reading is not None:
        corrected = out / CORRECTED_FOLDER
        write_texts(corrected_texts(recording.folder, answer.reading, corrected), corrected)
        hint = f"{corrected} holds it as it should be, {hint}"
    raise InputError(f"{recording.folder}: {answer.sentence} {hint[0].upper()}{hint[1:]}")


def _build_identifier(recording: Recording, options: IdentifyOptions) -> tuple[Identifier, list[str]]:
    arm, robot = recording.arm, robot_path(recording)
    pull = Pull("nominal", options.tolerance) if options.tolerance else NO_PULL
    if not options.choose:
        cutoff, how = options.cutoff_hz, list[str]()
        longest = max(float(np.ptp(run.time)) for run in recording.runs)
        if cutoff is not None and cutoff * longest < MIN_PERIODS:
            least = MIN_PERIODS / longest
            raise InputError(f"--cutoff-hz {cutoff:g}: the longest run lasts {longest:.3g} s, give {least:.2g} or more")
        if cutoff is None:
            cutoff = choose_cutoff_hz(arm, recording.runs_to_identify())
            how = [f"cut-off: {cutoff:.4g} Hz, which predicts best on blocks of the runs that identify"]
        if options.method is not None or options.components is not None or options.tolerance:
            return Identifier(arm, options.components, options.method or USUAL_METHOD, pull, cutoff, robot), how
        chosen = choose_identifier(arm, recording.runs_to_identify(), cutoff, robot)
        return chosen.identifier, [*how, f"delivered: {chosen.sentence}"]
    groups = candidate_groups(arm)
    candidates = (pull,) if options.tolerance else candidate_pulls(arm)
    choice = select_structure(arm, recording.with_role("identify"), groups, candidates).choice
    line = f"chosen: {describe_choice(choice)}; held-out error {100 * choice.held_out:.2f} % of the torque"
    method = options.method or (USUAL_METHOD if choice.by_joint else "alike")
    components = components_of(groups, choice.groups)
    filters = choice.cutoff_hz, robot, choice.position_factor
    return Identifier(arm, components, method, choice.pull, *filters), [line]


def robot_path(recording: Recording) -> str:
    """The robot file beside the recording, as a path from the working folder; a built-in name where there is none."""
    beside = recording.folder / recording.robot
    return str(beside) if beside.is_file() else recording.robot


def predict_recording(path: Path, folder: Path, out: Path | None) -> ResultLines:
    """Errors of a model on each run of a recording, in lines; predicted torques as CSV files into `out`."""
    model, recording = Model.load(path), load_recording(folder)
    if len(model.arm) != len(recording.arm):
        raise InputError(f"{path} is for {len(model.arm)} joints, {folder} has {len(recording.arm)}")
    require_torque(recording)
    errors = tuple(run_error(model, model.signals(run), arm=recording.arm) for run in recording.runs)
    yield error_table(errors)
    written: tuple[Path, ...] = ()
    if out is not None:
        texts = {f"{run.name.replace('/', '-')}.predicted.csv": _torque_text(model, run) for run in recording.runs}
        written = write_texts(texts, out)
        yield from map(str, written)
    return {"recording": recording.name, "errors": errors, "files": written}


def _torque_text(model: Model, run: Run) -> str:
    """The predicted torque of a run with its times, as CSV."""
    signals = model.signals(run)
    names = [f"tau{joint + 1}" for joint in range(len(model.arm))]
    table = pd.DataFrame(model.torque(signals.motion, signals.run), columns=names)
    table.insert(0, "t", signals.run.time)
    return str(table.to_csv(index=False))
