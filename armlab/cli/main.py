"""The command line `armlab`: the table of commands, and how an error reaches the user.

Only click is imported until a command runs, so that `armlab --help` answers at once.
"""

import errno
import os
import warnings
from collections.abc import Callable
from difflib import get_close_matches
from functools import partial
from importlib import import_module
from typing import Any

import click

from armlab.cli.output import json_option, quiet_option
from armlab.common.documents import FailedResultError
from armlab.common.errors import DataError, InputError, PlugInWarning, in_one_line
from bench.errors import StoppedError, TrialsFailedError

_THREAD_VARIABLES = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
_SHOWN_CHARACTERS = 40  # of a name that is too long
_FLAGS = {"--json": "as_json", "--quiet": "quiet"}  # that may stand before the command, with their names in click
_GROUPS = {
    "Recordings": {
        "recording": "armlab.cli.recordings:recording",
    },
    "Diagnosis": {
        "diagnose": "armlab.cli.diagnosis:diagnose",
        "next": "armlab.cli.diagnosis:next_experiment",
        "confusability": "armlab.cli.diagnosis:confusability",
        "tuning": "armlab.cli.diagnosis:tuning",
    },
    "Identification": {
        "identify": "armlab.cli.identification:identify",
        "predict": "armlab.cli.identification:predict",
        "payload": "armlab.cli.identification:payload",
        "gains": "armlab.cli.identification:gains",
        "export-model": "armlab.cli.diagnosis:export_model",
        "lock-joints": "armlab.cli.identification:lock_joints",
        "base": "armlab.cli.harness:base",
    },
    "Harness": {
        "run": "armlab.cli.harness:run",
        "list": "armlab.cli.harness:list_names",
        "check": "armlab.cli.harness:check",
        "report": "armlab.cli.harness:report",
        "compare": "armlab.cli.harness:compare",
        "share": "armlab.cli.harness:share",
        "draw": "armlab.cli.harness:draw",
        "duels": "armlab.cli.harness:duels",
        "properties": "armlab.cli.harness:properties",
        "tune": "armlab.cli.harness:tune",
        "best-known": "armlab.cli.harness:best_known",
        "published": "armlab.cli.harness:published",
        "export": "armlab.cli.harness:export",
        "table3": "armlab.cli.harness:table3",
        "figure2": "armlab.cli.harness:figure2",
        "figure3": "armlab.cli.harness:figure3",
        "paper": "armlab.cli.harness:paper",
        "study": "armlab.cli.harness:study",
        "search-space": "armlab.cli.harness:search_space",
        "landscape": "armlab.cli.harness:landscape",
        "does-it-help": "armlab.cli.harness:does_it_help",
    },
    "Proof": {
        "prove": "armlab.cli.proof:prove",
        "prove-setup": "armlab.cli.proof:prove_setup",
        "prove-motion": "armlab.cli.proof:prove_motion",
        "prove-changes": "armlab.cli.proof:prove_changes",
        "conceal": "armlab.cli.proof:conceal",
        "score": "armlab.cli.proof:score",
        "calibrate": "armlab.cli.proof:calibrate_names",
        "calibrate-unknown": "armlab.cli.proof:calibrate_unknown",
        "calibrate-reading": "armlab.cli.proof:calibrate_reading",
        "oracle": "armlab.cli.proof:oracle",
        "next-loop": "armlab.cli.proof:next_loop",
        "ablate": "armlab.cli.proof:ablate",
        "prove-field": "armlab.cli.proof:prove_field",
        "likeness": "armlab.cli.likeness:likeness",
        "real": "armlab.cli.diagnosis:real",
        "real-motion": "armlab.cli.diagnosis:real_motion",
        "real-concealed": "armlab.cli.diagnosis:real_concealed",
        "real-conditioning": "armlab.cli.identification:real_conditioning",
        "relations": "armlab.cli.diagnosis:relations",
        "coverage": "armlab.cli.identification:coverage",
    },
    "Maintenance": {
        "doctor": "armlab.cli.maintenance:doctor",
        "salvage": "armlab.cli.harness:salvage",
        "merge": "armlab.cli.harness:merge",
        "intervals": "armlab.cli.maintenance:intervals",
        "speed": "armlab.cli.maintenance:speed",
        "scale": "armlab.cli.maintenance:scale",
        "regression": "armlab.cli.maintenance:regression",
    },
}
_COMMANDS = {name: place for commands in _GROUPS.values() for name, place in commands.items()}


