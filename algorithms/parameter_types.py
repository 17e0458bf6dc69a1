"""Types of the fields of `Params`: ranges of hyper-parameters, which `bench.config` checks, and readings of a source.

A reading says which form of an algorithm is run where its source's text, its authors' program and this package differ.
`ours`: the equations, with what they leave open decided as the docstring of the algorithm says; the default. `text`:
the equations as printed, with nothing added. `program`: what the authors' released program does, written anew from its
behaviour. The docstring of an algorithm that has readings says what they are.
"""

from typing import Annotated, Final, Literal, TypeAlias

from annotated_types import Ge, Gt, Interval

Positive: TypeAlias = Annotated[float, Gt(0)]
NotNegative: TypeAlias = Annotated[float, Ge(0)]
Share: TypeAlias = Annotated[float, Interval(ge=0, le=1)]

Reading: TypeAlias = Literal["ours", "text", "program"]
TextReading: TypeAlias = Literal["ours", "text"]
OURS: Final = "ours"
