"""Stand-in for `armlab.diagnosis.found_model.named_model`, until that is there."""

from armlab.diagnosis.found_model import model_found as named_model

__all__ = ["named_model"]
