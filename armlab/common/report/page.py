"""Pages from templates: every text is escaped, and one stylesheet serves all.

A template lies in the folder `templates` of the package that writes its page; it extends `page.html` of this one.
"""

import base64
import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from io import BytesIO
from typing import TYPE_CHECKING, Any

from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined, pass_context
from jinja2.runtime import Context
from markupsafe import Markup, escape

from armlab.common.report import palette
from armlab.common.report.glossary import Glossary, word_anchor

if TYPE_CHECKING:  # matplotlib is loaded by those who draw
    from matplotlib.figure import Figure


NUMBER_WITH_UNIT = re.compile(
    r"(?:\((?:−?[\d.]+, )+−?[\d.]+\)|\d) "  # a point, or the end of a number
    r"(?:N m s/rad|N m/rad|N s/m|N m|N|kg m²|kg m|kg|mrad|rad/s|rad|deg|mm|m/s|ms|m|s|Hz|A|V|W|%)(?![\w/])"
)


@dataclass(frozen=True)
class Table:
    """Cells as text. texts: columns that hold words, not numbers. stacked: on a phone each row is a small card."""

    headings: Sequence[str]
    rows: Sequence[Sequence[str]]
    texts: Sequence[int] = ()
    stacked: bool = False


def render_page(package: str, template: str, title: str, **content: Any) -> str:
    """The whole page, which asks nothing of the network; StrictUndefined raises for what a template lacks.

    package: whose `templates` hold it. content: what the template names.
    """
    page = _environment(package).get_template(template)
    return page.render(title=title, glossary=Glossary(), **content).rstrip() + "\n"


def render_part(package: str, template: str, **content: Any) -> Markup:
    """A part of a page, or of a notebook, without the page around it."""
    return Markup(_environment(package).get_template(template).render(glossary=Glossary(), **content).strip())


def png_address(figure: "Figure", dots_per_inch: int = 90) -> str:
    """A matplotlib figure as the address of an embedded picture."""
    buffer = BytesIO()
    figure.savefig(buffer, format="png", dpi=dots_per_inch)
    return "data:image/png;base64," + base64.b64encode(buffer.getvalue()).decode("ascii")


@cache
def _environment(package: str) -> Environment:
    loaders = [PackageLoader(name) for name in dict.fromkeys((package, "armlab.common.report"))]
    environment = Environment(
        autoescape=True,
        loader=ChoiceLoader(loaders),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=False,
    )
    environment.filters.update(prose=_prose, anchor=word_anchor, keep_units=keep_units)
    environment.globals.update(palette=palette)
    return environment


@pass_context
def _prose(context: Context, text: str) -> Markup:
    """Escaped text: what stands between backticks is code, and the first use of a word leads to its meaning."""
    parts = text.split("`")
    if len(parts) % 2 == 0:  # one without its partner
        parts = [text]
    glossary: Glossary = context["glossary"]
    shown = (
        Markup("<code>{}</code>").format(part) if number % 2 else _link_words(part, glossary)
        for number, part in enumerate(parts)
    )
    return Markup("").join(shown)


def keep_units(text: str) -> str:
    """The text, in which no line breaks between a number and its unit."""
    return NUMBER_WITH_UNIT.sub(lambda found: found[0].replace(" ", "\N{NO-BREAK SPACE}"), text)


def _link_words(text: str, glossary: Glossary) -> Markup:
    link = Markup('<a class="word" href="#{}" title="{}">{}</a>')
    pieces = glossary.split(keep_units(text))
    return Markup("").join(
        link.format(word_anchor(word), glossary.used[word], piece) if word else escape(piece) for piece, word in pieces
    )
