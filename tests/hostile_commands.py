"""Damages the input of commands by seeded chance, runs them, and judges what they do: `hostile_commands.py`.

The command writes the list of outcomes, `tests/hostile_outcomes.csv`, one row a case. With `--seconds` it tries seeds
that are not in the list, all kinds in turn, prints what is broken, and leaves the list as it is.

A case is right where the command uses its input (exit 0, no NaN in any file) or refuses it (exit 2, one line, nothing
written). `recording check` writes its page in both cases. Anything else is broken: a traceback, a hang, another exit
status, a file half written.
"""

import argparse
import csv
import json
import os
import random
import re
import signal
import string
import sys
import time
import warnings
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import astuple, dataclass, fields
from functools import cache
from html import escape
from itertools import count
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import yaml
from click.testing import CliRunner
from gripper_robots import GRIPPER_MJCF, GRIPPER_URDF

from armlab.cli.main import main as armlab
from problem.locked_joints import lock_joints
from problem.robot_file import BUILT_IN_FOLDER

OUTCOMES = Path(__file__).with_name("hostile_outcomes.csv")
TIME_LIMIT_S = 120
TOLD_NAN = re.compile(r"(?i)(?<![\w/])-?nan\b")
REPAIR = re.compile(r"line \d+: \S+ = nan")  # what a repair tells of its row
HOSTILE_VALUES: tuple[Any, ...] = (
    *(float("nan"), float("inf"), -1, 0, 1e307, -1e307, 10**400, "", "../..", "/etc/passwd", "\u202e", "<b>", None),
    *([], {}, [[]], {"a": {}}, True, "1e5", [1, "x"], "x" * 10_000),
)
HOSTILE_WORDS = (
    *("nan", "inf", "-1", "0", "1e307", "-1e307", "1" + "0" * 400, "", "no/such/place", "/dev/null", "\u202e", "<b>"),
    *("x", "1,2", "*", "--help-me", "x" * 10_000, "\N{SNOWMAN}", "1e-320", "%s", "a=b"),
)
HOSTILE_CELLS = ("", "nan", "inf", "1e307", "-1e307", "1e400", "x", "1;2", '"', "0x10", "\u0663", "1,5", "\x00")
LINK = {"mass": 2.0, "first_moment": [0.01, 0.02, 0.1], "inertia": [0.1, 0.1, 0.1, 0, 0, 0]}
HEAVY_LINK = {"mass": 20.0, "first_moment": [0.01, 0.02, 0.1], "inertia": [5.0, 5.0, 5.0, 0, 0, 0]}
EXPERIMENT = {
    "name": "h",
    "problem": ["sphere"],
    "algorithms": ["spso"],
    "swarm_size": 10,
    "iterations": 5,
    "repetitions": 1,
    "seed": 1,
}
PAIR = ["spso", "random-search"]
ROBOT = {
    "name": "two",
    "dh_convention": "standard",
    "joints": [{"name": f"j{n}", "type": "revolute", "a": 0.3, "d": 0.1, "alpha": 1.57} for n in (1, 2)],
    "links": [LINK, LINK],
}
MODEL = {"schema": "model/1", "robot": "irb120-arm", "links": [LINK] * 3, "components": []}
RECORDING = {
    "schema": "recording/1",
    "robot": "irb120-arm",
    "columns": {"time": "t", "position": ["q1", "q2", "q3"], "torque": ["u1", "u2", "u3"]},
    "units": {"time": "s", "position": "rad", "torque": "N.m"},
    "gains": [1.0, 1.0, 1.0],
    "transmission": {"offset": [0.0, 0.0, 0.0]},
    "runs": [{"file": "run.csv", "role": "identify"}],
}
SERVO_RECORDING = {
    "schema": "recording/1",
    "robot": "../robot.yaml",
    "columns": {"time": "t", "reference_position": ["c1", "c2"], "position": ["q1", "q2"]},
    "units": {"time": "s", "reference_position": "rad", "position": "rad"},
    "controller": {"type": "pd", "kp": [60.0, 60.0], "kd": [0.3, 0.3], "torque_limit": [30.0, 30.0], "delay": 0.0},
    "runs": [{"file": "run.csv", "role": "identify"}],
}
FINDING = {
    "effect": "viscous_friction",
    "kind": "physics",
    "joint": 1,
    "joints": [1],
    "parameters": {"coefficient": {"value": 2.3, "ci95": [2.2, 2.4], "unit": "N.m.s/rad"}},
    "equation": "tau_1 += 2.3 qd_1",
    "heldout_rms_before": 1.9,
    "heldout_rms_after": 0.1,
    "p_value": 1e-9,
    "rivals": [{"effect": "coulomb_friction", "joint": 1}],
    "next_experiment": None,
}
FIT = {"joint": 1, "heldout_rms_before": 1.9, "heldout_rms_after": 0.1, "noise_floor": 0.05, "gap_closed": 0.9}
SAFETY = {
    "floor": -0.3,
    "keep_out": [[[0.7, 0.7, 0.7], [0.8, 0.8, 0.8]]],
    "near": [0.0, 0.0, 0.0],
    "range": [[-1.0, 1.0], [-1.0, 1.0], [-1.0, 1.0]],
    "clearance": 0.01,
    "radius": 0.05,
}
VERDICT = {
    "schema": "verdict/1",
    "status": "mismatch",
    "summary": "Friction.",
    "located": [],
    "findings": [FINDING],
    "unexplained": [],
    "fit": [FIT | {"joint": joint} for joint in (1, 2, 3)],
}


