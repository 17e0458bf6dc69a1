"""Commands that show what there is: algorithms, problems, an arm's base parameters."""

import click


@click.command("list")
def list_names() -> None:
    """The algorithms, problems and arms that a configuration can name."""
    from algorithms import registry as algorithms
    from problem import registry as problems
    from problem.robot_file import built_in_arms
    from problem.suite import instances, suites

    click.echo("algorithms: " + ", ".join(algorithms.names()))
    click.echo("peers (extra `peers`): " + ", ".join(algorithms.peer_names()))
    click.echo("problems: " + ", ".join(problems.names()))
    for suite in suites():
        click.echo(f"suite {suite}: {len(instances(suite))} problems, {instances(suite)[0]} the first")
    click.echo("arms: " + ", ".join(built_in_arms()))


@click.command()
@click.argument("robot")
@click.option("--columns", type=click.Choice(["later_columns", "earlier_columns"]), default="later_columns")
def base(robot: str, columns: str) -> None:
    """The base parameters of ROBOT: a built-in arm, a robot file or a URDF."""
    from problem.base_parameters import base_parameters
    from problem.robot_file import load_arm

    found = base_parameters(load_arm(robot), columns)
    click.echo(f"{len(found)} base parameters:\n  " + "\n  ".join(found.sums))
    click.echo(f"{len(found.alone)} identifiable alone: " + " ".join(found.alone))
    click.echo(f"{len(found.grouped)} only in sums: " + " ".join(found.grouped))
    click.echo(f"{len(found.unidentifiable)} without effect: " + " ".join(found.unidentifiable))


@click.command()
@click.argument("algorithm")
def check(algorithm: str) -> None:
    """Test whether an algorithm keeps the promises of its contract."""
    from algorithms.check import BrokenPromiseError, check_algorithm
    from bench.lookup import find_algorithm

    try:
        check_algorithm(find_algorithm(algorithm, "check"))
    except BrokenPromiseError as error:
        raise click.ClickException(str(error)) from None
    click.echo(f"{algorithm} keeps its promises")
