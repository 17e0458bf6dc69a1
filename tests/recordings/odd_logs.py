"""Logs as robots and their drivers write them, and broken ones: what the import and `identify` say of each.

`python tests/recordings/odd_logs.py` writes `docs/odd-logs.md`. The log is that of a simulated arm, so the numbers that
come of a log that is read are compared with those of the same rows read in the plainest form.
"""

import gzip
import json
import shutil
import sys
import tempfile
import zipfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
import pandas as pd
from click.testing import CliRunner
from recording_folders import ARM, POSITION, TORQUE, frame, motion_at
from scipy.stats import norm

from armlab.cli.main import main
from armlab.common.markdown import markdown_table
from armlab.identification.identifier import Identifier
from armlab.identification.model import Model
from armlab.identification.priors import point_mass
from armlab.recordings.load import load_recording
from armlab.recordings.recording import Run
from problem.arm import Arm
from problem.motion import Motion
from problem.regressor import measured_rows, observation_matrix, rigid_body_torque

PAGE = Path(__file__).parents[2] / "docs" / "odd-logs.md"
CUTOFF_HZ = 5.0
START = pd.Timestamp("2026-01-31T23:59:58.000")
COUNT_NM = 0.125  # of a servo
PARAMETERS = 25  # that are identified: 15 base parameters, and what friction and drive add at three joints


@dataclass(frozen=True)
class OddLog:
    """what: in words. write: files for the command, below a folder. says: in the line that is printed. options: given.

    is_read: whether the log comes to a recording whose numbers are those of the plain log.
    """

    what: str
    write: Callable[[Path], list[Path]]
    says: str
    options: tuple[str, ...] = ()
    is_read: bool = True
    command: str = "recording import"


def log(seed: int = 0) -> pd.DataFrame:
    return frame(seed, 16.0, coulomb=0.0)


def largest_by_chance(logs: int) -> float:
    """The deviation, half widths, that no number of so many logs exceeds in 95 of 100 trials (Bonferroni).

    Two estimates with honest intervals differ by a normal number of half widths / 1.96, root sum of both; less where
    they share data.
    """
    return float(norm.isf(0.05 / (2 * PARAMETERS * logs)) / norm.isf(0.025))


def csv(name: str, make: Callable[[pd.DataFrame], pd.DataFrame]) -> Callable[[Path], list[Path]]:
    """A CSV of one table that is changed."""

    def write(folder: Path) -> list[Path]:
        path = folder / name
        make(log()).to_csv(path, index=False)
        return [path]

    return write


def text(name: str, make: Callable[[str], str | bytes]) -> Callable[[Path], list[Path]]:
    """A text file of a CSV that is changed."""

    def write(folder: Path) -> list[Path]:
        made = make(log().to_csv(index=False))
        (folder / name).write_bytes(made if isinstance(made, bytes) else made.encode())
        return [folder / name]

    return write


def episodes(*lengths: int) -> Callable[[Path], list[Path]]:
    return csv(
        "log.csv",
        lambda table: pd.concat(
            [
                table.iloc[:rows].assign(t=table["t"].iloc[:rows]) if n == 0 else log(n).iloc[:rows]
                for n, rows in enumerate(lengths)
            ]
        ),
    )


def stamps(form: Callable[["pd.Series[pd.Timestamp]"], pd.Series]) -> Callable[[pd.DataFrame], pd.DataFrame]:
    def make(table: pd.DataFrame) -> pd.DataFrame:
        return table.assign(t=form(START + pd.to_timedelta(table["t"], unit="s")))

    return make


def in_turn(table: pd.DataFrame) -> pd.DataFrame:
    """Positions and torques in alternate rows."""
    out = table.copy()
    out.loc[out.index % 2 == 0, TORQUE] = np.nan
    out.loc[out.index % 2 == 1, POSITION] = np.nan
    return out


def thinned(table: pd.DataFrame, lost: float) -> pd.DataFrame:
    """Without a share of the rows, by chance."""
    return table[np.random.default_rng(0).random(len(table)) >= lost]


