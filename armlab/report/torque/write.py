"""Diagnoses a recording and writes the verdict, the model, the report page and the pictures into a folder."""

import resource
import shlex
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, get_args

from armlab.common.documents import ResultLines
from armlab.common.errors import DataError, InputError
from armlab.common.files import write_texts
from armlab.common.processes import peak_memory_bytes
from armlab.common.report.page import render_page
from armlab.common.report.printed_table import table_files
from armlab.diagnosis.result import Diagnosis
from armlab.diagnosis.settings import Baseline, Settings, guards_without, vary
from armlab.diagnosis.torque.diagnose import diagnose
from armlab.diagnosis.tuning import parse_change
from armlab.recordings.load import load_recording
from armlab.recordings.reading.corrected import CORRECTED_FOLDER
from armlab.report.account.account import account_of
from armlab.report.account.next_steps import next_steps
from armlab.report.signals_file import SIGNALS_FILE, check_signals_writer, diagnosis_tracks, signals_content
from armlab.report.torque import content, measured
from armlab.report.torque.gallery import Gallery, draw_gallery
from armlab.report.torque.naming_files import WeighedOutcome, names_texts, parse_place, steps_texts, why_lines
from armlab.report.torque.residuals import select_residuals
from armlab.report.torque.torque_verdict import first_screen, verdict_lines
from armlab.report.verdict_files import (
    PREDICTED_FOLDER,
    check_output_folder,
    make_verdict,
    predicted_texts,
    verdict_texts,
)
from problem.joint_words import joint_at_start


def report_page(diagnosis: Diagnosis, gallery: Gallery | None, command: str) -> str:
    """HTML text. gallery: None where nothing was fitted."""
    more = {} if gallery is None else _details(diagnosis, gallery)
    return render_page(
        __package__,
        "report.html",
        f"Diagnosis of {diagnosis.recording.name} ({diagnosis.simulation.arm.name})",
        status=diagnosis.status,
        first=first_screen(diagnosis),
        setup=content.setup_part(diagnosis),
        joints=measured.joint_table(diagnosis) if diagnosis.claims else None,
        bodies=measured.body_sentences(diagnosis),
        free_joints=measured.joints_without_finding(diagnosis),
        steps=next_steps(diagnosis, account_of(diagnosis)),
        uses=content.uses(diagnosis),
        gallery=gallery,
        origin=content.origin_of(diagnosis.recording, diagnosis.simulation, command, diagnosis),
        **more,
    )


def _details(diagnosis: Diagnosis, gallery: Gallery) -> dict[str, Any]:
    """What is folded on the page, and only there where something was fitted."""
    return {
        "error_note": content.error_note(diagnosis, gallery.data),
        "filtered": gallery.data.filtered,
        "causes": content.cause_table(diagnosis),
        "findings": content.finding_details(diagnosis, gallery),
        "minor": content.finding_details(diagnosis, gallery, minor=True),
        "left": content.left_table(diagnosis),
        "fits": content.fit_table(diagnosis, gallery.data),
        "whiteness": content.whiteness_text(diagnosis, gallery.data),
        "located": content.located_table(diagnosis),
        "located_pictures": [
            (joint_at_start(diagnosis.simulation.arm, joint), pictures) for joint, pictures in gallery.located
        ],
        "method": content.method_text(diagnosis, gallery.data.observed.held_out_blocks),
    }


REPORT_PAGE, FIGURES_FOLDER = "report.html", "figures"


def report_texts(diagnosis: Diagnosis, command: str = "") -> dict[str, str]:
    """Names and content of the page and the pictures. command: that repeats it."""
    data = select_residuals(diagnosis)
    gallery: Gallery | None = None if data is None else draw_gallery(diagnosis, data)
    texts = {REPORT_PAGE: report_page(diagnosis, gallery, command)}
    if gallery is not None:
        texts |= {f"{FIGURES_FOLDER}/{name}": text + "\n" for name, text in gallery.files.items()}
    return texts


def write_report(diagnosis: Diagnosis, folder: Path, command: str = "") -> Path:
    """Writes report.html and figures/ into a folder and returns the page; InputError where that cannot be done."""
    write_texts(report_texts(diagnosis, command), folder)
    return folder / REPORT_PAGE


def folder_texts(diagnosis: Diagnosis, out: Path, settings: Settings, command: str = "") -> dict[str, str | bytes]:
    """The files of a diagnosis for a folder, by name. command: that makes them, as the page says it."""
    return {
        **verdict_texts(diagnosis, out),
        **report_texts(diagnosis, command),
        **names_texts(WeighedOutcome.of_diagnosis(diagnosis), settings),
        **steps_texts(diagnosis),
        **predicted_texts(diagnosis),
    }


