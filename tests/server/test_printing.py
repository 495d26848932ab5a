"""What is printed of a comparison: LaTeX that compiles, Markdown that stays a table, a report without a script."""

import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient
from httpx import Response

from server.printing.axes import STEPS, elapsed, ticks
from server.printing.names import metric_words, setting_words
from server.printing.palette import DARK, DASHES, LIGHT, Look, color_of, looks_of
from server.printing.svg import Line, line_chart
from server.printing.tables import PrintedTable
from server.printing.text import comma_separated, latex, markdown
from tests.server.harness import Reports
from tests.server.test_comparison import measured

HOSTILE = r"50% & more_<b>x</b> {y}$ | \end{document} #1 ^~"


def printed(client: TestClient, path: str, *experiments: dict[str, Any], **query: str) -> Response:
    params: dict[str, Any] = {"experiment": [experiment["id"] for experiment in experiments]}
    response: Response = client.get(f"/api/compare/{path}", params=params | query)
    assert response.status_code == 200, response.text
    return response


@pytest.fixture
def pair(reports: Reports) -> tuple[dict[str, Any], dict[str, Any]]:
    base = measured(reports, "base", (800, 820, 790, 850, 810), steps=100)
    return base, measured(reports, HOSTILE, (990, 980, 970, 990, 980), steps=80)


def test_the_verdicts_as_latex(client: TestClient, pair: tuple[dict[str, Any], dict[str, Any]]) -> None:
    response = printed(client, "table", *pair)
    text = response.text
    assert response.headers["content-disposition"] == 'attachment; filename="mapless-verdicts.tex"'
    for part in (
        r"\usepackage{booktabs}",
        r"\begin{tabular}{lllrrrlrr}",
        r"\toprule",
        r"\midrule",
        r"\bottomrule",
        "tab:verdicts",
    ):
        assert part in text
    rows = [line for line in text.splitlines() if line.endswith(r"\\")]
    assert len(rows) == 3
    assert all(len(re.findall(r"(?<!\\)&", row)) == 8 for row in rows)
    assert r"50\% \& more\_$<$b$>$x$<$/b$>$ \{y\}\$ | \textbackslash{}end\{document\} \#1" in rows[1]
    assert re.search(r"& Success & 5, 5 & \+16\.8 \[\+\d+\.\d, \+\d+\.\d\] & \$?<?\$? ?0\.\d+ & better &", rows[1])
    # Signs are minus signs.
    assert r"$-$20.0 [$-$20.0, $-$20.0]" in rows[2]
    assert r"p adjusted for 2 comparisons (Holm)" in text


def test_figures_as_markdown_and_csv(client: TestClient, pair: tuple[dict[str, Any], dict[str, Any]]) -> None:
    text = printed(client, "table", *pair, table="figures", format="markdown").text
    heading, rule, base, other = [line for line in text.splitlines() if line.startswith("|")]
    assert heading.startswith("| Training | Seeds | N (episodes) | Success (%) |")
    assert rule == "| --- | ---: | ---: | ---: | ---: | ---: | --- |"
    assert re.match(r"\| base \| 5 \| 5000 \| 81\.4 \[\d\d\.\d, \d\d\.\d\] \| 100\.0 \[100\.0, 100\.0\] \|", base)
    # The name's own bar is no column, and its tags are text.
    assert len(re.findall(r"(?<!\\)\|", other)) == 8
    assert r"\<b\>" in other
    assert "None" not in text

    table = printed(client, "table", *pair, table="figures", format="csv")
    assert table.headers["content-type"] == "text/csv; charset=utf-8"
    assert table.text.splitlines()[1].startswith('base,5,5000,"81.4 [')


def test_below_five_seeds_a_table_refuses_as_the_page_does(client: TestClient, reports: Reports) -> None:
    few = [measured(reports, name, (900,) * 4) for name in ("one", "two")]
    text = printed(client, "table", *few, format="markdown").text
    assert "| two | one | Success | 4, 4 | – | – | refused | – | – |" in text


def test_cells_are_no_formulas_and_no_commands() -> None:
    table = PrintedTable("verdicts", "T", "c", ("a", "b"), [("=1+1", "[x] -5 a-1 <")])
    assert "{[x] $-$5 a-1 $<$}" in latex(table)
    assert comma_separated(table).splitlines()[1].startswith("'=1+1,")
    assert markdown(table).count("|") == 9


