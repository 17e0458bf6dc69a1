"""Random streams that are derived from names, never from the order of work or the number of workers."""

import hashlib
import json

import numpy as np


def named_generator(*names: str | int) -> np.random.Generator:
    """A PCG64 generator whose seed is the SHA-256 of the names; other names give an independent stream."""
    digest = hashlib.sha256(json.dumps(names).encode()).digest()
    return np.random.Generator(np.random.PCG64(int.from_bytes(digest, "big")))
