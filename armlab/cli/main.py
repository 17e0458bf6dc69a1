"""The command line `armlab`: how an error reaches the user.

Only click is imported until a command runs, so that `armlab --help` answers at once.
"""

import errno
import os
import warnings
from collections.abc import Callable
from functools import partial
from typing import Any

import click

from armlab.cli.commands import FIRST_SCREEN, MOVED, CommandTable, moved_line, nested_commands
from armlab.cli.output import json_option, quiet_option
from armlab.common.documents import FailedResultError
from armlab.common.errors import DataError, InputError, PlugInWarning, in_one_line
from bench.errors import StoppedError, TrialsFailedError

_THREAD_VARIABLES = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
_SHOWN_CHARACTERS = 40  # of a name that is too long
_FLAGS = {"--json": "as_json", "--quiet": "quiet"}  # that may stand before the command, with their names in click


class _FirstScreen(CommandTable):
    """The commands of the first screen; turns errors that a person can act on into one line and an exit code."""

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """The command that the words name, told the options that stand before it.

        Raises InputError for an earlier name.
        """
        if args[0] in MOVED and args[0] not in self.places:
            raise InputError(moved_line(args[0]))
        name, command, rest = super().resolve_command(ctx, args)
        place = 1 if isinstance(command, click.Group) and rest and not rest[0].startswith("-") else 0
        given = [flag for flag, parameter in _FLAGS.items() if ctx.params.get(parameter)]
        return name, command, [*rest[:place], *given, *rest[place:]]

    def known(self) -> dict[str, str]:
        """Words that could have been meant, each with what to write for it."""
        return nested_commands() | super().known()

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command with one BLAS thread; exit codes: 2 bad input, 130 stopped, 1 failed trials or plug-in."""
        os.environ.update(dict.fromkeys(_THREAD_VARIABLES, "1"))  # read when numpy is imported, which comes later
        try:
            with warnings.catch_warnings():
                warnings.showwarning = partial(_show_warning, warnings.showwarning)
                return super().invoke(ctx)
        except (click.exceptions.Exit, click.ClickException):
            raise
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
            from armlab.common.packages import missing_package
            from armlab.common.plug_ins import plug_in_at_fault

            missing = missing_package(error, "this command")
            if missing is not None:
                click.echo(f"armlab: {missing}", err=True)
                ctx.exit(2)
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


@click.group(cls=_FirstScreen, sections=FIRST_SCREEN, context_settings={"help_option_names": ["-h", "--help"]})
@json_option
@quiet_option
@click.version_option(package_name="armlab")
def main(**_flags: bool) -> None:
    """Excitation trajectories, identification and diagnosis of robot arms."""


if __name__ == "__main__":
    main()
