"""A share that was counted, with its interval and its entry in the log of judged runs."""

import re
from dataclasses import dataclass
from typing import Any

from armlab.common.statistics import wilson_interval


@dataclass(frozen=True)
class Share:
    """A share with its 95 % interval (Wilson 1927)."""

    name: str
    hits: int
    number: int

    @property
    def interval(self) -> tuple[float, float]:
        """Of the share."""
        return wilson_interval(self.hits, self.number)

    @property
    def text(self) -> str:
        """Share, interval and counts."""
        low, high = self.interval
        share = f"{self.hits / self.number:.1%}" if self.number else "-"
        return f"{share} ({low:.1%} to {high:.1%}), {self.hits} of {self.number}"

    @property
    def entry(self) -> dict[str, Any]:
        """As the log of judged runs has it: id, value with its interval, number of cases."""
        low, high = self.interval
        value = self.hits / self.number if self.number else None
        return {"id": share_id(self.name), "value": value, "low": low, "high": high, "number": self.number}


def share_id(name: str) -> str:
    """The name of a share in the log of judged runs."""
    return re.sub(r"[^a-z0-9]+", "_", name.lower()).strip("_")