@dataclass(frozen=True)
class Outcome:
    """What a command did with a damaged input. verdict: used, refused, or what is broken. told: its last line."""

    case: str
    exit_status: int
    verdict: str
    told: str


def run_csv() -> str:
    """A run of 3 s of the built-in three-joint arm, moved by sums of sines; its torque is no arm's."""
    time = np.arange(300) / 100
    columns = [time, *(np.sin((1 + n / 3) * time + n) for n in range(3)), *(np.cos(2 * time * n) for n in range(1, 4))]
    rows = "".join(",".join(f"{cell:.6f}" for cell in row) + "\n" for row in np.column_stack(columns))
    return "t,q1,q2,q3,u1,u2,u3\n" + rows


def servo_csv() -> str:
    """A run of 4 s of two servos that follow their commands late; no arm moves just so."""
    time = np.arange(200) / 50
    columns = [time, *(np.sin((1 + n) * (time - late)) for late in (0.0, 0.04) for n in range(2))]
    rows = "".join(",".join(f"{cell:.6f}" for cell in row) + "\n" for row in np.column_stack(columns))
    return "t,c1,c2,q1,q2\n" + rows


@cache
def shared_results() -> dict[str, str]:
    """The files of a small experiment as `bench share` writes them."""
    with TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "experiment.yaml").write_text(yaml.safe_dump(EXPERIMENT | {"repetitions": 3, "algorithms": PAIR}))
        store = ["--store", f"{name}/s.sqlite"]
        run = ["run", f"{name}/experiment.yaml", "--workers", "1", *store, "--results", f"{name}/results"]
        share = ["bench", "share", f"{name}/experiment.yaml", *store, "--out", f"{name}/shared"]
        for words in (run, share):
            done = CliRunner().invoke(armlab, words)
            if done.exit_code != 0:
                raise RuntimeError(done.output)
        return {path.name: path.read_text() for path in sorted((folder / "shared").iterdir())}


@cache
def locked_robots() -> dict[str, str]:
    """Files of the robots with a gripper whose fingers are locked."""
    with TemporaryDirectory() as name:
        texts = {}
        for suffix, text in ((".urdf", GRIPPER_URDF), (".xml", GRIPPER_MJCF)):
            whole = Path(name) / f"toy{suffix}"
            whole.write_text(text)
            texts[f"locked{suffix}"] = lock_joints(whole, "hand", {}, whole.parent).text(whole.name)
        return texts


