"""Problems by the name of their preset: built-in ones, and third parties' of the entry-point group `armlab.problems`.

A suite of a third party, of the group `armlab.suites`, is a mapping of names to settings of such problems. Names of
presets and suites are found without importing anything, so a broken plug-in affects only those who use it.
"""

from collections.abc import Mapping
from importlib.metadata import EntryPoint, entry_points
from types import MappingProxyType
from typing import Any

from armlab.common.errors import InputError
from armlab.common.plug_ins import BrokenPlugInError, load_plug_in
from armlab.common.settings import Settings, suggest_name, validate
from problem import suite as built_in
from problem.callables import CallableSettings
from problem.functions import FUNCTIONS
from problem.presets import (
    FunctionSettings,
    JointFourierSettings,
    PaperSettings,
    RandomFrameSettings,
)
from problem.suite import InstanceSettings

ENTRY_POINT_GROUP = "armlab.problems"
SUITE_GROUP = "armlab.suites"

ProblemSettings = PaperSettings | JointFourierSettings | FunctionSettings | InstanceSettings | CallableSettings
PRESETS: Mapping[str, type[ProblemSettings]] = MappingProxyType(
    {
        "paper": PaperSettings,
        "joint-fourier": JointFourierSettings,
        "random-frame": RandomFrameSettings,
        **dict.fromkeys(FUNCTIONS, FunctionSettings),
        **{name: InstanceSettings for suite in built_in.suites() for name in built_in.instances(suite)},
    }
)


def names() -> list[str]:
    """Names of all presets, the plug-ins' last; beside them stand the problems of suites (see `problem.suite`)."""
    built_in = [name for name, settings in PRESETS.items() if settings is not InstanceSettings]
    return list(dict.fromkeys([*built_in, *sorted(entry.name for entry in plug_ins())]))


def plug_ins() -> list[EntryPoint]:
    """The problems that other packages registered, each a class of settings with `build`."""
    return list(entry_points(group=ENTRY_POINT_GROUP))


def suites() -> list[str]:
    """Names of all suites, the plug-ins' last."""
    return [*built_in.suites(), *sorted(entry.name for entry in entry_points(group=SUITE_GROUP))]


def instances(suite: str) -> list[str]:
    """Full names of the problems of a suite, in its order. Raises InputError for one that is unknown or broken."""
    plugged = _suite_of_plug_in(suite)
    return built_in.instances(suite) if plugged is None else [f"{suite}/{name}" for name in plugged]


def _suite_of_plug_in(name: str) -> Mapping[str, Settings] | None:
    """The problems of a plug-in's suite by their names in it; None where no plug-in has a suite of that name."""
    for entry in entry_points(group=SUITE_GROUP):
        if entry.name == name:
            try:
                problems: Mapping[str, Settings] = load_plug_in(entry)
            except BrokenPlugInError as error:
                raise InputError(f"suite '{name}' ({entry.value}) cannot be imported: {error}") from error
            if not isinstance(problems, Mapping) or not all(
                isinstance(each, Settings) and hasattr(each, "preset") for each in problems.values()
            ):
                raise InputError(f"suite '{name}' ({entry.value}) should map names to settings of problems")
            return problems
    return None


def is_plug_in(settings: ProblemSettings) -> bool:
    """Whether settings are those of a plug-in's problem."""
    return type(settings) not in (*PRESETS.values(), CallableSettings)


def parse_problem(data: Mapping[str, Any], where: str) -> ProblemSettings:
    """Checked settings of `{preset: NAME, ...}`, or with a Python function in the place of the name.

    where: what the data is, for the reader of an error.

    Raises InputError, in one line, for an unknown preset or key, a value of the wrong type, or a plug-in that
    cannot be used.
    """
    preset = data.get("preset") if isinstance(data, Mapping) else None
    if callable(preset):
        return validate(CallableSettings, dict(data), where)
    if not isinstance(preset, str):
        raise InputError(f"{where}: should hold `preset: NAME`, one of {', '.join(names())}")
    suite, _, name = preset.partition("/")
    if name and (plugged := _suite_of_plug_in(suite)) is not None:
        if name not in plugged:
            raise InputError(f"{where}: suite '{suite}' has no problem '{name}': {suggest_name(name, list(plugged))}")
        data = dict(plugged[name]) | {key: value for key, value in data.items() if key != "preset"}
        preset = data["preset"]
    return validate(settings_type(preset, where), dict(data), where)


def settings_type(preset: str, where: str) -> type[ProblemSettings]:
    """The class of settings behind a preset; raises InputError as `parse_problem` does."""
    entries = [entry for entry in plug_ins() if entry.name == preset]
    if len(entries) + (preset in PRESETS) > 1:
        places = " and ".join(entry.value for entry in entries)
        ours = "; it is built in" if preset in PRESETS else ""
        raise InputError(f"{where}: preset '{preset}' is registered more than once: {places}{ours}")
    if entries:
        return _load_settings(entries[0], where)
    if preset not in PRESETS:
        raise InputError(f"{where}: unknown preset '{preset}': {_name_hint(preset)}")
    return PRESETS[preset]


def _load_settings(entry: EntryPoint, where: str) -> type[ProblemSettings]:
    place = f"{where}: problem '{entry.name}' ({entry.value})"
    try:
        settings: type[ProblemSettings] = load_plug_in(entry)
    except BrokenPlugInError as error:
        raise InputError(f"{place} cannot be imported: {error}") from error
    if not (isinstance(settings, type) and issubclass(settings, Settings) and hasattr(settings, "build")):
        raise InputError(f"{place} should be a class of armlab.common.settings.Settings with a method `build`")
    return settings


def _name_hint(preset: str) -> str:
    """The name that was probably meant: of a suite's problems if it looks like one of them."""
    return suggest_name(preset, list(PRESETS) if "/" in preset else names())