def coarse(table: pd.DataFrame, rate_hz: float) -> pd.DataFrame:
    """Stamps of a clock with so many ticks a second."""
    return table.assign(t=np.floor(table["t"] * rate_hz + 1e-6) / rate_hz)


def one_instant(table: pd.DataFrame) -> pd.DataFrame:
    """Positions and torques in alternate rows, which have one stamp."""
    apart = [table.assign(**dict.fromkeys(signal, np.nan)) for signal in (TORQUE, POSITION)]
    return pd.concat(apart).sort_values("t", kind="stable")


def slow_torque(table: pd.DataFrame) -> pd.DataFrame:
    """Torques in every fourth row."""
    out = table.copy()
    out.loc[out.index % 4 > 0, TORQUE] = np.nan
    return out


def parquet(change: Callable[[pd.DataFrame], pd.DataFrame]) -> Callable[[Path], list[Path]]:
    def write(folder: Path) -> list[Path]:
        change(log()).to_parquet(folder / "log.parquet")
        return [folder / "log.parquet"]

    return write


def lists(table: pd.DataFrame) -> pd.DataFrame:
    """Vectors in cells, as LeRobot writes them."""
    return pd.DataFrame(
        {
            "timestamp": table["t"],
            "observation.state": table[POSITION].to_numpy().tolist(),
            "observation.effort": table[TORQUE].to_numpy().tolist(),
        }
    )


def packed(name: str, pack: Callable[[Path, bytes], object]) -> Callable[[Path], list[Path]]:
    def write(folder: Path) -> list[Path]:
        pack(folder / name, log().to_csv(index=False).encode())
        return [folder / name]

    return write


def _zip(path: Path, content: bytes) -> None:
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("log.csv", content)


def bag(kind: str) -> Callable[[Path], list[Path]]:
    """A ROS 2 bag: `gripper` on the topic of the arm, `halves` of the arm in two messages, `bare` without metadata.

    Halves are of one instant and sent 20 us apart. `named`: its file alone; `file`, `message`: packed by rosbag2.
    """

    def write(folder: Path) -> list[Path]:
        from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
        from rosbags.typesys import Stores, get_typestore

        store, name = get_typestore(Stores.ROS2_HUMBLE), "sensor_msgs/msg/JointState"

        def state(ns: int, names: list[str], position: np.ndarray, effort: np.ndarray) -> object:
            stamp = store.types["builtin_interfaces/msg/Time"](*divmod(ns, 10**9))
            header = store.types["std_msgs/msg/Header"](stamp, "")
            return store.types[name](header, names, position, np.array([]), effort)

        joints = [joint.name for joint in ARM.joints]
        writer = Writer(
            folder / "bag", version=9, storage_plugin=StoragePlugin.MCAP if kind == "mcap" else StoragePlugin.SQLITE3
        )
        if kind in ("file", "message"):
            writer.set_compression(CompressionMode[kind.upper()], CompressionFormat.ZSTD)
        with writer:
            topic = writer.add_connection("/joint_states", name, typestore=store)

            def put(ns: int, *fields: object) -> None:
                writer.write(topic, ns, store.serialize_cdr(state(ns, *fields), name))

            for number, row in enumerate(np.ascontiguousarray(log().to_numpy())):
                ns = START.value + round(row[0] * 1e9)
                if kind == "halves":
                    put(ns, joints[:1], row[1:2], row[4:5])
                    put(ns + 20_000, joints[1:], row[2:4], row[5:7])
                else:
                    put(ns, joints, row[1:4], row[4:7])
                if kind == "gripper" and number % 5 == 0:
                    put(ns + 1_000_000, ["finger_left", "finger_right"], np.zeros(2), np.zeros(2))
        if kind == "bare":
            (folder / "bag" / "metadata.yaml").unlink()
        if kind == "two":
            shutil.copy(next((folder / "bag").glob("*.db3")), folder / "bag" / "other.db3")
            (folder / "bag" / "metadata.yaml").unlink()
        if kind == "named":
            (folder / "bag" / "metadata.yaml").unlink()
            return list((folder / "bag").glob("*.db3"))
        if kind == "packed":
            import zstandard

            own = next((folder / "bag").glob("*.db3"))
            (folder / "bag.db3.zstd").write_bytes(zstandard.compress(own.read_bytes()))
            return [folder / "bag.db3.zstd"]
        return [folder / "bag"]

    return write


