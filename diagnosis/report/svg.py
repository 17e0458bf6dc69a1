"""SVG as text: elements with escaped attributes and words, complete in themselves, so that a picture is a file too."""

from html import escape

FONT = "system-ui, 'Segoe UI', 'DejaVu Sans', sans-serif"
INK, PALE, LINE = "#1b1f24", "#5b6570", "#d5dae0"
LETTER = 0.56  # width of a letter over its size, about


def tag(name: str, /, inside: str = "", **attributes: str | float) -> str:
    """An element; `_` in an attribute's name stands for `-`, numbers have two decimals."""
    given = "".join(f' {key.replace("_", "-")}="{_value(value)}"' for key, value in attributes.items())
    return f"<{name}{given}>{inside}</{name}>" if inside else f"<{name}{given}/>"


def words(text: str, x: float, y: float, size: float = 11.0, anchor: str = "start", **attributes: str | float) -> str:
    """Text at a place, its baseline at y."""
    chosen: dict[str, str | float] = {"fill": INK, "font_size": size, "text_anchor": anchor, **attributes}
    return tag("text", escape(text), x=x, y=y, **chosen)


def picture(content: str, width: float, height: float, title: str) -> str:
    """A whole picture that scales with the page; title: what it shows, for those who do not see it."""
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:g} {height:g}" role="img" '
        f'aria-label="{escape(title)}" font-family="{FONT}"><title>{escape(title)}</title>'
        f"{content}</svg>"
    )


def shortened(text: str, width: float, size: float = 11.0) -> str:
    """A text that fits into a width, its end left out where it does not."""
    letters = max(int(width / (LETTER * size)), 4)
    return text if len(text) <= letters else text[: letters - 1].rstrip() + "…"


def text_width(text: str, size: float = 11.0) -> float:
    """How wide a text is, about."""
    return LETTER * size * len(text)


def _value(value: str | float) -> str:
    if isinstance(value, str):
        return escape(value)
    return f"{value:.2f}".rstrip("0").rstrip(".") or "0"
