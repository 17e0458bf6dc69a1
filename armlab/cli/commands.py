"""All commands: those of the first screen, those of each noun, and what became of earlier names.

A command is imported when it is used, so that the help of a noun imports click alone.
"""

from collections.abc import Mapping
from difflib import get_close_matches
from importlib import import_module
from typing import Any

import click

from armlab.common.errors import InputError

Sections = Mapping[str, Mapping[str, str]]  # title, name of a command, its module and function

_HELP_COLUMNS = 80  # of a short help

_MOVED_WITH_THEIR_NAME = {
    "paper": "table3 figure2 figure3 study search-space does-it-help",
    "bench": "list compare share draw duels merge salvage tune properties landscape best-known published export",
    "model": "lock-joints confusability",
    "recording": "gains",
    "proof": "oracle real real-motion real-concealed real-conditioning relations coverage likeness "
    "calibrate-unknown calibrate-reading ablate next-loop",
    "tools": "tuning regression speed scale",
}

MOVED = {
    **{name: f"{noun} {name}" for noun, names in _MOVED_WITH_THEIR_NAME.items() for name in names.split()},
    "paper": "paper replication",
    "export-model": "model export",
    "base": "model base-parameters",
    "prove": "proof run",
    "prove-setup": "proof run --tier setup",
    "prove-motion": "proof run --tier motion",
    "prove-changes": "proof run --tier changes",
    "prove-field": "proof run --tier field",
    "calibrate": "proof calibrate-names",
}  # an earlier name, and what to write now

_NOUNS: Mapping[str, tuple[str, Sections]] = {
    "recording": (
        "Import, export, check and fetch recordings of robot arms.",
        {
            "Commands": {
                "import": "armlab.cli.recording:import_",
                "check": "armlab.cli.recording:check",
                "export": "armlab.cli.recording:export",
                "fetch": "armlab.cli.recording:fetch",
                "example": "armlab.cli.recording:example",
                "gains": "armlab.cli.identification:gains",
            },
        },
    ),
    "model": (
        "Export models, lock joints, show what can be identified.",
        {
            "Commands": {
                "export": "armlab.cli.model:export_model",
                "lock-joints": "armlab.cli.model:lock_joints",
                "base-parameters": "armlab.cli.model:base_parameters",
                "confusability": "armlab.cli.model:confusability",
            },
        },
    ),
    "bench": (
        "List, compare, draw and share results; tune algorithms.",
        {
            "Results": {
                "list": "armlab.cli.bench:list_names",
                "compare": "armlab.cli.bench:compare",
                "duels": "armlab.cli.bench:duels",
                "draw": "armlab.cli.bench:draw",
                "share": "armlab.cli.bench:share",
                "merge": "armlab.cli.bench:merge",
                "salvage": "armlab.cli.bench:salvage",
            },
            "Algorithms": {
                "tune": "armlab.cli.bench:tune",
                "properties": "armlab.cli.bench:properties",
                "landscape": "armlab.cli.bench:landscape",
            },
            "Trajectories": {
                "best-known": "armlab.cli.bench:best_known",
                "published": "armlab.cli.bench:published",
                "submit": "armlab.cli.bench:submit",
                "export": "armlab.cli.bench:export",
            },
        },
    ),
    "paper": (
        "Make the tables and figures of the paper, and go beyond it.",
        {
            "The paper": {
                "table3": "armlab.cli.paper:table3",
                "figure2": "armlab.cli.paper:figure2",
                "figure3": "armlab.cli.paper:figure3",
                "replication": "armlab.cli.paper:replication",
            },
            "Beyond it": {
                "study": "armlab.cli.paper:study",
                "search-space": "armlab.cli.paper:search_space",
                "does-it-help": "armlab.cli.paper:does_it_help",
            },
        },
    ),
    "proof": (
        "Prove the diagnosis on hidden effects and on real arms.",
        {
            "Hidden effects": {
                "run": "armlab.cli.proof:prove",
                "oracle": "armlab.cli.concealed:oracle",
            },
            "Real arms": {
                "real": "armlab.cli.proof_real:real",
                "real-motion": "armlab.cli.proof_real:real_motion",
                "real-concealed": "armlab.cli.proof_real:real_concealed",
                "real-conditioning": "armlab.cli.proof_real:real_conditioning",
                "relations": "armlab.cli.proof_real:relations",
                "likeness": "armlab.cli.proof_learning:likeness",
            },
            "Development": {
                "calibrate-names": "armlab.cli.proof_learning:calibrate_names",
                "calibrate-unknown": "armlab.cli.proof_learning:calibrate_unknown",
                "calibrate-reading": "armlab.cli.proof_learning:calibrate_reading",
                "survival": "armlab.cli.proof_learning:survival",
                "ablate": "armlab.cli.proof_learning:ablate",
                "next-loop": "armlab.cli.proof_learning:next_loop",
                "coverage": "armlab.cli.proof_real:coverage",
            },
        },
    ),
    "tools": (
        "Check and measure armlab itself: tuning numbers, speed.",
        {
            "Commands": {
                "tuning": "armlab.cli.tools:tuning",
                "regression": "armlab.cli.tools:regression",
                "intervals": "armlab.cli.tools:intervals",
                "speed": "armlab.cli.tools:speed",
                "scale": "armlab.cli.tools:scale",
            },
        },
    ),
}

