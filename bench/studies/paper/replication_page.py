"""The replication report as Markdown and as one HTML file: every claim with our result, ranking and figures."""

import base64
from collections.abc import Mapping, Sequence
from itertools import pairwise

import pandas as pd
from markdown_it import MarkdownIt
from markdown_it.token import Token
from markupsafe import Markup

from armlab.common.markdown import markdown_page, markdown_table
from armlab.common.report.page import render_page
from bench.printed import display_name
from bench.statistics.power import power_text
from bench.studies.paper.claims import PRINTED_TOLERANCE, VERDICTS, Claim, Evidence, Verdict
from bench.studies.paper.claims_comparison import comparison_claims, conclusion_claims
from bench.studies.paper.claims_identification import identification_claims, trajectory_claims, value_claims
from bench.studies.paper.claims_swarm_size import swarm_size_claims
from bench.studies.paper.ranking import READINGS, SUBJECT, Standing, count_duels, ranking_table
from bench.studies.paper.readings import readings_section
from bench.studies.paper.tuned import TunedEvidence, tuned_section


def markdown_to_html(title: str, text: str, images: Mapping[str, bytes]) -> str:
    """The page with its PNG images, by the names in the text, embedded in the file.

    Raises KeyError for a missing image.
    """
    parser = MarkdownIt("commonmark").enable("table")
    tokens = parser.parse(text)
    _stack_tables(tokens)
    for token in tokens:
        for child in token.children or ():
            if child.type == "image":
                name = str(child.attrs["src"])
                child.attrs["src"] = _data_uri(name, images[name])
    body = str(parser.renderer.render(tokens, parser.options, {}))
    body = body.replace("<table", '<div class="wide" tabindex="0"><table').replace("</table>", "</table></div>")
    return render_page("bench.studies.paper", "replication.html", title, body=Markup(body))


def _stack_tables(tokens: Sequence[Token]) -> None:
    """Marks tables as the stylesheet has them: on a phone each row is a card whose cells bear their headings."""
    headings: list[str] = []
    column = 0
    for token, content in pairwise(tokens):
        match token.type:
            case "table_open":
                token.attrSet("class", "stacked")
                headings = []
            case "tr_open":
                column = 0
            case "th_open":
                token.attrSet("class", "text")
                headings.append(content.content)
            case "td_open":
                token.attrSet("class", "text")
                token.attrSet("data-label", headings[column])
                column += 1


def _data_uri(name: str, image: bytes) -> str:
    kind = "svg+xml" if name.endswith(".svg") else "png"
    return f"data:image/{kind};base64,{base64.b64encode(image).decode()}"


CLAIM_SECTIONS = {
    "Arm, settings and the published trajectory": trajectory_claims,
    "Swarm size (Figure 2)": swarm_size_claims,
    "Six algorithms (Table 3, Figure 3)": comparison_claims,
    "What can be identified": identification_claims,
    "Identified values (Table 4)": value_claims,
    "Conclusion": conclusion_claims,
}
FIGURE_CAPTIONS = {
    "figure2.svg": "Figure 2: best cost against swarm size, 200 iterations whatever the size.",
    "figure2_times.png": "Figure 2: computing time against swarm size.",
    "figure2_equal_evaluations.svg": "Figure 2 once more, every swarm size with the same number of evaluations.",
    "table3.svg": "Table 3: every end of every run, with median and quartiles, algorithms as read here; the dashed "
    "line is the best known.",
    "ranking.svg": "The ranking: each algorithm, as read here, its rank under each choice with feasible ends, and its "
    "average.",
    "figure3.svg": "Figure 3: convergence, medians above, where an infeasible point counts as infinite, and the "
    "paper's averages below, which leave such points out; right, what the algorithm itself holds, which a mutation "
    "forgets.",
    "figure4.svg": "Figure 4: MuPSO's best trajectory of Table 3 in Cartesian space.",
    "figure5.svg": "Figure 5: the same trajectory in joint space.",
}
_VERDICT_RULES = f"""\
**Reproduced**: our number agrees with the printed one within {PRINTED_TOLERANCE:.0%}, or the statement holds for our
runs (for statements about the printed numbers themselves: it follows from them). **Not reproduced**: the statement does
not hold, or the printed number is outside of what any convention gives here. **Cannot be checked**: a datum is
missing, and which. Every number of ours was computed by `armlab paper replication`; those of the paper stand in
`bench/printed.yaml`. The default conventions, and which choices the paper leaves open, are in `docs/problem.md`."""
_RANKING_READING = """\
Each line is one choice of what the paper leaves open, and there the comparison of Table 3 anew: 30 paired
repetitions, 1,550 evaluations each. *Box*: narrow, default and wide have radii up to 0.1, 0.2 and 0.4 m and
coefficients up to 0.25, 0.5 and 1 m/s. *Columns*: SI units, or scaled to unit length. *Joint 1*: free, or within the
robot's range. MuPSO against each other algorithm: `+` better, `-` worse, `=` no difference (paired Wilcoxon on log10
of the condition number, an infeasible end counting as the worst, 5 % after Holm within the line); in brackets the
chance that MuPSO ends better (A12) and the corrected p-value. Gap: of MuPSO's median to the best known trajectory,
where one is on record (`results/best_known.json`). A dash as least median: half of the ends or more are infeasible
for every algorithm; at 2 s all are, since the circle alone then turns joint 1 at {circle:.0f} deg/s, above its
limit."""


