"""How often laws that stand in a robot file are reported as missing, and whether they hide what is missing.

Random MJCF arms with damping, friction loss, springs, armature, `ref` and compensated weight move; their torque is that
of MuJoCo's inverse dynamics with the friction loss of each joint, and noise. Nothing is missing, or one joint has more
friction than its file: three times what could just be told. The same arms without passive parts are the comparison.

    python tests/passive_parts_study.py --nothing-missing 300 --hidden 100 --out results.csv
"""

import argparse
import csv
import tempfile
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml
from scipy.stats import binomtest, fisher_exact

from armlab.common.arrays import Array
from armlab.diagnosis.torque.diagnose import diagnose
from armlab.recordings.load import load_recording
from problem.mjcf import compile_mjcf
from problem.motion import Motion
from problem.robot_file import load_arm
from problem.simulator_check import mujoco_torque

RATE_HZ, SECONDS = 250.0, 12.0
PARTS_OF_SAMPLE = 20  # in which friction is averaged
NOISE_SHARE = 0.003  # of the largest torque of a joint
LIMITS_OF_DETECTION = 3.0  # times which the hidden friction is
TOLD_RATIO = 5.0  # standard errors of a friction level that can just be told
HARMONICS = 4
MAX_FALSE_SHARE = 0.01  # of recordings in which nothing is missing
LEVEL = 0.05  # of the test that passive parts hide nothing


@dataclass(frozen=True)
class Case:
    """One recording. hidden: the joint, from 1, with more friction than its file, None where nothing is missing."""

    number: int
    passive: bool
    hidden: int | None
    size: float
    findings: str
    status: str

    @property
    def is_named(self) -> bool:
        """Whether the hidden friction is a finding."""
        return f"coulomb_friction@{self.hidden}" in self.findings.split()


def write_arm(path: Path, rng: np.random.Generator, passive: bool) -> None:
    """A random arm as MJCF. The bodies are the same with and without passive parts."""
    joints = int(rng.integers(2, 5))
    opened, closed = [], []
    for number in range(1, joints + 1):
        mass, length = rng.uniform(0.5, 4) / number, rng.uniform(0.15, 0.4)
        axis, centre = rng.permutation([0.0, 0.0, 1.0]), rng.uniform(-0.3, 0.6, 3) * length
        size = mass * length**2 * rng.uniform(0.05, 0.1, 3)
        laws = {
            "damping": rng.uniform(0.1, 1.5),
            "frictionloss": rng.uniform(0.2, 2.0),
            "armature": rng.uniform(0, 0.05),
            "stiffness": rng.choice([0.0, rng.uniform(1, 20)]),
            "springref": rng.uniform(-0.5, 0.5),
            "ref": rng.choice([0.0, rng.uniform(-1.5, 1.5)]),
        }
        held = rng.choice([0.0, 1.0, rng.uniform(0, 1)], p=[0.6, 0.2, 0.2])
        stated = " ".join(f'{name}="{value:.6g}"' for name, value in laws.items()) if passive else ""
        gravcomp = f' gravcomp="{held:.6g}"' if passive else ""
        opened.append(
            f'<body name="b{number}" pos="{length if number > 1 else 0:.6g} 0 0.02"{gravcomp}>'
            f'<joint name="j{number}" axis="{_numbers(axis)}" {stated}/>'
            f'<inertial mass="{mass:.6g}" pos="{_numbers(centre)}" diaginertia="{_numbers(size)}"/>'
        )
        closed.append("</body>")
    path.write_text(
        '<mujoco><compiler angle="radian"/><worldbody>' + "".join(opened + closed) + "</worldbody></mujoco>"
    )


def _numbers(values: Array) -> str:
    return " ".join(f"{value:.6g}" for value in values)


@dataclass(frozen=True)
class Sines:
    """A wanted motion: sums of sines about rest positions. size, speed, phase: (joints, harmonics), rad, rad/s, rad."""

    rest: Array
    size: Array
    speed: Array
    phase: Array

    @classmethod
    def draw(cls, joints: int, rng: np.random.Generator) -> "Sines":
        """A random motion."""
        orders = np.arange(1, HARMONICS + 1)
        speed = 2 * np.pi * rng.uniform(0.1, 0.25, joints)[:, None] * orders
        size, phase = rng.uniform(0.2, 0.9, speed.shape) / orders, rng.uniform(0, 2 * np.pi, speed.shape)
        return cls(rng.uniform(-0.5, 0.5, joints), size, speed, phase)

    def motion(self, shift: float = 0.0) -> Motion:
        """Positions, velocities and accelerations, (samples, joints) each, so many intervals after the stamps."""
        time = (np.arange(0, SECONDS, 1 / RATE_HZ) + shift / RATE_HZ)[:, None, None]
        angle = self.speed * time + self.phase
        return Motion(
            self.rest + np.sum(self.size * np.sin(angle), axis=2),
            np.sum(self.size * self.speed * np.cos(angle), axis=2),
            -np.sum(self.size * self.speed**2 * np.sin(angle), axis=2),
        )


def simulate(model: Any, wanted: Sines) -> Array:
    """Torque (samples, joints) of MuJoCo's inverse dynamics with the friction loss against the motion.

    At a reversal the friction is its mean over the interval about the stamp, as drives average what they log.
    """
    shifts = (np.arange(PARTS_OF_SAMPLE) + 0.5) / PARTS_OF_SAMPLE - 0.5
    side = np.mean([np.sign(wanted.motion(shift).velocity) for shift in shifts], axis=0)
    return mujoco_torque(model, wanted.motion()) + model.dof_frictionloss * side