@cache
def known_record(name: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """A record, and a file of records that has this one alone."""
    content = json.loads((Path(__file__).parents[1] / "results" / "best_known.json").read_text(encoding="utf-8"))
    record = content["problems"][name]
    return record, content | {"problems": {name: record}}


def submission(name: str) -> dict[str, Any]:
    """A smaller motion than that of a record, within all its limits."""
    record, _ = known_record(name)
    smaller = {key: 0.5 * value for key, value in record["coefficients"].items()}
    return {"problem": name, "coefficients": smaller, "by": "somebody", "source": "a page"}


def mutate(content: Any, rng: random.Random) -> Any:
    """The content with one key or entry replaced, removed or added."""
    if isinstance(content, dict) and content and rng.random() < 0.8:
        key = rng.choice(sorted(content))
        kind = rng.random()
        if kind < 0.15:
            return {each: value for each, value in content.items() if each != key}
        if kind < 0.25:
            return content | {"".join(rng.choices(string.ascii_lowercase, k=5)): rng.choice(HOSTILE_VALUES)}
        return content | {key: mutate(content[key], rng)}
    if isinstance(content, list) and content and rng.random() < 0.7:
        place = rng.randrange(len(content))
        return [*content[:place], mutate(content[place], rng), *content[place + 1 :]]
    return rng.choice(HOSTILE_VALUES)


def damage_table(text: str, rng: random.Random) -> str:
    """A table with cells, columns or rows spoilt: one cell, a whole column, the order of time, the heading, the end."""
    head, *rows = [line.split(",") for line in text.splitlines()]
    column, place = rng.randrange(len(head)), rng.randrange(len(rows))
    kind = rng.randrange(9)
    cell = rng.choice(HOSTILE_CELLS)
    if kind == 0:
        rows[place][column] = cell
    elif kind == 1:
        rows = [[*row[:column], cell, *row[column + 1 :]] for row in rows]
    elif kind == 2:
        rows[place:] = rows[place:][::-1]
    elif kind == 3:
        head[column] = cell
    elif kind == 4:
        rows = rows[: rng.choice((0, 1, 2, 5, 20))]
    elif kind == 5:
        rows[place] = rows[place][:column]
    elif kind == 6:
        factor = rng.choice((1e-300, 1e-9, 1e9, 1e300, -1.0, 0.0))
        rows = [[*row[:column], _scaled(row[column], factor), *row[column + 1 :]] for row in rows]
    elif kind == 7:
        rows = [row for number, row in enumerate(rows) if number % 2 or number < place] + rows[:place]
    else:
        rows = [rows[place]] * len(rows)
    return "\n".join(",".join(row) for row in [head, *rows]) + "\n"


def damage_xml(text: str, rng: random.Random) -> str:
    """An XML file with the value of one attribute replaced, one element left out or given twice, or the end cut off."""
    kind = rng.random()
    if kind < 0.05:
        return text[: rng.randrange(len(text))]
    if kind < 0.7:
        place = rng.choice(list(re.finditer(r'="[^"]*"', text)))
        value = escape(str(rng.choice(HOSTILE_WORDS)), quote=True)
        return f'{text[: place.start()]}="{value}"{text[place.end() :]}'
    place = rng.choice(list(re.finditer(r"<[^<>]*/>", text)))
    return text[: place.start()] + place[0] * 2 * (kind < 0.85) + text[place.end() :]


def _scaled(cell: str, factor: float) -> str:
    try:
        return repr(float(cell) * factor)
    except ValueError:
        return cell * 2


def _write_inputs(folder: Path, rng: random.Random, damaged: str) -> None:
    """Sound inputs of all commands, but for the damaged one."""
    for name, content in (("robot", ROBOT), ("model", MODEL), ("experiment", EXPERIMENT), ("safety", SAFETY)):
        whole = mutate(content, rng) if name == damaged else content
        (folder / f"{name}.yaml").write_text(yaml.safe_dump(whole))
    (folder / "rec").mkdir()
    recording = mutate(RECORDING, rng) if damaged == "recording" else RECORDING
    (folder / "rec" / "recording.yaml").write_text(yaml.safe_dump(recording))
    table = damage_table(run_csv(), rng) if damaged == "table" else run_csv()
    (folder / "rec" / "run.csv").write_text(table)
    (folder / "motion.csv").write_text(re.sub(r"(?m)(,[^,\n]*){3}$", "", table))
    arm = yaml.safe_load((BUILT_IN_FOLDER / "irb120-arm.yaml").read_text(encoding="utf-8"))
    limited = [joint | {"acceleration_limit": 10.0} for joint in arm["joints"]]
    (folder / "arm.yaml").write_text(yaml.safe_dump(arm | {"joints": limited}))
    verdict = mutate(VERDICT, rng) if damaged == "verdict" else VERDICT
    (folder / "verdict.json").write_text(json.dumps(verdict))
    (folder / "earlier").mkdir()
    (folder / "earlier" / "next.json").write_text(json.dumps(verdict))
    (folder / "records").mkdir()
    (record, records), (_, safe) = known_record(RECORD), known_record(SAFE_RECORD)
    for name, content in (
        ("problem.yaml", record["settings"]),
        ("records/best_known.json", records),
        ("records/safe.json", safe),
        ("submission.yaml", submission(RECORD)),
        ("safe-submission.yaml", submission(SAFE_RECORD)),
    ):
        whole = mutate(content, rng) if Path(name).stem == damaged else content
        text = yaml.safe_dump(whole) if name.endswith(".yaml") else json.dumps(whole)
        (folder / name).write_text(text)
    for name, text in (("toy.urdf", GRIPPER_URDF), ("toy.xml", GRIPPER_MJCF)):
        (folder / name).write_text(damage_xml(text, rng) if name.endswith(damaged) else text)
    for name, text in locked_robots().items():
        (folder / name).write_text(damage_xml(text, rng) if damaged == f"locked {Path(name).suffix}" else text)
        joints = 3 if name.endswith(".urdf") else 2
        model = MODEL | {"robot": name, "links": [HEAVY_LINK] * joints}
        (folder / f"{Path(name).suffix[1:]}-model.yaml").write_text(yaml.safe_dump(model))
    (folder / "servo").mkdir()
    servo = mutate(SERVO_RECORDING, rng) if damaged == "servo" else SERVO_RECORDING
    (folder / "servo" / "recording.yaml").write_text(yaml.safe_dump(servo))
    log = damage_table(servo_csv(), rng) if damaged == "log" else servo_csv()
    (folder / "servo" / "run.csv").write_text(log)


def _write_results(folder: Path, rng: random.Random, damaged: str) -> None:
    """Results that `bench share` wrote, one file of them damaged."""
    (folder / "shared").mkdir()
    for name, text in shared_results().items():
        if damaged == name.removesuffix(".csv") and name.endswith(".csv"):
            text = damage_table(text, rng)
        elif damaged == "settings" and name == "settings.yaml":
            text = yaml.safe_dump(mutate(yaml.safe_load(text), rng))
        (folder / "shared" / name).write_text(text)


RECORD = "joint-fourier-rest-250hz"
SAFE_RECORD = "suite-4/irb120-all-si-floor"
EXPORT = f"bench export problem.yaml --record {RECORD} --results records --format ros2 --rate 250"
NEXT = "next verdict.json --robot arm.yaml --evaluations 50 --duration 2 --rate 100 --harmonics 3 --out next"
COMMANDS = {
    "base": "model base-parameters robot.yaml",
    "export-model": "model export model.yaml out.xml",
    "run": "run experiment.yaml --dry-run --workers 1 --store s.sqlite --results r",
    "identify": "identify rec --as-read --out out",
    "predict": "predict model.yaml rec --out out",
    "check": "recording check rec --out check.html",
    "payload": "payload rec --link 3 --centre 0 0 0.1 --cutoff-hz 5",
    "gains": "recording gains rec --without rec --mass 5 --centre 0 0 0.1",
    "import": "recording import rec/run.csv --robot irb120-arm --position q* --torque u* --time t --out new "
    "--unit position=rad --unit torque=N.m --unit time=s",
    "lock-urdf": "model lock-joints toy.urdf out.urdf --tip hand --lock finger1=0.02",
    "lock-mjcf": "model lock-joints toy.xml out.xml --tip hand --lock finger1=0.2",
    "export-whole-urdf": "model export urdf-model.yaml out.urdf",
    "export-whole-mjcf": "model export xml-model.yaml out.xml",
    "export-into": "model export urdf-model.yaml out.xml --into toy.urdf --lock finger1=0.01",
    "base-urdf": "model base-parameters toy.urdf",
    "import-gripper": "recording import rec/run.csv --robot toy.urdf --tip hand --lock finger1=0.02 --position q* "
    "--torque u* --time t --out new --unit position=rad --unit torque=N.m --unit time=s",
    "confusability": "model confusability irb120-arm motion.csv --noise 0.1",
    "diagnose": "diagnose rec --out out",
    "compare-recordings": "diagnose rec --compare rec --out out",
    "servo": "diagnose servo --out out",
    "check-servo": "recording check servo --out check.html",
    "report": "report shared --out page.html",
    "duels": "bench duels shared spso --out duels",
    "draw": "bench draw shared --out drawn",
    "share": "bench share shared --as latex --out tables",
    "compare": "bench compare shared shared --out compared",
    "submit": "bench submit submission.yaml --records records/best_known.json",
    "submit-safe": "bench submit safe-submission.yaml --records records/safe.json",
    "export": f"{EXPORT} --out motion.yaml",
    "export-over-problem": f"{EXPORT} --out problem.yaml",
    "export-over-records": f"{EXPORT} --out records/best_known.json",
    "export-into-folder": f"{EXPORT} --out records",
    "export-into-device": f"{EXPORT} --out /proc/none/motion.yaml",
    "export-safe": f"{EXPORT} --floor -0.3 --keep-out 0.7,0.7,0.7,0.8,0.8,0.8 --out motion.yaml",
    "export-recording": f"{EXPORT} --recording rec --out motion.yaml",
    "next": NEXT,
    "next-robot": NEXT.replace("arm.yaml", "robot.yaml"),
    "next-over-verdict": NEXT.replace("verdict.json", "earlier/next.json").replace("--out next", "--out earlier"),
    "next-into-file": NEXT.replace("--out next", "--out verdict.json"),
    "next-safe": f"{NEXT} --floor -0.3 --keep-out 0.7,0.7,0.7,0.8,0.8,0.8 --near 0,0,0 --range -1:1,-1:1,-1:1 "
    "--clearance 0.01 --radius 0.05",
    "next-safety": f"{NEXT} --safety safety.yaml",
}
WRITES_WITH_REFUSAL = {"check": "check.html", "check-servo": "check.html"}
NOUNS = ("recording", "model", "bench")
OF_RESULTS = ("report", "duels", "draw", "share", "compare")


@dataclass(frozen=True)
class Kind:
    """What is damaged for a command, and how many seeds the list has.

    damaged: a file, `words` of the command, or `nothing`.
    """

    command: str
    damaged: str
    seeds: int

    @property
    def name(self) -> str:
        return f"{self.command}/{self.damaged}"


KINDS = (
    Kind("base", "robot", 100),
    Kind("export-model", "model", 100),
    Kind("run", "experiment", 100),
    Kind("identify", "recording", 15),
    Kind("identify", "table", 30),
    Kind("identify", "words", 7),
    Kind("check", "recording", 15),
    Kind("check", "table", 4),
    Kind("predict", "model", 4),
    Kind("predict", "table", 4),
    Kind("payload", "table", 4),
    Kind("payload", "words", 4),
    Kind("gains", "words", 4),
    Kind("import", "table", 4),
    Kind("import", "words", 4),
    Kind("import-gripper", "words", 15),
    Kind("lock-urdf", "urdf", 40),
    Kind("lock-urdf", "words", 15),
    Kind("lock-mjcf", "xml", 40),
    Kind("lock-mjcf", "words", 10),
    Kind("export-whole-urdf", "urdf", 30),
    Kind("export-whole-urdf", "locked .urdf", 15),
    Kind("export-whole-mjcf", "xml", 30),
    Kind("export-whole-mjcf", "locked .xml", 10),
    Kind("export-into", "urdf", 15),
    Kind("export-into", "words", 15),
    Kind("base-urdf", "urdf", 10),
    Kind("confusability", "table", 4),
    Kind("next", "verdict", 4),
    Kind("next", "words", 4),
    Kind("next-safe", "words", 12),
    Kind("next-safety", "safety", 12),
    Kind("next-robot", "nothing", 1),
    Kind("next-over-verdict", "nothing", 1),
    Kind("next-into-file", "nothing", 1),
    Kind("submit", "submission", 60),
    Kind("submit", "best_known", 40),
    Kind("submit", "words", 20),
    Kind("submit-safe", "safe-submission", 30),
    Kind("export", "problem", 40),
    Kind("export", "best_known", 40),
    Kind("export", "words", 60),
    Kind("export-safe", "words", 30),
    Kind("export-recording", "recording", 10),
    Kind("export-over-problem", "nothing", 1),
    Kind("export-over-records", "nothing", 1),
    Kind("export-into-folder", "nothing", 1),
    Kind("export-into-device", "nothing", 1),
    Kind("run", "words", 4),
    Kind("diagnose", "recording", 2),
    Kind("diagnose", "table", 2),
    Kind("diagnose", "words", 2),
    Kind("compare-recordings", "table", 2),
    Kind("compare-recordings", "words", 2),
    Kind("servo", "servo", 4),
    Kind("servo", "log", 4),
    Kind("servo", "robot", 2),
    Kind("check-servo", "servo", 4),
    Kind("report", "trials", 2),
    Kind("report", "curves", 2),
    Kind("report", "settings", 2),
    Kind("duels", "trials", 4),
    Kind("duels", "settings", 2),
    Kind("duels", "words", 4),
    Kind("draw", "curves", 2),
    Kind("share", "trials", 4),
    Kind("share", "settings", 4),
    Kind("compare", "trials", 4),
    Kind("compare", "words", 4),
)


def damage_words(words: list[str], rng: random.Random) -> list[str]:
    """The words with one value of an option or argument replaced; the command and the flags stay."""
    first = 2 if words[0] in NOUNS else 1
    places = [n for n in range(first, len(words)) if not words[n].startswith("--")]
    place = rng.choice(places)
    return [*words[:place], rng.choice(HOSTILE_WORDS), *words[place + 1 :]]


def run_case(kind: Kind, seed: int, folder: Path) -> Outcome:
    """One case in an empty folder, which is the working folder meanwhile."""
    rng = random.Random(f"{kind.damaged} {kind.command} {seed}")
    if kind.command in OF_RESULTS:
        _write_results(folder, rng, kind.damaged)
    else:
        _write_inputs(folder, rng, kind.damaged)
    words = COMMANDS[kind.command].split()
    if kind.damaged == "words":
        words = damage_words(words, rng)
    before = _contents(folder)
    result = _invoke(words)
    return _judge(kind, seed, words, result, before, folder)


def _invoke(words: list[str]) -> Any:
    def give_up(*_: object) -> None:
        raise TimeoutError(f"hangs for {TIME_LIMIT_S} s")

    usual = signal.signal(signal.SIGALRM, give_up)
    signal.alarm(TIME_LIMIT_S)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)
            return CliRunner().invoke(armlab, words)
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, usual)


