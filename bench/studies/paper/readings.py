"""The section of the replication report on the readings of the algorithms: what depends on them."""

from collections.abc import Sequence

from armlab.common.markdown import markdown_table
from bench.printed import display_name
from bench.studies.paper.claims import Claim, Evidence
from bench.studies.paper.ranking import READINGS, SUBJECT, TWO_PROGRAMS, Standing, count_duels

_TEXT = """\
The paper compares with programs that it does not name. Where a source's text, its authors' released program and the
algorithm here differ, each is a reading (`reading` in the parameters; the docstring of each algorithm says what its
readings are). First populations, budget and conventions are the same under all of them. The claims below stand under
every reading that bears on them; a number of Table 3 is outside of what we get only if no convention and no reading
gives it."""


def readings_section(evidence: Evidence, claims: Sequence[Claim]) -> list[str]:
    """Duels and default averages by reading, and the verdicts that the readings change."""
    names = list(evidence.default_standing(evidence.ranking).averages)
    two = f"the authors' programs of {' and '.join(map(display_name, TWO_PROGRAMS))} alone"
    headings = ["algorithms", "MuPSO better", "worse", "no difference", "least median", "rank by average"]
    rows = [_reading_row(READINGS[reading], found, evidence) for reading, found in evidence.rankings.items()]
    rows += [_reading_row(two, evidence.two_programs, evidence)]
    averages = [_average_row(reading, evidence, names) for reading in evidence.rankings]
    changed = [claim for claim in claims if claim.alone]
    parts = ["## Three readings of the algorithms", _TEXT, markdown_table(headings, rows)]
    parts += [_near_sentence(two, evidence.two_programs)]
    parts += ["Average and standard deviation under the default conventions, and as printed:"]
    parts += [markdown_table(["algorithms", *map(display_name, names)], [*averages, _printed_row(evidence, names)])]
    parts += [f"Verdicts that the readings change: {len(changed)}."]
    if changed:
        cells = [[claim.says, str(claim.alone), claim.verdict] for claim in changed]
        parts += [markdown_table(["the paper says", "with our readings alone", "with all readings"], cells)]
    return parts


_NEAR = (0.025, 0.1)


def _near_sentence(text: str, found: list[Standing]) -> str:
    """How many duels lie so near 5 % that other random numbers decide them otherwise."""
    fought = [duel for standing in found if standing.usable for duel in standing.duels]
    near = sum(_NEAR[0] < duel.p < _NEAR[1] for duel in fought)
    low, high = (f"{100 * p:g}" for p in _NEAR)
    return (
        f"The last line takes {text}; all others are as here. In {near} of its {len(fought)} duels p lies between "
        f"{low} and {high} %: another implementation of the same programs, which draws its random numbers in another "
        "order, moves some of them across 5 %, and with them the counts by one or two."
    )


def _reading_row(text: str, found: list[Standing], evidence: Evidence) -> list[object]:
    better, worse, pairs = count_duels(found)
    usable = [standing for standing in found if standing.usable]
    least = sum(standing.best == SUBJECT for standing in usable)
    averages = evidence.default_standing(found).averages
    rank = sorted(averages, key=averages.__getitem__).index(SUBJECT) + 1
    undecided = pairs - better - worse
    return [text, better, worse, undecided, f"{least} of {len(usable)}", f"{rank} of {len(averages)}"]


def _average_row(reading: str, evidence: Evidence, names: Sequence[str]) -> list[str]:
    standing = evidence.default_standing(evidence.rankings[reading])
    return [READINGS[reading], *(f"{standing.averages[name]:.3g} ± {standing.deviations[name]:.3g}" for name in names)]


def _printed_row(evidence: Evidence, names: Sequence[str]) -> list[str]:
    rows = evidence.paper.table3.rows
    return ["as printed", *(f"{rows[name].average:g} ± {rows[name].standard_deviation:g}" for name in names)]