def run_case(number: int, passive: bool, with_hidden: bool) -> Case:
    """Makes a recording and diagnoses it. number: of the arm and its motion."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write_arm(folder / "arm.xml", np.random.default_rng((number, 0)), passive)
        rng, arm = np.random.default_rng((number, 1)), load_arm(str(folder / "arm.xml"))
        motions = [Sines.draw(len(arm), rng) for _ in range(2)]
        hidden = int(rng.integers(1, len(arm) + 1)) if with_hidden else None
        model, size = compile_mjcf(folder / "arm.xml"), 0.0
        noise = NOISE_SHARE * np.abs(simulate(model, motions[0])).max(axis=0)
        if hidden is not None:
            # the standard error of a level that all samples of a run tell, times what is just told
            size = LIMITS_OF_DETECTION * TOLD_RATIO * float(noise[hidden - 1]) / np.sqrt(SECONDS * RATE_HZ)
            model.dof_frictionloss[hidden - 1] += size
        for run, motion in enumerate(motions, 1):
            torque = simulate(model, motion)
            position = motion.motion().position
            _write_run(folder / f"run-{run}.csv", position, torque + noise * rng.standard_normal(torque.shape))
        _write_recording(folder, len(arm))
        found = diagnose(load_recording(folder))
    setup = [] if found.setup is None else [f"setup:{each.mistake.label}" for each in found.setup.findings]
    names = [*setup, *(f"{each.effect}@{each.joint}" for each in found.claims)]
    return Case(number, passive, hidden, float(size), " ".join(names), found.status)


def _write_run(path: Path, position: Array, torque: Array) -> None:
    joints = range(1, position.shape[1] + 1)
    names = ["t", *(f"q{joint}" for joint in joints), *(f"tau{joint}" for joint in joints)]
    time = np.arange(len(position)) / RATE_HZ
    pd.DataFrame(np.column_stack([time, position, torque]), columns=names).to_csv(path, index=False)


def _write_recording(folder: Path, joints: int) -> None:
    numbers = range(1, joints + 1)
    content = {
        "schema": "recording/1",
        "robot": "arm.xml",
        "columns": {
            "time": "t",
            "position": [f"q{joint}" for joint in numbers],
            "torque": [f"tau{joint}" for joint in numbers],
        },
        "units": {"time": "s", "position": "rad", "torque": "N.m"},
        "runs": [{"file": "run-1.csv", "role": "identify"}, {"file": "run-2.csv", "role": "validate"}],
    }
    (folder / "recording.yaml").write_text(yaml.safe_dump(content))


def judge(cases: list[Case]) -> list[str]:
    """What the cases show, one line each, and whether that is enough."""
    nulls = [case for case in cases if case.hidden is None and case.passive]
    false = [case for case in nulls if case.findings]
    lines = []
    if nulls:
        # fails where so many false findings have less than one chance in twenty at the largest share allowed
        chance = binomtest(len(false), len(nulls), MAX_FALSE_SHARE, alternative="greater").pvalue
        verdict = "as wanted" if chance > LEVEL else "too many"
        lines.append(f"false findings: {len(false)} of {len(nulls)} recordings with nothing missing: {verdict}")
        lines += [f"  {case.number}: {case.findings}" for case in false]
    hidden = {own: [case for case in cases if case.hidden is not None and case.passive is own] for own in (True, False)}
    if hidden[True] and hidden[False]:
        named = {own: sum(case.is_named for case in each) for own, each in hidden.items()}
        table = [[named[own], len(hidden[own]) - named[own]] for own in (True, False)]
        chance = float(fisher_exact(table, alternative="less").pvalue)
        verdict = "as wanted" if chance > LEVEL else "less often"
        lines.append(
            f"hidden friction named: {named[True]} of {len(hidden[True])} with passive parts, {named[False]} of "
            f"{len(hidden[False])} without (p {chance:.2g}): {verdict}"
        )
    return lines


def read_cases(path: Path) -> list[Case]:
    """The cases of a CSV file, none where it does not exist."""
    if not path.is_file():
        return []
    with path.open(newline="", encoding="utf-8") as file:
        return [
            Case(
                number=int(row["number"]),
                passive=row["passive"] == "True",
                hidden=int(row["hidden"]) if row["hidden"] else None,
                size=float(row["size"]),
                findings=row["findings"],
                status=row["status"],
            )
            for row in csv.DictReader(file)
        ]


def append_case(path: Path, case: Case) -> None:
    """Adds a row at once, so that a study that is interrupted goes on where it was."""
    is_new = not path.is_file()
    with path.open("a", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(asdict(case)), lineterminator="\n")
        if is_new:
            writer.writeheader()
        writer.writerow(asdict(case))


def main() -> None:
    """Makes, diagnoses and judges as many recordings as are asked."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--nothing-missing", type=int, default=10, help="recordings in which nothing is missing")
    parser.add_argument("--hidden", type=int, default=0, help="recordings with hidden friction, with and without parts")
    parser.add_argument("--first", type=int, default=0, help="number of the first arm, to share the work")
    parser.add_argument("--out", type=Path, help="CSV file with a row for each recording; rows that it has are kept")
    options = parser.parse_args()
    numbers = range(options.first, options.first + options.nothing_missing)
    asked = [(number, True, False) for number in numbers]
    hidden = range(options.first, options.first + options.hidden)
    asked += [(number, passive, True) for number in hidden for passive in (True, False)]
    cases = read_cases(options.out) if options.out else []
    made = {(case.number, case.passive, case.hidden is not None) for case in cases}
    for each in asked:
        if each not in made:
            cases.append(run_case(*each))
            print(cases[-1], flush=True)
            if options.out:
                append_case(options.out, cases[-1])
    print("\n".join(judge(cases)))


if __name__ == "__main__":
    main()
