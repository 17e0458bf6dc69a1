"""The words that the pages use and explain, as in docs/glossary.md: the first use of each leads to its meaning."""

import re

MEANINGS = {
    "absorbed": "the share of an effect's torque that a refit of the rigid body takes in, so that it does not show",
    "base parameters": "the combinations of inertial parameters that joint torques depend on",
    "common model": "what all compared recordings share: the links, and the effects that their diagnoses found",
    "Coulomb friction": "constant torque against the motion, whatever the speed",
    "cut-off": "frequency of the low-pass filter that measured torque and model both pass",
    "ERT": "expected running time: evaluations until a target is reached, runs that fail included",
    "gap closed": (
        "the share of the way from the error of the refitted rigid body down to the noise floor that the model found "
        "goes; 100 % is all that data can show"
    ),
    "held-out": "taken no part in any fit: validation runs, or blocks of time where there are none",
    "Holm": "a correction of p-values for the number of comparisons (Holm 1979)",
    "inertial parameters": "mass, centre of mass times mass, and inertia of a link: ten numbers",
    "log evidence": "how much likelier the data are with an effect than without it, its freedom counted; a logarithm",
    "log likelihood": "the logarithm of how likely the data are under a model; 2 units more is a clear difference",
    "noise floor": "the error that the noise of the torque alone leaves",
    "p-value": "the probability of so clear a result by chance where there is no effect",
    "payload": "a body that a link carries",
    "refitted": "the same rigid body with its inertial parameters fitted anew, without other physics",
    "rival": "another effect or place that these data cannot tell from a finding",
    "rms": "root mean square",
    "rotor inertia": "inertia of the motor behind its gear, on the joint side: a torque proportional to acceleration",
    "simulation as given": "the model of the recording's robot file, with its own numbers",
    "standard errors": "a difference over its own uncertainty; 4 and more are clear",
    "surrogate": "a flexible regression that stands in for physics without a name",
    "viscous friction": "torque against the motion, proportional to speed",
    "whitened": "divided by the noise's own spectrum, so that samples count as independent",
    "95 % interval": "the range that holds the true value in 95 of 100 recordings, if the model lacks no effect",
}
_LONGEST_FIRST = "|".join(re.escape(word) for word in sorted(MEANINGS, key=len, reverse=True))
_PATTERN = re.compile(rf"(?<![\w-])({_LONGEST_FIRST})(?![\w-])", re.IGNORECASE)
_WORDS = {word.lower(): word for word in MEANINGS}


class Glossary:
    """The words of one page: which it has used, in their order."""

    def __init__(self) -> None:
        self.used: dict[str, str] = {}

    def split(self, text: str) -> list[tuple[str, str]]:
        """Pieces of a text, each with the word that is explained there for the first time on the page, or ``."""
        pieces = []
        for number, piece in enumerate(_PATTERN.split(text)):
            word = _WORDS[piece.lower()] if number % 2 else ""
            first = bool(word) and word not in self.used
            if first:
                self.used[word] = MEANINGS[word]
            pieces.append((piece, word if first else ""))
        return pieces


def word_anchor(word: str) -> str:
    """The id of a word's meaning on a page."""
    return "word-" + re.sub(r"\W+", "-", word.lower()).strip("-")
