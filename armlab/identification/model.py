"""An identified model that saves, loads and plots itself."""

from pathlib import Path
from typing import TYPE_CHECKING

from armlab.common.report import palette
from armlab.identification.model_file import read_model, write_model
from armlab.identification.torque_model import TorqueModel
from armlab.recordings.differentiate import Signals
from armlab.recordings.recording import Run

if TYPE_CHECKING:
    from armlab.common.report.figures import ShownFigure

FIGURE_WIDTH, ROW_HEIGHT = 11.0, 1.5  # inches


class Model(TorqueModel):
    """A torque model that goes to files and pictures."""

    def save(self, path: str | Path) -> Path:
        """Writes `model.yaml`; InputError where it cannot be written."""
        return write_model(self, Path(path))

    @classmethod
    def load(cls, path: str | Path) -> "Model":
        """The model of a `model.yaml`; InputError, in one line, where it is wrong."""
        return cls(**vars(read_model(Path(path))))

    def plot(self, run: Run) -> "ShownFigure":
        """A figure of recorded and predicted torque and what is left, joint by joint."""
        return residual_figure(self, self.signals(run))


def residual_figure(model: TorqueModel, signals: Signals) -> "ShownFigure":
    """Recorded and predicted torque, and what is left, joint by joint."""
    from armlab.common.report.figures import ShownFigure  # matplotlib is loaded by those who draw

    predicted, joints = model.filtered_torque(signals), len(model.arm)
    figure = ShownFigure((FIGURE_WIDTH, ROW_HEIGHT * joints + 0.6), layout="constrained")
    axes = figure.subplots(joints, 2, sharex=True, squeeze=False)
    for joint, (left, right) in enumerate(axes):
        unit = "N m" if model.arm.joints[joint].kind == "revolute" else "N"
        left.plot(signals.time, signals.torque[:, joint], color=palette.MIDDLE, linewidth=1.2, label="recorded")
        left.plot(signals.time, predicted[:, joint], color=palette.BLUE, linewidth=0.8, label="model")
        right.plot(signals.time, signals.torque[:, joint] - predicted[:, joint], color=palette.VERMILION, linewidth=0.7)
        left.set_ylabel(f"{model.arm.joints[joint].name}\n{unit}", fontsize=8)
    axes[0, 0].set_title(f"torque on {signals.run.name}", fontsize=9)
    axes[0, 1].set_title("recorded - model", fontsize=9)
    axes[0, 0].legend(fontsize=7, loc="lower right", bbox_to_anchor=(1, 1), ncols=2, borderaxespad=0.2)
    for axis in axes[-1]:
        axis.set_xlabel("time, s", fontsize=8)
    for axis in axes.flat:
        axis.tick_params(labelsize=7)
    return figure
