"""What all generated pages share."""

from collections.abc import Iterable

Pages = dict[str, str | bytes]


def toctree(entries: Iterable[str], hidden: bool = False) -> str:
    """The directive that puts pages into the navigation."""
    options = ":hidden:\n" if hidden else ":maxdepth: 1\n"
    return "```{toctree}\n" + options + "\n" + "\n".join(entries) + "\n```"
