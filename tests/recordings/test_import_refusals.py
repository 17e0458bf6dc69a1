"""Every refusal of the import, with the input that causes it: no line of the importers refuses what nobody tried."""

import zipfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from odd_logs import bag, coarse, in_turn, lists, log
from recording_folders import IMPORT_OPTIONS, POSITION, TORQUE, frame
from refusals import lines_passed, refusing_lines
from scipy.io import savemat

import armlab.recordings.imports
from armlab.common.errors import InputError
from armlab.recordings.imports.files import import_files

pytest.importorskip("rosbags")
pytest.importorskip("pyarrow")
FOLDER = Path(armlab.recordings.imports.__file__).parent
OPTIONS = {**IMPORT_OPTIONS, "units": ("position=rad", "torque=N.m")}
OF_COMMANDS = ("hold the commands",)  # of bags, in test_controller_bags.py
ELSEWHERE = {  # tested where the files are made, or where a package is missing
    "lerobot.py": "test_motion_recordings.py",
    "matlab.py": "test_recording_imports.py",
    "ros_messages.py": "test_controller_bags.py",
}
MISSING_PACKAGE = "install"


@dataclass(frozen=True)
class Refusal:
    """write: the files, in a folder. says: in the line. options: beside the usual ones. lab: text of a Python file of
    Isaac Lab that is given as the controller. validates: whether all files do.
    """

    write: Callable[[Path], list[Path]]
    says: str
    options: dict[str, Any] = field(default_factory=dict)
    lab: str | None = None
    validates: bool = False


def table(name: str = "log.csv", change: Callable[[pd.DataFrame], pd.DataFrame] = lambda each: each) -> Any:
    def write(folder: Path) -> list[Path]:
        change(frame(seconds=2.0)).to_csv(folder / name, index=False)
        return [folder / name]

    return write


def content(name: str, data: str | bytes) -> Any:
    def write(folder: Path) -> list[Path]:
        (folder / name).write_bytes(data if isinstance(data, bytes) else data.encode())
        return [folder / name]

    return write


def two(first: pd.DataFrame, second: pd.DataFrame) -> Any:
    def write(folder: Path) -> list[Path]:
        for name, each in (("a.csv", first), ("b.csv", second)):
            each.to_csv(folder / name, index=False)
        return [folder / "a.csv", folder / "b.csv"]

    return write


def archive(count: int) -> Any:
    def write(folder: Path) -> list[Path]:
        with zipfile.ZipFile(folder / "logs.zip", "w") as file:
            for number in range(count):
                file.writestr(f"{number}.csv", "t\n")
        return [folder / "logs.zip"]

    return write


def uneven_lists(folder: Path) -> list[Path]:
    each = lists(frame(seconds=2.0))
    each.at[3, "observation.state"] = [0.0]
    each.to_parquet(folder / "log.parquet")
    return [folder / "log.parquet"]


def same_twice(folder: Path) -> list[Path]:
    return table()(folder) * 2


def bare_folder(folder: Path) -> list[Path]:
    (folder / "bag").mkdir()
    return [folder / "bag"]


def two_topics(
    folder: Path, *, kind: str = "sensor_msgs/msg/JointState", topics: tuple[str, ...] = ("/a", "/b")
) -> Any:
    """Joint states on several topics, or messages of another kind."""
    from rosbags.rosbag2 import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    with Writer(folder / "bag", version=9) as writer:
        for topic in topics:
            link = writer.add_connection(topic, kind, typestore=store)
            if kind == "std_msgs/msg/String":
                writer.write(link, 1, store.serialize_cdr(store.types[kind]("x"), kind))
    return [folder / "bag"]


