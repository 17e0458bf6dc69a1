"""An identified model that saves, loads and plots itself."""

from pathlib import Path
from typing import Any

from armlab.identification.model_file import read_model, write_model
from armlab.identification.torque_model import TorqueModel
from armlab.recordings.recording import Run


class Model(TorqueModel):
    """A torque model that goes to files and pictures."""

    def save(self, path: str | Path) -> Path:
        """Writes `model.yaml`; InputError where it cannot be written."""
        return write_model(self, Path(path))

    @classmethod
    def load(cls, path: str | Path) -> "Model":
        """The model of a `model.yaml`; InputError, in one line, where it is wrong."""
        return cls(**vars(read_model(Path(path))))

    def plot(self, run: Run) -> Any:
        """A figure of recorded and predicted torque and what is left, joint by joint."""
        from armlab.identification.pictures import residual_figure  # matplotlib is loaded by those who draw

        return residual_figure(self, self.signals(run))