def _contents(folder: Path) -> dict[str, int]:
    return {str(path.relative_to(folder)): path.lstat().st_mtime_ns for path in folder.rglob("*")}


def _judge(kind: Kind, seed: int, words: list[str], result: Any, before: dict[str, int], folder: Path) -> Outcome:
    error = None if isinstance(result.exception, SystemExit) else result.exception
    lines = result.stderr.strip().splitlines()
    told = repr(error) if error else lines[-1] if lines else ""
    told = re.sub(r"\s+", " ", told.replace(str(folder), ""))[:150]
    after = _contents(folder)
    allowed = WRITES_WITH_REFUSAL.get(kind.command)
    changed = {name for name in after if after[name] != before.get(name)} - {allowed}
    verdict = "used" if result.exit_code == 0 else "refused"
    if error is not None:
        verdict = f"broken: {type(error).__name__}"
    elif result.exit_code not in (0, 2):
        verdict = "broken: exit status"
    elif result.exit_code == 2 and changed:
        verdict = f"broken: wrote {min(changed)}"
    elif result.exit_code == 2 and not _is_one_line(lines):
        verdict = "broken: more than one line"
    elif result.exit_code == 0 and not all(_is_free_of_nan(each, kind) for each in _new_files(folder, changed)):
        verdict = "broken: NaN in a file"
    elif result.exit_code == 0 and "nan" not in words and TOLD_NAN.search(REPAIR.sub("", result.stdout)):
        verdict = "broken: NaN on the terminal"
    return Outcome(f"{kind.name}/{seed}", result.exit_code, verdict, told)