class Tags(HTMLParser):
    """What a page consists of, and what it would load."""

    def __init__(self) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.loads: list[str | None] = []
        self.links: list[str | None] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.loads += [
            value for name, value in attrs if name in ("src", "srcset", "data") or (tag == "link" and name == "href")
        ]
        self.links += [value for name, value in attrs if tag == "a" and name == "href"]


def test_the_report_is_one_file_without_a_script(
    client: TestClient, reports: Reports, pair: tuple[dict[str, Any], dict[str, Any]]
) -> None:
    for experiment in pair:
        reports.metrics(experiment["runs"][0], "eval/success_rate", {100: 0.25, 200: 0.75})
    response = printed(client, "report", *pair, base=pair[1]["id"], margin="0.05")
    assert response.headers["content-disposition"] == 'attachment; filename="mapless-comparison.html"'
    page = Tags()
    page.feed(response.text)
    assert (page.tags.count("script"), page.loads) == (0, [])
    assert (page.tags.count("table"), page.tags.count("svg")) == (3, 5)
    assert "b" not in page.tags
    ids = "&".join(f"experiment={experiment['id']}" for experiment in pair)
    assert page.links == [f"http://127.0.0.1:8400/compare?{ids}&margin=0.05&base={pair[1]['id']}"]
    assert "within 5 points of success" in response.text
    # A verdict has its reason, a chart its words and the title of its axis.
    assert "<li>base beside 50% &amp; more" in response.text
    assert "<h3>Success rate, evaluation <code>eval/success_rate</code></h3>" in response.text
    assert 'rotate(-90)" text-anchor="middle" fill="currentColor">Success rate, evaluation</text>' in response.text
    # Both curves with two points, and four metrics that nobody reported.
    assert response.text.count("<polyline") == 2 + 2


def test_a_line_chart_in_numbers() -> None:
    """From 64 to 548 across, from 232 up to 12: a half is at 122."""
    line = Line("one", Look(0), mean=[0.0, None, 0.5], low=[None, None, 0.25], high=[None, None, 1.0])
    chart = line_chart("t", STEPS, [0, 50, 100], [line], rate=True)
    assert '<polyline points="64.0,232.0 548.0,122.0"' in chart
    assert '<polygon points="548.0,12.0 548.0,177.0"' in chart
    assert all(f">{tick}</text>" in chart for tick in ("0%", "100%", "20", "100"))
    alone = line_chart("t", STEPS, [5], [Line("one", Look(0), [2.0], [None], [None])], rate=False)
    assert '<circle cx="306.0" cy="122.0" r="3"' in alone
    assert "No value yet" in line_chart("t", STEPS, [], [], rate=True)


def test_logarithmic_axes_of_a_chart_in_numbers() -> None:
    """Across from 1 to 100: 10 is in the middle, at 306. Up from 1 / r to 100 r, r = 100 ** 0.05: 10 is halfway, at 122."""
    line = Line("one", Look(0), mean=[1.0, 10.0, 100.0], low=[0.5, -3.0, 90.0], high=[2.0, 20.0, 110.0])
    chart = line_chart("t", STEPS, [1, 10, 100], [line], rate=False, log_x=True, log_y=True)
    assert " 306.0,122.0 " in chart
    # Where the interval reaches below 0 it ends at the chart's edge.
    assert "306.0,232.0" in chart
    assert all(f">{tick}</text>" in chart for tick in ("1", "10", "100"))
    zero = Line("one", Look(0), mean=[0.0, 1.0], low=[None] * 2, high=[None] * 2)
    assert line_chart("t", STEPS, [1, 2], [zero], rate=False, log_y=True) == line_chart(
        "t", STEPS, [1, 2], [zero], rate=False
    )


def test_metrics_and_settings_are_printed_in_words() -> None:
    assert metric_words("eval/collision_rate") == "Collision rate, evaluation"
    assert metric_words("own") == "Own"
    assert setting_words("algorithm.gamma") == "Algorithm: Discount (gamma)"
    assert setting_words("nothing.known_of") == "Nothing: Known of"
    assert STEPS.text(20_000) == "20\N{NARROW NO-BREAK SPACE}000"


