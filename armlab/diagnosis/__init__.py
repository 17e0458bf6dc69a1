"""Diagnosis: from a mismatch between simulation and recording to named physics, with numbers and intervals."""
