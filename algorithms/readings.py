"""Readings of a source: where its text, its authors' program and this package differ, each is a convention.

`ours`: the equations, with what they leave open decided as the docstring of the algorithm says; the default.
`text`: the equations as printed, with nothing added. `program`: what the authors' released program does, written anew
from its behaviour. Each algorithm that has readings says in its docstring what they are.
"""

from typing import Final, Literal

Reading = Literal["ours", "text", "program"]
TextReading = Literal["ours", "text"]
OURS: Final = "ours"