def with_empty_topic(folder: Path) -> list[Path]:
    """States, and a topic of commands that nobody sent."""
    from rosbags.rosbag2 import Writer
    from rosbags.typesys import Stores, get_typestore

    store, kind = get_typestore(Stores.ROS2_HUMBLE), "sensor_msgs/msg/JointState"
    stamp, header, state = (store.types[each] for each in ("builtin_interfaces/msg/Time", "std_msgs/msg/Header", kind))
    with Writer(folder / "bag", version=9) as writer:
        link = writer.add_connection("/joint_states", kind, typestore=store)
        writer.add_connection("/cmd", kind, typestore=store)
        for number in range(3):
            message = state(header(stamp(number, 0), ""), ["joint1"], np.zeros(1), np.zeros(0), np.zeros(1))
            writer.write(link, number, store.serialize_cdr(message, kind))
    return [folder / "bag"]


def renamed(names: dict[str, str]) -> Callable[[pd.DataFrame], pd.DataFrame]:
    return lambda each: each.rename(columns=names)


def no_numbers(folder: Path) -> list[Path]:
    np.savez(folder / "log.npz", name=np.array(["a", "b"]))
    return [folder / "log.npz"]


def small_mat(folder: Path) -> list[Path]:
    savemat(folder / "log.mat", {"a": [1.0, 2.0]})
    return [folder / "log.mat"]