class _CommandGroup(click.Group):
    """The group of commands; turns errors that a person can act on into one line and an exit code."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names of all commands, in the order of the table above."""
        return list(_COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """The command of that name, imported now."""
        if cmd_name not in _COMMANDS:
            return None
        module, name = _COMMANDS[cmd_name].split(":")
        command: click.Command = getattr(import_module(module), name)
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """The command that the words name, told the options that stand before it.

        The refusal of an unknown command says which was probably meant.
        """
        try:
            name, command, rest = super().resolve_command(ctx, args)
        except click.UsageError as error:
            group = self.get_command(ctx, "recording")
            inside = {name: f"recording {name}" for name in group.commands} if isinstance(group, click.Group) else {}
            close = [inside.get(each, each) for each in get_close_matches(args[0], [*inside, *_COMMANDS], n=1)]
            hint = f" Did you mean '{close[0]}'?" if close else ""
            raise click.UsageError(f"{error.message}{hint}", ctx) from None
        place = 1 if isinstance(command, click.Group) and rest and not rest[0].startswith("-") else 0
        given = [flag for flag, parameter in _FLAGS.items() if ctx.params.get(parameter)]
        return name, command, [*rest[:place], *given, *rest[place:]]

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the commands with their help lines, group by group."""
        width = max(map(len, _COMMANDS))
        for title, names in _GROUPS.items():
            commands = [(name.ljust(width), self.get_command(ctx, name)) for name in names]
            with formatter.section(title):
                formatter.write_dl([(name, each.get_short_help_str(80)) for name, each in commands if each])

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command with one BLAS thread; exit codes: 2 bad input, 130 stopped, 1 failed trials or plug-in."""
        os.environ.update(dict.fromkeys(_THREAD_VARIABLES, "1"))  # read when numpy is imported, which comes later
        try:
            with warnings.catch_warnings():
                warnings.showwarning = partial(_show_warning, warnings.showwarning)
                return super().invoke(ctx)
        except (InputError, DataError) as error:
            text = in_one_line(error)  # a name out of a file may have lines of its own
            click.echo(f"armlab: {text}", err=True)
            ctx.exit(2)
        except StoppedError as error:
            click.echo(f"armlab: {error}", err=True)
            ctx.exit(130)  # what a shell reports for Ctrl-C
        except KeyboardInterrupt:
            click.echo("armlab: stopped", err=True)
            ctx.exit(130)
        except TrialsFailedError as error:
            click.echo(f"armlab: {error}", err=True)
            ctx.exit(1)
        except FailedResultError as error:
            click.echo(f"armlab: {error}", err=True)
            ctx.exit(error.status)
        except OSError as error:
            if error.errno != errno.ENAMETOOLONG:  # a name that no file can have is the user's, all else is a bug
                raise
            click.echo(f"armlab: {str(error.filename)[:_SHOWN_CHARACTERS]}...: {error.strerror}", err=True)
            ctx.exit(2)
        except (Exception, SystemExit) as error:
            from armlab.common.plug_ins import plug_in_at_fault

            line = plug_in_at_fault(error)
            if line is None:
                raise
            click.echo(f"armlab: {line}", err=True)
            ctx.exit(1)


def _show_warning(usual: Callable[..., None], message: Warning, category: type[Warning], *place: Any) -> None:
    """A plug-in that is left out in one line; any other warning as usual."""
    if issubclass(category, PlugInWarning):
        click.echo(f"armlab: {message}", err=True)
    else:
        usual(message, category, *place)


@click.group(cls=_CommandGroup, context_settings={"help_option_names": ["-h", "--help"]})
@json_option
@quiet_option
@click.version_option(package_name="armlab")
def main(**_flags: bool) -> None:
    """Excitation trajectories, identification and diagnosis of robot arms."""


if __name__ == "__main__":
    main()
