"""What an import has to ask: a question is an option of the command that is missing."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

NO_TORQUE = "none"  # the answer to a question for torque in a log of commands and positions
Options = Mapping[str, Any]  # of the command, by name; None or an empty tuple where one is not given


@dataclass(frozen=True)
class Question:
    """What neither the files nor the options tell.

    option: of the command, by name. missing: the sentence of a message, with the flag. text: what a form asks.
    proposal: the answer to offer, or None. signal: whose unit is asked for, where the option is `units`. context: what
    a message says once after all that is missing.
    """

    option: str
    missing: str
    text: str
    proposal: str | None = None
    signal: str | None = None
    context: str | None = None

    def with_answer(self, options: Options, answer: str) -> dict[str, Any]:
        """The options with an answer in its place."""
        given = answer.strip()
        if self.option == "units":
            others = [each for each in options["units"] if each.partition("=")[0] != self.signal]
            return {**options, "units": (*others, f"{self.signal}={given}")}
        if self.option == "torque" and given.lower() == NO_TORQUE:
            return {**options, "reference_position": ""}
        return {**options, self.option: given}