AXES = {"q1": "position_pan", "q2": "position_lift", "q3": "position_elbow"}
OTHER = {"q1": "position_joint1", "q2": "position_joint2", "q3": "position_joint3"}
GOOD, SHORT = frame(seconds=2.0), frame(1, 2.0)
MOTION = {"reference_position": "tau1,tau2,tau3", "units": ("position=rad", "reference_position=rad")}
REFUSALS = (
    Refusal(table(), "no column 'q9' for position", {"position": "q9,q2,q3"}),
    Refusal(table(), "names column q1 twice", {"position": "q1,q1,q3"}),
    Refusal(table(), "names 3 columns: q1, q2, q3; give one, or two", {"time": "q1,q2,q3"}),
    Refusal(table(), "names 2 columns (q1, q2); the robot has 3 joints", {"position": "q1,q2"}),
    Refusal(table("log.csv", renamed({"t": "clock"})), "the columns of time are missing: give --time"),
    Refusal(table("log.csv", lambda each: each.iloc[:5]), "nothing is written: log.csv"),
    Refusal(table("log.csv", lambda each: each.assign(**dict.fromkeys(TORQUE, 0.0))), "is zero throughout: the driver"),
    Refusal(content("log.parquet", b"PAR1 no"), "as Parquet"),
    Refusal(content("log.json", "{"), "as JSON"),
    Refusal(content("log.json", "[1, 2, 3]"), "should hold a list of rows"),
    Refusal(content("log.json", "[{}]"), "as JSON"),
    Refusal(content("log.jsonl", '{"t": 0}\n{"t"\n{"t": 1}\n'), "line 2 is no JSON"),
    Refusal(content("log.jsonl", "1\n2\n"), "each line should be an object"),
    Refusal(content("log.jsonl", ""), "holds no rows"),
    Refusal(uneven_lists, "holds lists of 1 to 3 entries, not of one length"),
    Refusal(content("log.npz", b"no"), "as .npz"),
    Refusal(no_numbers, "holds no numeric array"),
    Refusal(small_mat, "holds no numeric array of at least 10 samples"),
    Refusal(table(), "--motor-side both needs the gears", {"motor_side": "both"}),
    Refusal(table(), "--gear-ratio holds 2 numbers for 3 columns of position", {"gear_ratio": "1,2"}),
    Refusal(table(), "--gear-ratio x should be turns of the motor", {"gear_ratio": "x"}),
    Refusal(
        table(),
        "--motor-side torque needs columns of torque",
        {"gear_ratio": "1,2,3", "motor_side": "torque", **MOTION},
    ),
    Refusal(table("log.csv", lambda each: each.assign(q1=each["q1"] + 1e6)), "no unit makes that possible"),
    Refusal(content("log.csv.gz", b"no"), "cannot unpack"),
    Refusal(content("log.csv.zst", b"no"), "cannot unpack"),
    Refusal(content("log.csv.bz2", b"no"), "cannot unpack"),
    Refusal(content("log.zip", b"no"), "cannot unpack"),
    Refusal(archive(2), "holds 2 files: unpack it"),
    Refusal(archive(1), "log"),
    Refusal(table(), "--joints names 'j9', which the robot does not have", {"joints": "j9"}),
    Refusal(same_twice, "is given twice: a run cannot both identify and validate"),
    Refusal(table(), "--validate other.csv should be one of the imported files", {"validate": (Path("other.csv"),)}),
    Refusal(table(), "--validate names every imported file", validates=True),
    Refusal(two(GOOD, SHORT.assign(q2=np.nan)), "column q2 (position) is empty: it has no number in any row"),
    Refusal(
        two(GOOD.rename(columns={"q1": "q1 [rad]"}), SHORT.rename(columns={"q1": "q1 [deg]"})),
        "import files of one kind together",
    ),
    Refusal(
        table(),
        "the columns of a joint should stand at one place in both",
        {"torque": "tau2,tau1,tau3"},
    ),
    Refusal(
        table(
            "log.csv",
            lambda each: each.assign(
                **{name: each[name].where(each.index % 2 == 0) for name in TORQUE},
                **{name: each[name].where(each.index % 2 > 0) for name in POSITION},
            ).sample(frac=1.0, random_state=0),
        ),
        "the rows in no order of time: sort them",
    ),
    Refusal(
        table(
            "log.csv",
            lambda each: each.assign(
                **{name: each[name].where(each.index < 150) for name in TORQUE},
                **{name: each[name].where(each.index > 250) for name in POSITION},
            ),
        ),
        "are close to each other in time: export them with common stamps",
    ),
    Refusal(table("log.csv", renamed(AXES)), "name other joints than the robot", {"position": "position_*"}),
    Refusal(
        table("log.csv", renamed(OTHER)),
        "the robot's order is joint1, joint2, joint3",
        {"position": "position_joint2,position_joint1,position_joint3"},
    ),
    Refusal(table(), "--tip, --lock and --repair belong to a robot file", {"robot": None, "tip": "hand"}),
    Refusal(table(), "is built in, as one chain of joints", {"tip": "hand"}),
    Refusal(lambda folder: two_topics(folder, topics=("/a",)), "holds no joint states"),
    Refusal(lambda folder: two_topics(folder), "choose one with --topic", {"robot": "irb120-arm", "torque": "x"}),
    Refusal(lambda folder: two_topics(folder, kind="std_msgs/msg/String"), "holds none of sensor_msgs"),
    Refusal(bag("halves"), "no joint states on topic '/x'", {"topic": "/x"}),
    Refusal(bag("halves"), "no commands on topic '/x'", {"command_topic": "/x"}),
    Refusal(with_empty_topic, "holds no message on /cmd", {"command_topic": "/cmd"}),
    Refusal(bare_folder, "has no metadata.yaml, so it is no ROS 2 bag as a folder"),
    Refusal(bag("two"), "name one of its files: bag.db3, other.db3"),
    Refusal(content("log.db3", b"no"), "as a bag of joint states"),
    Refusal(table(), "--unit position=m does not fit joints that are revolute", {"units": ("position=m",)}),
    Refusal(table(), "--unit speed=rad should be SIGNAL=UNIT", {"units": ("speed=rad",)}),
    Refusal(table(), "unknown unit 'grad' of position", {"units": ("position=grad",)}),
    Refusal(table(), "--gains holds 2 numbers for 3 columns", {"gains": "1,2", "units": ("position=rad", "torque=A")}),
    Refusal(table(), "--gains are N.m per A or V, and the torque is in N.m", {"gains": "1,2,3"}),
    Refusal(table(), "--gains 0 should be numbers", {"gains": "0"}),
    Refusal(lambda folder: [folder / "log.csv"], "no file"),
    Refusal(content("log.doc", "x"), "cannot import"),
    Refusal(table(), "--separator ';;' should be one character", {"separator": ";;"}),
    Refusal(
        table(
            "log.csv", lambda each: each.astype({"q1": object}).mask(pd.DataFrame({"q1": each.index % 4 == 1}), "ERR")
        ),
        "column q1 holds text in 100 of 400 rows",
    ),
    Refusal(content("log.csv", "a,b,c\nx,y,z\nu,v,w\n"), "holds no rows of numbers: line 3 has 'u' in column 1"),
    Refusal(content("log.csv", ""), "holds no rows of numbers: the file is empty"),
    Refusal(
        table("log.csv", lambda each: each.assign(nanosec=np.nan)), "without any number or stamp", {"time": "t,nanosec"}
    ),
    Refusal(
        table("log.csv", lambda each: each.assign(nanosec=5e9)), "is no part of a second in ns", {"time": "t,nanosec"}
    ),
    Refusal(table("log.csv", lambda each: coarse(in_turn(each).drop(range(90, 140)), 70.0)), "rows come unevenly"),
    Refusal(table("log.csv", lambda _: coarse(in_turn(log()), 100.0)), "torques fit the motion better half a step"),
    Refusal(
        table("log.csv", lambda each: each.assign(t=each["t"].where(each.index % 3 > 0))),
        "134 of 400 rows hold a value that is not a measurement (line 2: t = nan)",
    ),
    Refusal(table(), "--controller belongs to a log of commands and positions", {"controller": "kp=1"}),
    Refusal(table(), "--controller stiff=1: should be KEY=VALUES", {**MOTION, "controller": "stiff=1"}),
    Refusal(table(), "kp=1,2: should hold one number, or 3, one a joint, not 2", {**MOTION, "controller": "kp=1,2"}),
    Refusal(table(), "kp=x: 'x' is no number; none where one is unknown", {**MOTION, "controller": "kp=x"}),
    Refusal(table(), "has no actuators of Isaac Lab", MOTION, "stiffness = 1.0\n"),
    Refusal(table(), "has no actuators for joint", MOTION, "IdealPDActuatorCfg(joint_names_expr=['other'])"),
    Refusal(table(), "of DCMotorCfg of joint", MOTION, "DCMotorCfg(joint_names_expr=['.*'])"),
    Refusal(table(), "lab.py as Python", MOTION, "class ("),
    Refusal(table(), "DCMotorCfg has no joint_names_expr", MOTION, "DCMotorCfg(stiffness=1.0)"),
    Refusal(table(), "line 1: stiffness should be written out as numbers", MOTION, "DCMotorCfg(stiffness=STIFF)"),
)