def copied_validation(folder: Path) -> list[Path]:
    log().to_csv(folder / "log.csv", index=False)
    log().iloc[10:].to_csv(folder / "check.csv", index=False)
    return [folder / "log.csv", folder / "check.csv"]


def with_zeros(table: pd.DataFrame) -> pd.DataFrame:
    zeros = table.iloc[::13].copy()
    zeros["t"] += 0.001
    zeros[[*POSITION, *TORQUE]] = 0.0
    return pd.concat([table, zeros]).sort_values("t")


def lost_ticks(table: pd.DataFrame) -> pd.DataFrame:
    out, late = table.copy(), np.arange(150, len(table), 200)
    out.loc[late, "t"] = table["t"].to_numpy()[late - 1]
    return out


def with_sign_bit(table: pd.DataFrame) -> pd.DataFrame:
    """Torques in counts of an eighth of a N m, 1024 added to the size of a negative one."""
    counts = np.rint(table[TORQUE] / COUNT_NM)
    return table.assign(**{name: counts[name].where(counts[name] >= 0, 1024 - counts[name]) for name in TORQUE})


def less_gravity(table: pd.DataFrame) -> pd.DataFrame:
    """Torques of an arm that carries 1.5 kg at link 3, less the gravity of its links."""
    motion = motion_at(table["t"].to_numpy())
    still = np.zeros_like(motion.position)
    gravity = rigid_body_torque(ARM, Motion(motion.position, still, still))
    load = observation_matrix(ARM, motion)[:, 20:30] @ (1.5 * point_mass(1, (0.1, 0.0, 0.0)))
    change = pd.DataFrame(load.reshape(gravity.shape) - gravity, columns=TORQUE)
    return table.assign(**{name: table[name] + change[name] for name in TORQUE})


def lines_between(content: str, line: str) -> str:
    """A text with a line before each hundredth of its lines, its header aside."""
    head, *rest = content.splitlines(keepends=True)
    return head + "".join(line + each if n % 100 == 50 else each for n, each in enumerate(rest))


def put(column: str, rows: slice, value: object) -> Callable[[pd.DataFrame], pd.DataFrame]:
    def make(table: pd.DataFrame) -> pd.DataFrame:
        out = table.copy().astype({column: object})
        out.loc[out.index[rows], column] = value
        return out

    return make