def _is_one_line(lines: list[str]) -> bool:
    return len(lines) == 1 or lines[0].startswith("Usage:")  # click's usage errors have four


def _new_files(folder: Path, names: set[str]) -> Iterator[Path]:
    return (folder / name for name in names if (folder / name).is_file())


def _is_free_of_nan(path: Path, kind: Kind) -> bool:
    """Whether all numbers of a file are finite, names aside; an infeasible end of a search counts as infinite."""
    if path.suffix not in (".yaml", ".json", ".csv", ".xml", ".urdf", ".mod"):
        return True
    wrong = "nan" if kind.command in OF_RESULTS and path.suffix == ".csv" else "nan|inf|infinity"
    text = re.sub(r'\b(name|joint[12]?|link|actuator|tendon)="[^"]*"', "", path.read_text(encoding="utf-8"))
    return not re.search(rf"(?i)(^|[\s,:\[\"])[+-]?\.?({wrong})($|[\s,\]\"])", text)


def outcomes_of(kind: Kind, seeds: Iterable[int]) -> Iterator[Outcome]:
    """The outcomes of some seeds of a kind."""
    home = Path.cwd()
    for seed in seeds:
        with TemporaryDirectory() as name:
            os.chdir(name)
            try:
                yield run_case(kind, seed, Path(name))
            finally:
                os.chdir(home)


