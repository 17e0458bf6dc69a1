"""Hyper-parameters from a configuration into an algorithm's own `Params`."""

from dataclasses import MISSING, fields
from typing import Any, get_type_hints

from pydantic import create_model

from problem.errors import InputError
from problem.settings import Settings, validate


def parse_params(params_type: type[Any], data: dict[str, Any], where: str) -> Any:
    """A `Params` with the given values and its defaults for the others.

    Raises InputError, in one line, for a name it does not have, a wrong type, or a value it refuses.
    """
    hints = get_type_hints(params_type)
    known: dict[str, Any] = {field.name: (hints[field.name], _default(field)) for field in fields(params_type)}
    model: type[Settings] = create_model(params_type.__name__, __base__=Settings, **known)
    checked = validate(model, data, where)
    try:
        return params_type(**dict(checked))
    except ValueError as error:
        raise InputError(f"{where}: {error}") from None


def _default(field: Any) -> Any:
    return ... if field.default is MISSING else field.default