ISO = "%Y-%m-%dT%H:%M:%S.%f"
NUMBERS = ("--unit", "position=rad", "--unit", "torque=N.m")
VECTORS = ("--time", "timestamp", "--position", "observation.state.*", "--torque", "observation.effort.*", *NUMBERS)
FROM_LOGS = (
    OddLog("2 episodes of equal length, each from 0 s", episodes(1600, 1600), "the clock starts anew 1 time(s)"),
    OddLog("3 episodes of equal length", episodes(1600, 1600, 1600), "the clock starts anew 2 time(s)"),
    OddLog("4 episodes of equal length", episodes(800, 800, 800, 800), "the clock starts anew 3 time(s)"),
    OddLog("episodes of different lengths", episodes(900, 2000, 1300), "the clock starts anew 2 time(s)"),
    OddLog(
        "seconds since 1970 in single precision",
        parquet(lambda table: table.assign(t=(table["t"] + START.timestamp()).astype("float32"))),
        "single precision counts in steps of 128 s",
        ("--unit", "time=s"),
        is_read=False,
    ),
    OddLog(
        "seconds since 1970 with six digits",
        csv("log.csv", lambda table: table.assign(t=[f"{each:.5e}" for each in table["t"] + START.timestamp()])),
        "or has it too few digits?",
        ("--unit", "time=s"),
        is_read=False,
    ),
    OddLog(
        "whole seconds of a stamp alone",
        csv("log.csv", lambda table: table.assign(t=np.floor(table["t"]))),
        "which column holds the fraction of seconds?",
        ("--unit", "time=s"),
        is_read=False,
    ),
    OddLog(
        "seconds and nanoseconds in two columns",
        csv(
            "log.csv",
            lambda table: table.drop(columns="t").assign(
                sec=np.floor(table["t"] + 1e-9), nanosec=np.rint(table["t"] % 1 * 1e9) % 1e9
            ),
        ),
        "time: time_from_two_columns [s]",
    ),
    OddLog("a stamp twice, once a second, where the clock lost a tick", csv("log.csv", lost_ticks), "lost a tick"),
    OddLog(
        "effort zero at all joints",
        csv("log.csv", lambda table: table.assign(**dict.fromkeys(TORQUE, 0.0))),
        "the driver does not fill it",
        is_read=False,
    ),
    OddLog(
        "effort zero at one joint",
        csv("log.csv", lambda table: table.assign(tau2=0.0)),
        "torque of joint 2 is zero throughout: left out",
    ),
    OddLog(
        "torque constant at all joints",
        csv("log.csv", lambda table: table.assign(**dict.fromkeys(TORQUE, 1.5))),
        "never changes",
        is_read=False,
    ),
    OddLog(
        "an arm that stands still",
        csv("log.csv", lambda table: table.assign(**{name: table[name][0] for name in POSITION})),
        "No joint moves",
        is_read=False,
        command="identify",
    ),
    OddLog(
        "a copy of the log to validate",
        copied_validation,
        "validates and holds rows of",
        is_read=False,
        command="identify",
    ),
    OddLog("arm and gripper in messages of their own on one topic", bag("gripper"), "640 messages hold no joint of"),
    OddLog("the arm in two messages on one topic", bag("halves"), "signals come in rows of their own"),
    OddLog("a bag's folder without metadata.yaml", bag("bare"), "joint states; rad, rad/s and N.m"),
    OddLog(
        "the same with two files",
        bag("two"),
        "has no metadata.yaml, so it is no ROS 2 bag as a folder; name one of its files",
        is_read=False,
    ),
    OddLog("the one file of such a folder", bag("named"), "joint states; rad, rad/s and N.m"),
    OddLog("a bag whose file rosbag2 packed with zstd", bag("file"), "joint states; rad, rad/s and N.m"),
    OddLog("a bag whose messages rosbag2 packed with zstd", bag("message"), "joint states; rad, rad/s and N.m"),
    OddLog("a bag as MCAP", bag("mcap"), "joint states; rad, rad/s and N.m"),
    OddLog("a bag packed with zstd, .db3.zstd", bag("packed"), "joint states; rad, rad/s and N.m"),
    OddLog("stamps in ISO 8601 with Z", csv("log.csv", stamps(lambda s: s.dt.strftime(ISO + "Z"))), "t is ISO 8601"),
    OddLog("with +01:00", csv("log.csv", stamps(lambda s: s.dt.strftime(ISO + "+01:00"))), "t is ISO 8601"),
    OddLog("with a blank", csv("log.csv", stamps(lambda s: s.dt.strftime("%Y-%m-%d %H:%M:%S.%f"))), "t is ISO 8601"),
    OddLog("as dd.mm.yyyy", csv("log.csv", stamps(lambda s: s.dt.strftime("%d.%m.%Y %H:%M:%S.%f"))), "t is date and"),
    OddLog(
        "as hh:mm:ss.mmm over midnight",
        csv("log.csv", stamps(lambda s: s.dt.strftime("%H:%M:%S.%f"))),
        "t is time of the day",
    ),
    OddLog(
        "date and time in two columns",
        csv(
            "log.csv",
            lambda table: stamps(lambda s: s.dt.strftime("%H:%M:%S.%f"))(table).assign(
                date=(START + pd.to_timedelta(table["t"], unit="s")).dt.strftime("%d.%m.%Y")
            ),
        ),
        "time: time_from_two_columns [s]",
        ("--time", "date,t"),
    ),
    OddLog("positions and torques in alternate rows", csv("log.csv", in_turn), "signals come in rows of their own"),
    OddLog(
        "the same, with a clock that is coarser than the rows",
        csv("log.csv", lambda table: coarse(in_turn(table), 70.0)),
        "stamps stray from the even 200 Hz that the motion shows; rows put there",
    ),
    OddLog(
        "the same, with one stamp for each two rows",
        csv("log.csv", lambda table: coarse(in_turn(table), 100.0)),
        "torques fit the motion better half a step of 10 ms away",
        is_read=False,
    ),
    OddLog(
        "the same, with rows lost and three steps of the clock for each two rows",
        csv("log.csv", lambda table: coarse(thinned(in_turn(table), 0.05), 300.0)),
        "torques fit the motion better half a step of 3.333 ms away",
        is_read=False,
    ),
    OddLog(
        "positions and torques in alternate rows of an even clock, a third of the rows lost",
        csv("log.csv", lambda table: thinned(in_turn(table), 0.33)),
        "signals come in rows of their own",
    ),
    OddLog(
        "positions and torques of one instant in rows of their own",
        csv("log.csv", one_instant),
        "rows of different signals with one stamp are taken as one instant",
    ),
    OddLog("torques at a quarter of the rate", csv("log.csv", slow_torque), "signals come in rows of their own"),
    OddLog(
        "a tenth of the torque's cells empty",
        csv("log.csv", lambda table: table.assign(tau2=table["tau2"].where(table.index % 10 > 0))),
        "320 of 3200 rows hold a value that is not a measurement",
    ),
    OddLog(
        "a load in counts, as a size with a bit for its direction",
        csv("log.csv", with_sign_bit),
        "the current of channel 1 holds its direction in bit 10",
        ("--unit", "position=rad", "--unit", "torque=A", "--gains", ",".join([str(COUNT_NM)] * 3)),
    ),
    OddLog(
        "torque without its sign",
        csv("log.csv", lambda table: table.assign(**{name: table[name].abs() for name in TORQUE})),
        "the recorded current has no sign: it is a magnitude",
        is_read=False,
        command="identify",
    ),
    OddLog(
        "torque less the gravity of the arm's links, while 1.5 kg are carried",
        csv("log.csv", less_gravity),
        "the gravity of the links of the robot file is taken from the recorded torque",
        is_read=False,
        command="identify",
    ),
    OddLog("CR CR LF line ends", text("log.csv", lambda s: s.replace("\n", "\r\r\n")), "3200 rows"),
    OddLog("blank lines", text("log.csv", lambda s: lines_between(s, "\n")), "3200 rows"),
    OddLog(
        "the header again between rows",
        text("log.csv", lambda s: lines_between(s, s[: s.index("\n") + 1])),
        "3232 rows",
    ),
    OddLog("quotes around numbers", text("log.csv", lambda s: frame_of(s).to_csv(index=False, quoting=1)), "3200 rows"),
    OddLog("a column that counts rows", text("log.csv", lambda s: frame_of(s).to_csv()), "3200 rows"),
    OddLog(
        "a column that stands there twice", csv("log.csv", lambda table: table.assign(copy=table["q1"])), "3200 rows"
    ),
    OddLog(
        "semicolons and decimal commas",
        text("log.csv", lambda s: frame_of(s).to_csv(index=False, sep=";", decimal=",")),
        "separator semicolon, decimal ','",
    ),
    OddLog(
        "a pause of 100 s",
        csv("log.csv", lambda table: pd.concat([table.iloc[:1500], log(1).assign(t=log(1)["t"] + 110.0)])),
        "1 gap(s), first after 7.495 s",
    ),
    OddLog(
        "a clock with 150 ticks a second for 200 rows",
        csv("log.csv", lambda table: coarse(table, 150.0)),
        "stamps stray from an even 200 Hz",
    ),
    OddLog("byte order mark, CR line ends", text("log.csv", lambda s: "\ufeff" + s.replace("\n", "\r")), "3200 rows"),
    OddLog("UTF-16", text("log.csv", lambda s: s.encode("utf-16")), "3200 rows"),
    OddLog("Windows-1252", text("log.csv", lambda s: f"# Prüfstand, Gerät 1\n{s}".encode("cp1252")), "3200 rows"),
    OddLog(".csv.gz", packed("log.csv.gz", lambda p, b: p.write_bytes(gzip.compress(b))), "3200 rows"),
    OddLog(".zip of one file", packed("log.zip", _zip), "3200 rows"),
    OddLog(".json, a list of rows", text("log.json", lambda s: frame_of(s).to_json(orient="records")), "3200 rows"),
    OddLog(
        ".json, lists by name",
        text("log.json", lambda s: json.dumps({"data": frame_of(s).to_dict(orient="list")})),
        "3200 rows",
    ),
    OddLog(".jsonl", text("log.jsonl", lambda s: frame_of(s).to_json(orient="records", lines=True)), "3200 rows"),
    OddLog(
        ".npz",
        lambda folder: [_npz(folder / "log.npz")],
        "NumPy arrays",
        ("--position", "q_*", "--torque", "tau_*", *NUMBERS),
    ),
    OddLog("Parquet with vectors in its cells, as of a LeRobot dataset", parquet(lists), ".parquet columns", VECTORS),
)
BROKEN = (
    OddLog("the last row breaks off", text("log.csv", lambda s: s[:-25]), "the last row (line 3201)"),
    OddLog(
        "a row in the middle breaks off",
        text("log.csv", lambda s: _cut_line(s, 1500)),
        "line 1501: 4 cells where the header has 7",
        is_read=False,
    ),
    OddLog("253 rad in 3 rows, the limit is 2.88", csv("log.csv", put("q2", slice(700, 703), 253.0)), "3 of 3200 rows"),
    OddLog(
        "253 rad in a third of the rows",
        csv("log.csv", put("q2", slice(700, 1800), 253.0)),
        "position of joint joint2 reaches 253, as rad that is 40.3 turns",
        is_read=False,
    ),
    OddLog("a torque of 65535 in 2 rows", csv("log.csv", put("tau2", slice(900, 902), 65535.0)), "2 of 3200 rows"),
    OddLog("1e300 in a cell", csv("log.csv", put("tau2", slice(900, 901), 1e300)), "1 of 3200 rows hold a value"),
    OddLog("ERR in 20 cells", csv("log.csv", put("q1", slice(900, 920), "ERR")), "20 of 3200 rows hold a value"),
    OddLog(
        "ERR in a fifth of the cells",
        csv("log.csv", put("q1", slice(900, 1600), "ERR")),
        "column q1 holds text in 700 of 3200 rows",
        is_read=False,
    ),
    OddLog(
        "a column of torque is a copy of another",
        csv("log.csv", lambda table: table.assign(tau3=table["tau2"])),
        "torque of joint 2 is that of joint 3 in every row: left out",
    ),
    OddLog(
        "a column of torque is a multiple of another",
        csv("log.csv", lambda table: table.assign(tau3=-0.5 * table["tau2"])),
        "The torque of joints 2 and 3 differs by the factor -0.5 in every row",
        is_read=False,
        command="identify",
    ),
    OddLog(
        "a second torque beside the measured one",
        csv("log.csv", lambda table: table.assign(tauSm1=table["tau1"], tauSm2=table["tau2"], tauSm3=table["tau3"])),
        "the file holds 2 torques of each joint (tau1, tau2, tau3; tauSm1, tauSm2, tauSm3)",
        is_read=False,
    ),
    OddLog(
        "a column of positions is a copy of another",
        csv("log.csv", lambda table: table.assign(q1=table["q3"])),
        "The position of joints 1 and 3 is the same in every row",
        is_read=False,
        command="identify",
    ),
    OddLog("rows of zeros between good rows", csv("log.csv", with_zeros), "rows hold zeros alone"),
    OddLog(
        "a quote that does not close",
        text("log.csv", lambda s: s.replace("\n0.5,", '\n"0.5,', 1)),
        "a quote opens there and does not close",
        is_read=False,
    ),
)


