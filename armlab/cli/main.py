"""The command line `armlab`: the table of commands, and how an error reaches the user.

Only click is imported until a command runs, so that `armlab --help` answers at once.
"""

import os
from importlib import import_module
from typing import Any

import click

from armlab.common.errors import DataError, InputError
from bench.errors import StoppedError, TrialsFailedError

_THREAD_VARIABLES = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
_COMMANDS = {
    "run": "armlab.cli.harness:run",
    "table3": "armlab.cli.harness:table3",
    "figure2": "armlab.cli.harness:figure2",
    "figure3": "armlab.cli.harness:figure3",
    "paper": "armlab.cli.harness:paper",
    "study": "armlab.cli.harness:study",
    "list": "armlab.cli.harness:list_names",
    "base": "armlab.cli.harness:base",
    "check": "armlab.cli.harness:check",
    "report": "armlab.cli.harness:report",
    "compare": "armlab.cli.harness:compare",
    "share": "armlab.cli.harness:share",
    "draw": "armlab.cli.harness:draw",
    "salvage": "armlab.cli.harness:salvage",
    "properties": "armlab.cli.harness:properties",
    "best-known": "armlab.cli.harness:best_known",
    "export": "armlab.cli.harness:export",
    "tune": "armlab.cli.harness:tune",
    "does-it-help": "armlab.cli.harness:does_it_help",
    "recording": "armlab.cli.recordings:recording",
    "identify": "armlab.cli.identification:identify",
    "predict": "armlab.cli.identification:predict",
    "payload": "armlab.cli.identification:payload",
    "gains": "armlab.cli.identification:gains",
    "export-model": "armlab.cli.diagnosis:export_model",
    "real": "armlab.cli.diagnosis:real",
    "real-motion": "armlab.cli.diagnosis:real_motion",
    "real-concealed": "armlab.cli.diagnosis:real_concealed",
    "coverage": "armlab.cli.identification:coverage",
    "diagnose": "armlab.cli.diagnosis:diagnose",
    "relations": "armlab.cli.diagnosis:relations",
    "tuning": "armlab.cli.diagnosis:tuning",
    "confusability": "armlab.cli.diagnosis:confusability",
    "conceal": "armlab.cli.proof:conceal",
    "next": "armlab.cli.diagnosis:next_experiment",
    "next-loop": "armlab.cli.proof:next_loop",
    "score": "armlab.cli.proof:score",
    "prove": "armlab.cli.proof:prove",
    "prove-setup": "armlab.cli.proof:prove_setup",
    "prove-changes": "armlab.cli.proof:prove_changes",
    "ablate": "armlab.cli.proof:ablate",
    "speed": "armlab.cli.maintenance:speed",
    "scale": "armlab.cli.maintenance:scale",
    "regression": "armlab.cli.maintenance:regression",
}


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

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command with one BLAS thread; exit codes: 2 bad input, 130 stopped, 1 failed trials."""
        os.environ.update(dict.fromkeys(_THREAD_VARIABLES, "1"))  # read when numpy is imported, which comes later
        try:
            return super().invoke(ctx)
        except (InputError, DataError) as error:
            click.echo(f"armlab: {error}", err=True)
            ctx.exit(2)
        except StoppedError as error:
            click.echo(f"armlab: {error}", err=True)
            ctx.exit(130)  # what a shell reports for Ctrl-C
        except TrialsFailedError as error:
            click.echo(f"armlab: {error}", err=True)
            ctx.exit(1)


@click.group(cls=_CommandGroup, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="armlab")
def main() -> None:
    """Excitation trajectories, identification and diagnosis of robot arms."""


if __name__ == "__main__":
    main()
