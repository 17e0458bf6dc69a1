"""Pictures of a model beside a run."""

from matplotlib.figure import Figure

from armlab.common.report import palette
from armlab.identification.torque_model import TorqueModel
from armlab.recordings.differentiate import Signals

FIGURE_WIDTH, ROW_HEIGHT = 11.0, 1.5  # inches


def residual_figure(model: TorqueModel, signals: Signals) -> Figure:
    """Recorded and predicted torque, and what is left, joint by joint."""
    predicted, joints = model.filtered_torque(signals), len(model.arm)
    figure = Figure((FIGURE_WIDTH, ROW_HEIGHT * joints + 0.6), layout="constrained")
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