def test_ticks_are_round_as_what_they_count() -> None:
    assert ticks(0.0, 1.0) == [0.0, 0.2, 0.4, 0.6, 0.8, 1.0]
    assert ticks(0.0, 7_200.0, (900.0, 1_800.0, 3_600.0)) == [0.0, 1_800.0, 3_600.0, 5_400.0, 7_200.0]
    assert ticks(300.0, 40_000.0, logarithmic=True) == [1_000.0, 10_000.0]
    assert ticks(2.0, 8.0, logarithmic=True) == [2.0, 5.0]
    assert ticks(6.0, 8.0, logarithmic=True) == ticks(6.0, 8.0)
    assert [elapsed(seconds) for seconds in (0.25, 45, 200, 7_500, 270_000)] == [
        *("0.25 s", "45 s", "3 min 20 s", "2 h 5 min", "3 d 3 h")
    ]


def test_a_report_is_looked_at_as_its_page_was(client: TestClient, reports: Reports) -> None:
    experiment = reports.experiment(seeds=(0, 1))
    for run in experiment["runs"]:
        reports.rows(
            run,
            {step: {"time/wall_seconds": 36.0 * step, "loss/value": step - 100.0, "policy/kl": 0.1} for step in (100, 200)},
        )
    asked = {"name": ["policy/kl", "loss/value"], "x": "wall", "log": "true", "ylog": ["loss/value"]}
    text = printed(client, "report", experiment, **asked).text  # type: ignore[arg-type]
    assert text.index("<h3>KL divergence <code>policy/kl") < text.index("<h3>Value loss <code>loss/value")
    assert "eval/success_rate</code>" not in text
    assert text.count(">Time under way</text>") == 2
    assert ">1 h 23 min</text>" in text
    assert "Means end where the first seed is through." in text
    assert text.count("Drawn linearly: a logarithmic axis has no place for values of 0 or below.") == 1
    link = f"/compare?experiment={experiment['id']}&margin=0.02&x=wall&xlog=1&ylog=loss%2Fvalue"
    assert f"{link}&panel=policy%2Fkl&panel=loss%2Fvalue".replace("&", "&amp;") in text


def test_what_cannot_be_printed(client: TestClient, reports: Reports) -> None:
    one = reports.experiment()
    for path in ("table", "report"):
        assert client.get(f"/api/compare/{path}").status_code == 422
        assert client.get(f"/api/compare/{path}", params={"experiment": "nobody"}).status_code == 404
        assert client.get(f"/api/compare/{path}", params={"experiment": one["id"], "base": "nobody"}).status_code == 400


PALETTE = Path(__file__).parents[2] / "web/src/charts/palette.ts"


def test_an_experiment_has_the_colour_that_the_pages_give_it() -> None:
    light, dark = (
        tuple(re.findall(r"#[0-9a-f]{6}", part)) for part in re.findall(r"= \[(.*?)\]", PALETTE.read_text(), re.DOTALL)[:2]
    )
    assert (light, dark) == (LIGHT, DARK)
    # Worked by the pages' own test, too.
    assert [color_of(each) for each in ("a", "k3v9x0m2p8q1", "")] == [4, 7, 1]


def test_of_one_colour_the_second_is_dashed() -> None:
    ids = [each for each in map(str, range(200)) if color_of(each) == color_of("0")][:6]
    looks = looks_of([*ids, ids[0]])
    assert [looks[each].dash for each in ids] == [0, 1, 2, 3, 0, 1]
    assert {looks[each].color for each in ids} == {color_of("0")}
    chart = line_chart("t", STEPS, [0, 1], [Line("two", looks[ids[1]], [0.0, 1.0], [None] * 2, [None] * 2)], rate=True)
    dashes = " ".join(str(2 * length) for length in DASHES[1])
    assert chart.count(f'stroke-dasharray="{dashes}"') == 2


def test_a_report_has_a_curve_in_its_readers_scheme(client: TestClient, pair: tuple[dict[str, Any], dict[str, Any]]) -> None:
    report = printed(client, "report", *pair).text
    place = color_of(pair[0]["id"])
    assert f"var(--line-{place}, {LIGHT[place]})" in report
    assert f"--line-{place}: {DARK[place]};" in report.split("prefers-color-scheme: dark")[1]
