"""Runs figaroh: `figaroh_script.py RUNS URDF OUT`, in an environment that has it.

Its own regressor, column elimination, base parameters by QR and weighted least squares; friction, rotor inertia and
offset at every joint. Columns and torque pass the shared filter in place of its decimation.
"""

import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
from figaroh.identification import BaseIdentification
from figaroh.tools.load_robot import load_robot
from figaroh.tools.regressor import build_regressor_basic

from armlab.common.arrays import Array
from armlab.proof.open.peers.exchange import PeerRun, read_runs, write_answer


class RecordedIdentification(BaseIdentification):  # type: ignore[misc]
    """figaroh's procedure on a run that is ready."""

    def __init__(self, robot: Any, run: PeerRun) -> None:
        """Takes the run in place of a configuration file."""
        self._run = run
        super().__init__(robot, "")

    def load_param(self, config_file: str, setting_type: str = "identification") -> None:
        """The structure: what figaroh offers for any arm."""
        joints = list(range(self.model.nv))
        zeros = [0.0] * len(joints)
        names = [str(name) for name in self.model.names[1:]]
        flags = ("has_friction", "has_actuator_inertia", "has_joint_offset", "is_joint_torques")
        self.identif_config = {
            **dict.fromkeys(flags, True),
            **dict.fromkeys(("fv", "fs", "Ia", "off"), zeros),
            "active_joints": names,
            "act_idxq": joints,
            "act_idxv": joints,
            "act_Jid": [joint + 1 for joint in joints],
            "is_external_wrench": False,
            "force_torque": None,
            "ratio_essential": 30.0,
        }

    def load_trajectory_data(self, data_source: str | None = None) -> dict[str, Array]:
        """The motion, filtered already."""
        return {name: getattr(self._run, name) for name in ("position", "velocity", "acceleration", "torque")}

    def prepare(self) -> None:
        """Regressor and torque through the shared filter."""
        run, kept = self._run, self._run.low_pass.rows
        motion = {"positions": run.position, "velocities": run.velocity, "accelerations": run.acceleration}
        thinned = {name: signal[kept] for name, signal in motion.items()}
        self.processed_data = {**thinned, "torques": run.low_pass(run.torque)}
        self.num_samples = len(self.processed_data["torques"])
        self.dynamic_regressor = self.regressor(self._run)
        self.initialize_standard_parameters()

    def regressor(self, run: PeerRun) -> Array:
        """figaroh's columns of a run, filtered: (joints * kept, columns), joint by joint as figaroh has them."""
        rows = build_regressor_basic(self.robot, run.position, run.velocity, run.acceleration, self.identif_config)
        by_joint = rows.reshape(self.model.nv, len(run.position), -1)
        return np.concatenate([run.low_pass(joint) for joint in by_joint])

    def predicted(self, run: PeerRun) -> Array:
        """Filtered torque of another run, (kept, joints)."""
        reduced = np.delete(self.regressor(run), self._idx_eliminated, axis=1)
        return np.asarray(reduced[:, self._base_indices] @ self.phi_base).reshape(self.model.nv, -1).T


def main(runs_file: str, urdf: str, out: str) -> None:
    """Fits the run that identifies and predicts all."""
    runs = list(read_runs(Path(runs_file)))
    robot = load_robot(urdf, package_dirs=str(Path(urdf).parent), loader="figaroh")
    started = time.process_time()
    identification = RecordedIdentification(robot, next(run for run in runs if run.role == "identify"))
    identification.prepare()
    identification.solve(decimate=False, plotting=False, wls=True)
    seconds = time.process_time() - started
    write_answer({run.name: identification.predicted(run) for run in runs}, seconds, Path(out))


if __name__ == "__main__":
    main(*sys.argv[1:])
