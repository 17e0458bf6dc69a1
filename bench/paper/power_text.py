"""What a table of duels can show at all, in a sentence."""

from bench.statistics.power import Power, powers


def power_text(repetitions: int, comparisons: int) -> str:
    """The chance of seeing true effects with that many paired repetitions, Holm over so many comparisons."""
    return f"Power with {repetitions} repetitions and Holm over {comparisons}: " + ", ".join(
        _seen(power) for power in powers(repetitions, comparisons)
    )


def _seen(power: Power) -> str:
    return f"a true A12 of {power.superiority:g} is seen with a chance of {power.first_step:.2f} to {power.alone:.2f}"
