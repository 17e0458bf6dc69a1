"""How lines and marks look: colours that the colour-blind can tell (Okabe and Ito 2008), and dashes beside them."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Look:
    """A line or mark with the name that the legend gives it."""

    name: str
    color: str
    width: float = 1.4
    dash: str = ""


MEASURED = Look("measured", "#8b929b", 2.8)
GIVEN = Look("simulation as given", "#b87800", 1.3, "6 3")
REFITTED = Look("rigid body refitted", "#0072b2", 1.3, "2 2")
FOUND = Look("with what was found", "#007a58", 1.4)
FLOOR = Look("noise floor", "#9c4a7e", 1.4, "8 3 2 3")
LAW = Look("fitted law", "#c44e00", 2.0)
SURROGATE = Look("surrogate", "#7b3294", 2.0)
FITTED_ROWS = Look("data of the fit", "#a9b0b8", 2.6)
HELD_OUT_ROWS = Look("held-out data", "#3d6f9e", 2.6)
GUILTY, UNKNOWN, INNOCENT = "#c44e00", "#7b3294", "#7d8791"