REPORTED = {  # threads on GitHub in which people describe such logs
    "unitreerobotics/unitree_lerobot#41, huggingface/lerobot#933": (
        "2 episodes of equal length, each from 0 s",
        "3 episodes of equal length",
        "4 episodes of equal length",
        "episodes of different lengths",
    ),
    "open-mmlab/mmdetection3d#296, facebookresearch/polymetis#3": (
        "seconds since 1970 in single precision",
        "seconds since 1970 with six digits",
    ),
    "Minipada/ros2_data_collection#308": (
        "whole seconds of a stamp alone",
        "seconds and nanoseconds in two columns",
    ),
    "ros-controls/gz_ros2_control#169, gazebosim/gz-sim#883": (
        "effort zero at all joints",
        "effort zero at one joint",
        "torque constant at all joints",
        "an arm that stands still",
    ),
    "moveit/moveit_ros#286, ros-industrial/motoman#59": (
        "arm and gripper in messages of their own on one topic",
        "the arm in two messages on one topic",
    ),
    "grafana/grafana-csv-datasource#298, facontidavide/PlotJuggler#1220": (
        "stamps in ISO 8601 with Z",
        "with +01:00",
        "with a blank",
        "as dd.mm.yyyy",
        "as hh:mm:ss.mmm over midnight",
        "date and time in two columns",
    ),
    "facontidavide/PlotJuggler#71, facontidavide/PlotJuggler#1038": (
        "positions and torques in alternate rows",
        "torques at a quarter of the rate",
        "a tenth of the torque's cells empty",
    ),
    "UniversalRobots/Universal_Robots_ROS2_Driver#1551, UniversalRobots/Universal_Robots_ROS_Driver#160, #286": (
        "torque less the gravity of the arm's links, while 1.5 kg are carried",
    ),
    "ros2/rosbag2#395, ros2/rosbag2#2445": (
        "a bag's folder without metadata.yaml",
        "the same with two files",
        "the one file of such a folder",
        "a bag whose file rosbag2 packed with zstd",
        "a bag whose messages rosbag2 packed with zstd",
        "a bag as MCAP",
        "a bag packed with zstd, .db3.zstd",
    ),
    "huggingface/lerobot#1014": (
        "a load in counts, as a size with a bit for its direction",
        "torque without its sign",
    ),
    "facontidavide/PlotJuggler#46": (
        "byte order mark, CR line ends",
        "CR CR LF line ends",
        "blank lines",
        "the header again between rows",
        "quotes around numbers",
        "a column that counts rows",
        "a column that stands there twice",
        "semicolons and decimal commas",
        "a pause of 100 s",
        "a clock with 150 ticks a second for 200 rows",
    ),
    "robfiras/loco-mujoco#8, kjyv/FloBaRoID#5": (
        "UTF-16",
        "Windows-1252",
        ".csv.gz",
        ".zip of one file",
        ".json, a list of rows",
        ".json, lists by name",
        ".jsonl",
        ".npz",
        "Parquet with vectors in its cells, as of a LeRobot dataset",
    ),
}