def outcomes_beyond_the_list(kinds: Sequence[Kind], seconds: float, first_seed: int) -> Iterator[Outcome]:
    """The outcomes of further seeds, all kinds in turn, until the time is over."""
    end = time.monotonic() + seconds
    for number in count(first_seed):
        for kind in kinds:
            if time.monotonic() > end:
                return
            yield from outcomes_of(kind, [kind.seeds + number])


def read_outcomes() -> list[Outcome]:
    """The list in the repository; none where there is no list yet."""
    if not OUTCOMES.exists():
        return []
    with OUTCOMES.open(encoding="utf-8", newline="") as file:
        rows = csv.DictReader(file)
        return [Outcome(row["case"], int(row["exit_status"]), row["verdict"], row["told"]) for row in rows]


def write_outcomes(found: list[Outcome]) -> None:
    """Puts outcomes into the list, in place of older ones of the same cases; cases that no kind has go."""
    known = {each.case: each for each in [*read_outcomes(), *found]}
    cases = [f"{kind.name}/{seed}" for kind in KINDS for seed in range(kind.seeds)]
    with OUTCOMES.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([each.name for each in fields(Outcome)])
        writer.writerows(astuple(known[case]) for case in cases if case in known)


def main(arguments: list[str]) -> int:
    """Runs the cases of the named kinds, else all, and puts them into the list; 1 if a case is broken."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kinds", nargs="*", choices=[[], *(kind.name for kind in KINDS)], default=[])
    parser.add_argument("--seconds", type=float, help="try seeds beyond the list for as long")
    parser.add_argument("--first-seed", type=int, default=0, help="of those beyond the list")
    options = parser.parse_args(arguments)
    kinds = [kind for kind in KINDS if not options.kinds or kind.name in options.kinds]
    counts = Counter[str]()
    if options.seconds is not None:
        for each in outcomes_beyond_the_list(kinds, options.seconds, options.first_seed):
            counts[each.verdict] += 1
            _print_broken(each)
    else:
        for kind in kinds:
            found = list(outcomes_of(kind, range(kind.seeds)))
            write_outcomes(found)
            counts.update(each.verdict for each in found)
            for each in found:
                _print_broken(each)
    print(f"{counts.total()} cases:", ", ".join(f"{number} {verdict}" for verdict, number in sorted(counts.items())))
    return 1 if any(verdict.startswith("broken") for verdict in counts) else 0


def _print_broken(outcome: Outcome) -> None:
    if outcome.verdict.startswith("broken"):
        print(outcome.case, outcome.verdict, outcome.told, flush=True)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
