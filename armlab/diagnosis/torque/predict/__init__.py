"""The model that predicts, beside its plain yardstick, and what each part of it explains."""
