"""Ranges of hyper-parameters, for the types of the fields of `Params`; `bench.config` checks them."""

from typing import Annotated, TypeAlias

from annotated_types import Ge, Gt, Interval

Positive: TypeAlias = Annotated[float, Gt(0)]
NotNegative: TypeAlias = Annotated[float, Ge(0)]
Share: TypeAlias = Annotated[float, Interval(ge=0, le=1)]
