"""x"""

from collections.abc import Mapping

USUAL_S: Mapping[str, float] = {}
SHARES: Mapping[str, Mapping[str, float]] = {}
