"""What a verdict may tell, by its contract."""

from typing import Final

MIN_NAME_PROBABILITY: Final = 0.9  # of a name that is stated, and of all names of a class together
MIN_CAUSE_PROBABILITY: Final = 0.5  # of a cause that is stated without its law; with less nothing is stated
MAX_CLASS_NAMES: Final = 3