MAX_DEVIATION = largest_by_chance(len(FROM_LOGS) + len(BROKEN))


def frame_of(content: str) -> pd.DataFrame:
    from io import StringIO

    return pd.read_csv(StringIO(content))


def _npz(path: Path) -> Path:
    table = log()
    np.savez(path, t=table["t"], q=table[POSITION].to_numpy(), tau=table[TORQUE].to_numpy())
    return path


def _cut_line(content: str, line: int) -> str:
    lines = content.splitlines(keepends=True)
    lines[line] = ",".join(lines[line].split(",")[:4]) + "\n"
    return "".join(lines)


@dataclass(frozen=True)
class Outcome:
    """exit_status and line of the command. deviation: largest of the base parameters from the plain log's, in half
    widths of 95 % intervals of both; None where nothing is identified.
    """

    exit_status: int
    line: str
    deviation: float | None


def run_log(case: OddLog, folder: Path) -> Outcome:
    """Imports a log, and identifies what comes of it."""
    files, out = case.write(folder), folder / "recording"
    given = ["--robot", "irb120-arm", "--out", str(out), *case.options]
    given += ["--validate", str(files[1])] if case.command == "identify" and len(files) > 1 else []
    if not any(each.startswith(("position=", "torque=")) for each in case.options):
        given += ["--unit", "position=rad", "--unit", "torque=N.m"] if files[0].suffix not in ("", ".zstd") else []
    done = CliRunner().invoke(main, ["recording", "import", *map(str, files), *given])
    said = done.output
    if case.command == "identify" and done.exit_code == 0:
        done = CliRunner().invoke(main, ["identify", str(out), "--out", str(folder / "model")])
        said = done.output
    found = said.splitlines() or [""]
    deviation = None
    if done.exit_code == 0 and case.is_read:
        recording = load_recording(out)
        arm = replace(ARM, unmeasured=recording.arm.unmeasured)
        deviation = largest_deviation(fit(recording.with_role("identify"), arm), plain_model(arm.unmeasured))
    line = next((each for each in found if case.says in each), found[-1])
    return Outcome(done.exit_code, line.replace(f"{folder}/", "").strip(), deviation)