def replication_page(evidence: Evidence, tuned: TunedEvidence) -> str:
    """The report as a Markdown page."""
    claims = {title: make(evidence) for title, make in CLAIM_SECTIONS.items()}
    parts = [_VERDICT_RULES, _verdict_table(claims), *_main_findings(evidence)]
    parts += readings_section(evidence, [claim for found in claims.values() for claim in found])
    for title, found in claims.items():
        parts += [f"## {title}", _claims_table(found)]
    parts += tuned_section(tuned, evidence.paper)
    parts += [
        "## The ranking under every choice that is left open",
        _RANKING_READING.format(circle=_circle_speed(2.0)),
        _power_sentence(evidence),
    ]
    for reading, ranking in evidence.rankings.items():
        parts += [f"### Algorithms: {READINGS[reading]}", _win_sentence(ranking), _frame_table(ranking_table(ranking))]
    parts += ["## Figures"]
    parts += [f"![{caption}]({name})\n\n*{caption}*" for name, caption in FIGURE_CAPTIONS.items()]
    return markdown_page("What of the paper could be reproduced", *parts)


def _verdict_table(claims: dict[str, list[Claim]]) -> str:
    rows = {**claims, "**all**": [claim for found in claims.values() for claim in found]}
    cells = [
        [title, *(_count_verdicts(found, verdict) for verdict in VERDICTS), len(found)] for title, found in rows.items()
    ]
    return markdown_table(["", *VERDICTS, "claims"], cells)


def _count_verdicts(claims: Sequence[Claim], verdict: Verdict) -> int:
    return sum(claim.verdict == verdict for claim in claims)


def _main_findings(evidence: Evidence) -> list[str]:
    """The main findings, a sentence each."""
    medians = evidence.column("table3", "median")
    rank = sorted(medians, key=medians.__getitem__).index(SUBJECT) + 1
    usable = [standing for standing in evidence.ranking if standing.usable]
    by_reading = "; ".join(
        "{} and {} of {} duels ({})".format(*count_duels(found), READINGS[reading])
        for reading, found in evidence.rankings.items()
    )
    base = evidence.best.problem.base
    mutating = sum(bool(life.mutations) for life in next(iter(evidence.mutation_histories.values())))
    repetitions = len(next(iter(evidence.mutation_histories.values())))
    cartesian = [reading for reading in evidence.published if reading.space == "Cartesian"]
    outside = sum(reading.overreach > 0 for reading in cartesian)
    lines = [
        f"MuPSO has rank {rank} of {len(medians)} by median under the default conventions. Over {len(usable)} "
        f"conventions it is significantly better and worse in {by_reading}.",
        f"It mutates in {mutating} of {repetitions} runs.",
        f"Three joint torques of this arm determine {len(base)} base parameters, {len(base.alone)} of them single "
        "parameters: the paper's 20 + 2 + 8 cannot come from them. Literal readings of its equations that give "
        "its counts, "
        "and one that gives its list, are below.",
        f"The published coefficients leave the arm's reach under {outside} of {len(cartesian)} readings of eq. 45-48.",
    ]
    return ["## In short", "\n".join(f"- {line}" for line in lines)]


def _claims_table(claims: Sequence[Claim]) -> str:
    rows = [[claim.place, claim.says, claim.ours, _verdict_cell(claim), claim.why] for claim in claims]
    return markdown_table(["where", "the paper says", "we get", "verdict", "why"], rows)


def _verdict_cell(claim: Claim) -> str:
    return f"**{claim.verdict}**" + (f" (with our readings alone: {claim.alone})" if claim.alone else "")


def _power_sentence(evidence: Evidence) -> str:
    repetitions = evidence.frames["ranking"]["repetition"].nunique()
    return power_text(repetitions, len(evidence.ranking[0].duels)) + "."


def _circle_speed(duration: float) -> float:
    """Largest speed of joint 1 on the circle of eq. 45-46 alone, deg/s: the quintic's steepest slope is 15 / 8."""
    return 15 / 8 * 360 / duration


def _win_sentence(ranking: Sequence[Standing]) -> str:
    winners = [display_name(standing.best) for standing in ranking if standing.best]
    counts = pd.Series(winners).value_counts()
    return "Least median, number of choices: " + ", ".join(f"{name} {count}" for name, count in counts.items()) + "."


def _frame_table(table: pd.DataFrame) -> str:
    return markdown_table(list(table.columns), table.to_numpy().tolist())
