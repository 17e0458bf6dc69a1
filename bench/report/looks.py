"""Which colour and dash an algorithm has, everywhere on the page."""

from typing import NamedTuple

# Okabe and Ito 2008 without yellow, then two of Tol's muted colours: told apart with any colour vision; and the dash,
# too, tells them apart on a grey print.
_COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#882255", "#777777")
_DASHES = ("", "6 3", "2 2", "8 3 2 3", "12 3", "4 2 1 2", "1 3", "10 2 2 2 2 2", "3 6")


class Look(NamedTuple):
    """Colour, and dashes as SVG writes them."""

    color: str
    dash: str


def look(index: int) -> Look:
    """The look of the index-th algorithm; where colours begin anew, each has another dash than before."""
    turn, place = divmod(index, len(_COLORS))
    return Look(_COLORS[place], _DASHES[(place + turn) % len(_DASHES)])