def fit(runs: tuple[Run, ...], arm: Arm = ARM) -> Model:
    return Identifier(arm, cutoff_hz=CUTOFF_HZ).fit(runs).model_


@cache
def plain_model(without: frozenset[int] = frozenset()) -> Model:
    """The model of a log in the plainest form. without: joints, from 0, whose torque is left out."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.csv"
        log().to_csv(path, index=False)
        given = ["--robot", "irb120-arm", "--out", f"{folder}/recording", *NUMBERS]
        CliRunner().invoke(main, ["recording", "import", str(path), *given], catch_exceptions=False)
        runs, arm = load_recording(Path(folder) / "recording").runs, replace(ARM, unmeasured=without)
        return fit(tuple(run.with_signals(run.time, {"torque": measured_rows(arm, run.torque)}) for run in runs), arm)


def largest_deviation(model: Model, plain: Model) -> float:
    """Of all base parameters and components, in half widths of 95 % intervals of both fits together."""
    known = {(part, each.name): each for part, each in plain.named_parameters()}
    worst = 0.0
    for part, each in model.named_parameters():
        other = known.pop((part, each.name))
        assert np.ptp(np.array(each.interval)) > 0, f"{each.name} has no interval"
        half = np.hypot(np.ptp(np.array(each.interval)) / 2, np.ptp(np.array(other.interval)) / 2)
        worst = max(worst, float(abs(np.asarray(each.value) - np.asarray(other.value)).max() / half))
    assert not known, f"not identified: {sorted(known)}"
    assert len(plain.named_parameters()) <= PARAMETERS
    return worst


def rows_of(cases: tuple[OddLog, ...]) -> list[list[str]]:
    """A row a log: what it is, who reports such logs, and what is made of it."""
    threads = {what: thread for thread, logs in REPORTED.items() for what in logs}
    rows = []
    for case in cases:
        with tempfile.TemporaryDirectory() as folder:
            outcome = run_log(case, Path(folder))
        numbers = "–" if outcome.deviation is None else f"{outcome.deviation:.2f}"
        status = "refused" if outcome.exit_status else "read"
        rows.append(
            [case.what, threads.get(case.what, "–"), status, f"`{outcome.line.removeprefix('armlab: ')}`", numbers]
        )
    return rows


def page() -> str:
    """`docs/odd-logs.md`."""
    headings = ["log", "reported in", "outcome", "the line that says it", "numbers off by"]
    return (
        "# Odd and broken logs\n\n"
        "What `armlab recording import` does with logs as robots write them, and `armlab identify` where the log is "
        "read and nothing can be identified from it. Written by `python tests/recordings/odd_logs.py`; a test runs "
        "each row. Second column: threads on GitHub, owner/repository#number, in which people describe such logs. Last "
        "column: the largest deviation of any identified number from that of the same log in the "
        "plainest form, in half widths of the 95 % intervals of both. The test asks for less than "
        f"{MAX_DEVIATION:.2f}: by chance, no number of {len(FROM_LOGS) + len(BROKEN)} logs exceeds that in 95 of 100 "
        "trials.\n\n"
        f"## As robots write them\n\n{markdown_table(headings, rows_of(FROM_LOGS))}\n\n"
        f"## Broken\n\n{markdown_table(headings, rows_of(BROKEN))}\n"
    )


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    print(f"wrote {PAGE}")
    sys.exit(0)