FIRST_SCREEN: Sections = {
    "Diagnosis and identification": {
        "diagnose": "armlab.cli.diagnosis:diagnose",
        "next": "armlab.cli.diagnosis:next_experiment",
        "identify": "armlab.cli.identification:identify",
        "predict": "armlab.cli.identification:predict",
        "payload": "armlab.cli.identification:payload",
    },
    "Comparison of algorithms": {
        "run": "armlab.cli.experiments:run",
        "report": "armlab.cli.experiments:report",
        "check": "armlab.cli.experiments:check",
    },
    "Concealed sets": {
        "conceal": "armlab.cli.concealed:conceal",
        "score": "armlab.cli.concealed:score",
    },
    "Installation": {
        "doctor": "armlab.cli.tools:doctor",
    },
    "More commands, by noun": dict.fromkeys(_NOUNS, ""),
}


class CommandTable(click.Group):
    """A group of commands that are imported when they are used, with a help in the order of their table."""

    def __init__(self, *args: Any, sections: Sections, **options: Any) -> None:
        super().__init__(*args, **options)
        self.sections = sections
        self.places = {name: place for names in sections.values() for name, place in names.items()}

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names of all commands, in the order of the table."""
        return list(self.places)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """The command of that name, imported now, with the name of the table."""
        if cmd_name not in self.places:
            return None
        if not self.places[cmd_name]:
            help_line, sections = _NOUNS[cmd_name]
            return Noun(cmd_name, sections=sections, help=help_line)
        module, function = self.places[cmd_name].split(":")
        command: click.Command = getattr(import_module(module), function)
        command.name = cmd_name
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the commands with their help lines, section by section."""
        width = max(map(len, self.places))
        for title, names in self.sections.items():
            commands = [(name.ljust(width), self.get_command(ctx, name)) for name in names]
            with formatter.section(title):
                formatter.write_dl([(name, each.get_short_help_str(_HELP_COLUMNS)) for name, each in commands if each])

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """The command that the words name; the refusal of an unknown one says which was probably meant."""
        try:
            return super().resolve_command(ctx, args)
        except click.UsageError as error:
            close = get_close_matches(args[0], self.known(), n=1)
            hint = f" Did you mean '{self.known()[close[0]]}'?" if close else ""
            raise click.UsageError(f"{error.message}{hint}", ctx) from None

    def known(self) -> dict[str, str]:
        """Words that could have been meant, each with what to write for it."""
        return {name: name for name in self.places}


class Noun(CommandTable):
    """The commands of a noun."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Read the words; InputError where the noun was a command itself and no command of it is given."""
        asks_for_help = {"-h", "--help"} & set(args)
        if self.name in MOVED and not asks_for_help and (not args or args[0].startswith("-")):
            raise InputError(moved_line(self.name))
        return super().parse_args(ctx, args)


def moved_line(name: str) -> str:
    """What to write in place of an earlier name."""
    return f"`armlab {name}` is now `armlab {MOVED[name]}`"


def nested_commands() -> dict[str, str]:
    """Names of the commands of all nouns, each with the noun before it."""
    return {
        name: f"{noun} {name}"
        for noun, (_, sections) in _NOUNS.items()
        for names in sections.values()
        for name in names
    }