def refuse(case: Refusal, folder: Path) -> InputError:
    """The refusal of an input; it has to be one line, and nothing may be written."""
    files, options = case.write(folder), {**OPTIONS, **case.options}
    if case.validates:
        options["validate"] = tuple(files)
    if case.lab is not None:
        (folder / "lab.py").write_text(case.lab)
        options["controller"] = str(folder / "lab.py")
    with pytest.raises(InputError) as raised:
        import_files(files, folder / "recording", options)
    assert not (folder / "recording").exists()
    return raised.value


@pytest.mark.parametrize("case", REFUSALS, ids=lambda case: case.says)
def test_an_input_is_refused_in_one_line_that_names_the_cause(case: Refusal, tmp_path: Path) -> None:
    said = str(refuse(case, tmp_path))
    assert case.says in said
    assert "\n" not in said


def test_every_refusal_of_the_importers_is_caused_by_an_input_of_the_list(tmp_path: Path) -> None:
    exempt = (MISSING_PACKAGE, *OF_COMMANDS)
    known = {
        place: text
        for place, text in refusing_lines(FOLDER.glob("*.py")).items()
        if place[0] not in ELSEWHERE and not any(each in text for each in exempt)
    }
    for number, case in enumerate(REFUSALS):
        folder = tmp_path / str(number)
        folder.mkdir()
        for place in lines_passed(refuse(case, folder)):
            known.pop(place, None)
    assert not known, "\n".join(f"{file}:{line}: {text}" for (file, line), text in known.items())
