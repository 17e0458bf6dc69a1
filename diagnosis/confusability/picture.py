"""Heat maps of the card: how much of each effect another one can imitate, joint by joint."""

import numpy as np

from diagnosis.confusability.card import ALIKE, Card
from diagnosis.report.svg import PALE, picture, shortened, tag, words

CELL, SIZE, NAMES, TOP = 12.0, 10.0, 208.0, 44.0
DARK = (8, 48, 107)
MARK = "#c44e00"


def heat_map(card: Card, view: str, joint: int) -> str:
    """Effects of one joint (from 1) and of the whole robot, each against the others."""
    chosen = [index for index, each in enumerate(card.entries) if each.joint in (joint, None)]
    count = len(chosen)
    width, height = NAMES + CELL * count + 8, TOP + CELL * count + 34
    out = words(f"Joint {joint}, {view}: can the column's effect imitate the row's?", 6, 14, 12, font_weight="600")
    for place, index in enumerate(chosen):
        middle = CELL * (place + 0.5)
        label = shortened(f"{place + 1}  {card.entries[index].label}", NAMES - 8, SIZE)
        out += words(label, NAMES - 5, TOP + middle + 3.5, SIZE, "end")
        out += words(str(place + 1), NAMES + middle, TOP - 5, 7.5, "middle", fill=PALE)
    cosines = card.cosines[view][np.ix_(chosen, chosen)]
    out += "".join(_cell(row, column, float(cosines[row, column])) for row in range(count) for column in range(count))
    about = f"Cosines between the effects of joint {joint} of {card.arm.name} in the view {view}"
    return picture(out + _scale(TOP + CELL * count + 8), width, height, about)


def _cell(row: int, column: int, cosine: float) -> str:
    x, y = NAMES + CELL * column, TOP + CELL * row
    if row == column:
        return tag("rect", x=x, y=y, width=CELL - 1, height=CELL - 1, fill="#e9ecef")
    out = tag("rect", x=x, y=y, width=CELL - 1, height=CELL - 1, fill=_color(cosine))
    if cosine >= ALIKE:
        out += tag("circle", cx=x + (CELL - 1) / 2, cy=y + (CELL - 1) / 2, r=3, fill=MARK, stroke="#fff")
    return out


def _color(cosine: float) -> str:
    share = max(cosine, 0.0) ** 2
    red, green, blue = (round(255 - share * (255 - dark)) for dark in DARK)
    return f"rgb({red},{green},{blue})"


def _scale(y: float) -> str:
    out = words("cosine", 6, y + 11, 10.5)
    for number, cosine in enumerate((0.0, 0.5, 0.7, 0.8, 0.9, 1.0)):
        x = 52 + 42 * number
        out += tag("rect", x=x, y=y, width=14, height=14, fill=_color(cosine), stroke="#c4cad1", stroke_width=0.5)
        out += words(f"{cosine:g}", x + 17, y + 11, 10)
    x = 52 + 42 * 6
    return out + tag("circle", cx=x + 6, cy=y + 7, r=3.5, fill=MARK) + words("cannot be told", x + 14, y + 11, 10)
