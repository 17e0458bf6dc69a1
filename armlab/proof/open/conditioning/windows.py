"""Windows of a run: every choice of some of its blocks, and how blocks are permuted and left out.

The rows of a run are cut into BLOCKS blocks of consecutive samples. A window is a set of blocks, so that all windows of
one share are equally long, and there are hundreds of them in a run of seconds. Windows that have blocks in common are
correlated, therefore no statistic counts windows as observations: p-values exchange whole blocks, and intervals leave
out whole blocks.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from math import comb

import numpy as np
from numpy.typing import NDArray

BLOCKS = 12


@dataclass(frozen=True)
class RunWindows:
    """All windows of `chosen` out of `blocks` blocks, in lexical order."""

    chosen: int
    blocks: int = BLOCKS

    def __len__(self) -> int:
        """How many windows there are."""
        return comb(self.blocks, self.chosen)

    @cached_property
    def members(self) -> NDArray[np.intp]:
        """Blocks of each window, (windows, chosen), ascending."""
        return np.array(list(combinations(range(self.blocks), self.chosen)), dtype=np.intp)

    def permuted(self, order: NDArray[np.intp]) -> NDArray[np.intp]:
        """For each window the number of the window whose blocks `order` (blocks,) puts in place of its own."""
        return np.asarray(self._numbers[(1 << order[self.members]).sum(axis=1)])

    def without(self, block: int) -> NDArray[np.intp]:
        """Numbers of the windows that do not have a block."""
        return np.flatnonzero((self.members != block).all(axis=1))

    @cached_property
    def _numbers(self) -> NDArray[np.intp]:
        """The number of each window at the sum of 2^block over its blocks."""
        numbers = np.zeros(1 << self.blocks, dtype=np.intp)
        numbers[(1 << self.members).sum(axis=1)] = np.arange(len(self))
        return numbers


def block_rows(samples: int, joints: int, blocks: int = BLOCKS) -> list[NDArray[np.intp]]:
    """Rows (rows,) of each block in a regression whose rows have the joints of a sample side by side.

    Blocks are equally long; samples that are left over at the end belong to none. Raises ValueError for fewer samples
    than blocks.
    """
    length = samples // blocks
    if length == 0:
        raise ValueError(f"{samples} samples cannot be cut into {blocks} blocks")
    return [np.arange(block * length * joints, (block + 1) * length * joints) for block in range(blocks)]
