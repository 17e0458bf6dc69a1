"""The command line `armlab`: which command stands where, and how an error reaches the user.

Only click is imported until a command runs, so that `armlab --help` answers at once.
"""

import os
from importlib import import_module
from typing import Any

import click

from bench.errors import StoppedError, TrialsFailedError
from problem.errors import InputError

_ONE_THREAD = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
_COMMANDS = {
    "run": "bench.commands.experiments:run",
    "table3": "bench.commands.experiments:table3",
    "figure2": "bench.commands.experiments:figure2",
    "figure3": "bench.commands.experiments:figure3",
    "paper": "bench.commands.experiments:paper",
    "study": "bench.commands.experiments:study",
    "list": "bench.commands.names:list_names",
    "base": "bench.commands.names:base",
    "check": "bench.commands.names:check",
    "report": "bench.commands.results:report",
    "compare": "bench.commands.results:compare",
    "share": "bench.commands.results:share",
    "salvage": "bench.commands.results:salvage",
    "properties": "bench.commands.properties:properties",
    "best-known": "bench.commands.trajectories:best_known",
    "export": "bench.commands.trajectories:export",
    "does-it-help": "bench.commands.trajectories:does_it_help",
    "recording": "recordings.cli:recording",
    "identify": "identification.cli:identify",
    "predict": "identification.cli:predict",
    "payload": "identification.cli:payload",
    "gains": "identification.cli:gains",
    "export-model": "diagnosis.cli:export_model",
    "real": "diagnosis.cli:real",
    "real-concealed": "diagnosis.cli:real_concealed",
    "coverage": "identification.cli:coverage",
    "diagnose": "diagnosis.cli:diagnose",
    "confusability": "diagnosis.cli:confusability",
    "conceal": "concealed.cli:conceal",
    "next": "bench.commands.next:next_experiment",
    "next-loop": "bench.commands.next_loop:next_loop",
    "score": "concealed.cli:score",
    "prove": "concealed.cli:prove",
    "ablate": "bench.commands.ablation:ablate",
    "speed": "bench.commands.speed:speed",
    "scale": "bench.commands.scale:scale",
    "regression": "bench.commands.regression:regression",
}


class _Armlab(click.Group):
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

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command with one BLAS thread; exit codes: 2 bad input, 130 stopped, 1 failed trials."""
        os.environ.update(dict.fromkeys(_ONE_THREAD, "1"))  # read when numpy is imported, which comes later
        try:
            return super().invoke(ctx)
        except InputError as error:
            click.echo(f"armlab: {error}", err=True)
            ctx.exit(2)
        except StoppedError as error:
            click.echo(f"armlab: {error}", err=True)
            ctx.exit(130)  # what a shell reports for Ctrl-C
        except TrialsFailedError as error:
            click.echo(f"armlab: {error}", err=True)
            ctx.exit(1)


@click.group(cls=_Armlab, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="armlab")
def main() -> None:
    """Excitation trajectories, identification and diagnosis of robot arms."""


if __name__ == "__main__":
    main()