def diagnose_recording(
    folder: Path,
    out: Path,
    baseline: str | None,
    seed: int,
    without: tuple[str, ...] = (),
    changes: tuple[str, ...] = (),
    as_read: bool = False,
    only_setup: bool = False,
    progress: Callable[[str], None] = lambda message: None,
    with_signals: bool = False,
    tables: Sequence[str] = (),
    verbose: bool = False,
    why: Sequence[str] = (),
    repetitions: int = 0,
) -> ResultLines:
    """Diagnoses a recording, writes verdict.json, report.html, model.yaml and figures, and yields lines to print.

    The document is the verdict, with the written files beside it.

    out: the folder, into which all files are written or none. without: guards that are switched off. changes: tuning
    numbers with other values, like `noise.max_order=8`. as_read: the reading of the recording is not doubted.
    only_setup: nothing but the reading is asked. progress: called with the name of each step. with_signals: whether
    `signals.mcap` is written. tables: forms in which the table of joints is written, too (`TABLE_FORMS`). verbose:
    whether the lines tell of every finding. why: effects as EFFECT@JOINT of which is told why they are named or not.
    repetitions: how often it is asked whether names survive.
    Raises InputError, in one line, for a recording that cannot be used, an
    unknown guard or an unknown tuning number.
    """
    if with_signals:
        check_signals_writer()
    chosen: Baseline | None = next((each for each in get_args(Baseline) if each == baseline), None)
    settings = Settings(guards=guards_without(without))
    for change in changes:
        settings = vary(settings, *parse_change(change))
    recording = load_recording(folder)
    places = [parse_place(each, recording.arm) for each in why]
    check_output_folder(out, recording)
    try:
        diagnosis = diagnose(recording, chosen, seed, settings, progress, as_read, only_setup, repetitions)
    except DataError as error:
        raise InputError(f"{folder}: {error}") from None
    progress("writing the report")
    options = [*(["--baseline", baseline] if baseline else []), *(["--seed", str(seed)] if seed else [])]
    options += [word for guard in without for word in ("--without", guard)]
    options += [word for change in changes for word in ("--set", change)]
    options += ["--as-read"] * as_read + ["--only-setup"] * only_setup + ["--mcap"] * with_signals
    options += ["--survival", str(repetitions)] if repetitions else []
    options += [word for form in dict.fromkeys(tables) for word in ("--table", form)]
    command = shlex.join(["armlab", "diagnose", str(folder), "--out", str(out), *options])
    texts = folder_texts(diagnosis, out, settings, command)
    if diagnosis.claims:
        texts |= table_files("joints", measured.joint_table(diagnosis), tables)
    moved = None
    if with_signals:
        joints = [joint.name for joint in diagnosis.recording.arm.joints]
        texts[SIGNALS_FILE], moved = signals_content(diagnosis_tracks(diagnosis), joints)
    written = write_texts(texts, out)
    yield from verdict_lines(diagnosis, verbose)
    for effect, joint in places:
        yield from why_lines(diagnosis, effect, joint)
    pictures = sum(name.startswith(FIGURES_FOLDER) for name in texts)
    files = ", ".join(name for name in texts if not name.startswith((FIGURES_FOLDER, PREDICTED_FOLDER)))
    more = f", {pictures} pictures in {FIGURES_FOLDER}" if pictures else ""
    more += (
        f", predicted torque in {PREDICTED_FOLDER}" if any(name.startswith(PREDICTED_FOLDER) for name in texts) else ""
    )
    yield f"wrote {out}: {files}{more}"
    if tables and not diagnosis.claims:
        yield "no table of joints: nothing was found"
    if moved is not None:
        yield moved
    if diagnosis.setup is not None and diagnosis.setup.reading is not None:
        yield f"corrected: {out / CORRECTED_FOLDER} holds the recording and the robot as they should be"
    if diagnosis.seconds:
        asked = f", {diagnosis.setup_seconds:.1f} s of it how it is to be read" if diagnosis.setup else ""
        memory_gb = peak_memory_bytes(resource.getrusage(resource.RUSAGE_SELF)) / 1e9
        yield f"diagnosed in {diagnosis.seconds:.1f} s once read{asked}; {memory_gb:.2f} GB of memory at most"
    return make_verdict(diagnosis).content() | {"files": written}
