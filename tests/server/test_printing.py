"""What is printed of a comparison: LaTeX that compiles, Markdown that stays a table, a report without a script."""

import json
import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient
from httpx import Response

from server.printing.axes import STEPS, alike, elapsed, ticks
from server.printing.look import Look as PageLook
from server.printing.look import smoothed, smoothing_of, zoom_of
from server.printing.metric_words import METRIC_WORDS, words_of
from server.printing.names import setting_words
from server.printing.palette import DARK, DASHES, LIGHT, Look, color_of, looks_of
from server.printing.svg import Line, line_chart
from server.printing.tables import PrintedTable
from server.printing.text import comma_separated, latex, markdown
from server.printing.values import SPELLED, setting_text
from server.written.metric_words import metric_words
from tests.server.harness import Reports
from tests.server.test_comparison import measured

WEB = Path(__file__).parents[2] / "web/src"
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
    assert 'rotate(-90)" text-anchor="middle" fill="currentColor">Share of episodes</text>' in response.text
    # Both curves with two points, and four metrics that nobody reported.
    assert response.text.count("<polyline") == 2 + 2


def test_a_line_chart_in_numbers() -> None:
    """From 64 to 548 across, from 232 up to 12: a half is at 122."""
    line = Line("one", Look(0), mean=[0.0, None, 0.5], low=[None, None, 0.25], high=[None, None, 1.0])
    chart = line_chart("t", STEPS, [0, 50, 100], [line], rate=True)
    assert '<polyline points="64.0,232.0 548.0,122.0"' in chart
    assert '<polygon points="548.0,12.0 548.0,177.0"' in chart
    assert all(f">{tick}</text>" in chart for tick in ("0\u202f%", "100\u202f%", "20", "100"))
    alone = line_chart("t", STEPS, [5], [Line("one", Look(0), [2.0], [None], [None])], rate=False)
    assert '<circle cx="306.0" cy="122.0" r="3"' in alone
    assert "No value yet" in line_chart("t", STEPS, [], [], rate=True)
    # A name that is longer than the axis ends in time.
    assert f">{'a' * 35}…</text>" in line_chart("t", STEPS, [0, 50, 100], [line], rate=True, vertical="a" * 64)


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
    assert words_of("eval/collision_rate")[:3] == ("Collision rate", "Share of episodes", "evaluation")
    assert setting_words("algorithm.gamma") == "Algorithm: Discount (gamma)"
    assert setting_words("nothing.known_of") == "Nothing: Known of"
    assert STEPS.text(20_000) == "20\N{NARROW NO-BREAK SPACE}000"


def test_metrics_that_have_no_words_are_called_as_on_the_pages() -> None:
    """The same as in web/src/charts/panels.test.ts."""
    assert words_of("reward/my_own_term")[:2] == ("Reward: my own term", "Reward per step")
    assert words_of("mine/miss_rate") == ("mine/miss_rate", "mine/miss_rate", "", True)
    assert not words_of("optim/other_learning_rate").share
    assert words_of("own") == ("own", "own", "", False)


def test_the_pages_have_the_same_words() -> None:
    file = WEB / "charts/metricWords.json"
    assert file.read_text() == metric_words(), "python -m server.written.metric_words web/src/charts/metricWords.json"
    spelled = re.search(r"SPELLED: .*? = \{(.*?)\}", (WEB / "lib/format.ts").read_text(), re.DOTALL)
    assert spelled is not None
    assert dict(re.findall(r"(\w+): '(\w+)'", spelled[1])) == SPELLED


def test_every_metric_that_trainers_report_has_words() -> None:
    told = set()
    for file in (Path(__file__).parents[2] / "workers").rglob("*.py"):
        told |= set(
            re.findall(r'"((?:eval|train|loss|policy|value|optim|time|observation)/[a-z_]+[a-z])"', file.read_text())
        )
    # Paths of exports, and a mark of a training that broke, which is never drawn.
    assert told - {"policy/policy", "policy/finite"} <= set(METRIC_WORDS)
    assert len(told) > 25


@pytest.mark.parametrize("case", json.loads((WEB / "form/settingTexts.json").read_text()), ids=str)
def test_a_setting_is_written_as_on_the_pages(case: dict[str, Any]) -> None:
    assert setting_text(case["value"]) == case["text"]


def test_numbers_of_settings_are_for_readers_or_for_programs() -> None:
    cells: list[tuple[str, ...]] = [(setting_text(-20_000), setting_text(-0.5))]
    table = PrintedTable("differences", "T", "c", ("a", "b"), cells, frozenset({0, 1}))
    assert cells == [("\u221220\u202f000", "\u22120.5")]
    assert r"$-$20\,000 & $-$0.5 \\" in latex(table)
    assert "| \u221220\u202f000 | \u22120.5 |" in markdown(table)
    # A text that begins with a sign is no formula.
    assert comma_separated(table).splitlines()[1] == "'-20000,'-0.5"


def test_ticks_of_one_axis_are_written_alike() -> None:
    """As web/src/charts/axis.test.ts has them."""
    assert alike([0.0, 0.25, 0.5, 0.75, 1.0]) == ["0.00", "0.25", "0.50", "0.75", "1.00"]
    assert alike([-0.5, 0.0, 0.5]) == ["\u22120.5", "0.0", "0.5"]
    assert alike([0.95, 0.975, 1.0], share=True) == ["95.0\u202f%", "97.5\u202f%", "100.0\u202f%"]
    assert alike([0.0, 500.0, 1_000.0, 1_500.0]) == ["0", "0.5k", "1.0k", "1.5k"]
    assert alike([1_234_000.0, 1_234_500.0, 1_235_000.0]) == ["1.2340M", "1.2345M", "1.2350M"]
    assert alike([0.0, 2e-5, 1.5e-5]) == ["0", "2.0e\u22125", "1.5e\u22125"]
    assert (alike([]), alike([0.0]), alike([12.5])) == ([], ["0"], ["12.5"])


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
    assert text.index("<h3>KL divergence, old to new policy <code>policy/kl") < text.index("<h3>Value loss <code>loss/value")
    assert "eval/success_rate</code>" not in text
    assert text.count(">Time under way</text>") == 2
    assert ">1 h 23 min</text>" in text
    assert "Means end where the first seed is through." in text
    assert text.count("Drawn linearly: a logarithmic axis has no place for values of 0 or below.") == 1
    link = f"/compare?experiment={experiment['id']}&margin=0.02&x=wall&xlog=1&ylog=loss%2Fvalue"
    assert f"{link}&panel=policy%2Fkl&panel=loss%2Fvalue".replace("&", "&amp;") in text


def test_what_a_page_shows_of_lines() -> None:
    """Of 0, 1, 2 at 0, 100, 200 half of the past makes 0, 2/3 and 10/7; between 50 and 150 they begin and end halfway."""
    line = Line("one", Look(0), mean=[0.0, 1.0, 2.0], low=[0.0] * 3, high=[2.0] * 3)
    soft = smoothed(line, 0.5)
    assert soft.mean == pytest.approx([0.0, 2 / 3, 10 / 7])
    assert (soft.low, soft.high, soft.beneath) == ([None] * 3, [None] * 3, line.mean)
    zoomed = PageLook(zoom=(50.0, 150.0))
    x, (cut,) = zoomed.shown([0, 100, 200], [line], "loss")
    assert (x, cut.mean, cut.low, cut.high) == ([50.0, 100, 150.0], [0.5, 1.0, 1.5], [0.0] * 3, [2.0] * 3)
    # Smoothed by all that came before, not from the zoom on.
    x, (cut,) = PageLook(smooth={"loss": 0.5}, zoom=(100.0, 200.0)).shown([0, 100, 200], [line], "loss")
    assert (x, cut.beneath) == ([100.0, 200.0], [1.0, 2.0])
    assert cut.mean == pytest.approx([2 / 3, 10 / 7])
    # A curve that ends within has no value at the end of the zoom, and one that has a gap is drawn across it.
    short = Line("two", Look(1), mean=[0.0, 1.0, None], low=[None] * 3, high=[None] * 3)
    assert PageLook(zoom=(50.0, 150.0)).shown([0, 100, 200], [short], "loss")[1][0].mean == [0.5, 1.0, None]
    # On a logarithmic x halfway is a factor.
    rising = Line("three", Look(2), mean=[0.0, 2.0], low=[None] * 2, high=[None] * 2)
    factors = PageLook(zoom=(10.0, 99.0), log_x=True)
    assert factors.shown([1, 100], [rising], "loss")[1][0].mean[0] == pytest.approx(1.0)
    assert PageLook(zoom=(-5.0, 10.0), log_x=True).shown([1, 100], [rising], "loss")[0] == [1, 10.0]
    # Nothing lies there, and the axis is as on the page.
    x, (cut,) = zoomed.shown([200, 300], [rising], "loss")
    assert (x, cut.mean) == ([50.0, 150.0], [None, None])


def test_what_an_address_says_is_read_or_left() -> None:
    assert zoom_of("19000~3.6e4") == (19_000.0, 36_000.0)
    assert [zoom_of(text) for text in (None, "9~3", "1~1e999")] == [None] * 3
    assert smoothing_of(["0.8~train/return", "0~loss/value", "1~policy/kl", "0.5~odd~name"]) == {
        "train/return": 0.8,
        "odd~name": 0.5,
    }


def test_a_report_shows_what_its_page_showed(client: TestClient, reports: Reports) -> None:
    base, other = (reports.experiment(name=name, seeds=(0,)) for name in ("First", "Second"))
    for experiment in (base, other):
        reports.metrics(experiment["runs"][0], "loss/value", {100: 8.0, 200: 4.0, 300: 2.0, 400: 2.0})
        reports.metrics(experiment["runs"][0], "policy/kl", {100: 1.0, 200: 2.0, 300: 3.0, 400: 4.0})
    asked: dict[str, Any] = {
        "name": ["loss/value", "policy/kl"],
        "smooth": "0.8~loss/value",
        "hide": other["id"],
        "zoom": "200~300",
    }
    text = printed(client, "report", base, other, **asked).text
    value, kl = text.split("<figure>")[2:]
    # The mean and what was reported, of one training; of two points each: the ends of the zoom.
    assert (value.count("<polyline"), kl.count("<polyline")) == (2, 1)
    assert (value.count(">First, 1 seed</text>"), text.count(">Second, 1 seed</text>")) == (1, 0)
    assert '<polyline points="64.0,222.0 548.0,22.0"' in kl
    assert "Smoothed, 0.80; thin: what was reported." in value
    assert "Smoothed" not in kl
    assert ">200</text>" in kl
    assert ">400</text>" not in kl
    assert "Steps from 200 to 300 alone, as the page showed its curves." in text
    assert "Curves that were hidden on the page are left out: Second." in text
    link = f"&panel=loss%2Fvalue&panel=policy%2Fkl&smooth=0.8~loss%2Fvalue&hide={other['id']}&zoom=200~300"
    assert link.replace("&", "&amp;") in text
    beyond = printed(client, "report", base, other, **asked | {"zoom": "900~1000"}).text
    assert beyond.count("Nothing of it was shown on the page") == 2
    for wrong in ({"zoom": "all"}, {"smooth": "much~loss/value"}):
        assert client.get("/api/compare/report", params={"experiment": base["id"]} | wrong).status_code == 422


def test_a_report_writes_settings_as_the_pages_do(client: TestClient, reports: Reports) -> None:
    def training(rate: float, sizes: list[int]) -> dict[str, Any]:
        return {"algorithm": {"name": "ppo", "learning_rate": rate, "network": {"name": "mlp", "hidden_sizes": sizes}}}

    first = reports.experiment(name="First", **training(3e-5, [64, 64]))
    second = reports.experiment(name="Second", **training(0.001, [64, 64, 32]))
    text = printed(client, "report", first, second).text
    assert "<td>3e\u22125</td><td>0.001</td>" in text
    assert "<td>64, 64</td><td>64, 64, 32</td>" in text


def test_what_cannot_be_printed(client: TestClient, reports: Reports) -> None:
    one = reports.experiment()
    for path in ("table", "report"):
        assert client.get(f"/api/compare/{path}").status_code == 422
        assert client.get(f"/api/compare/{path}", params={"experiment": "nobody"}).status_code == 404
        assert client.get(f"/api/compare/{path}", params={"experiment": one["id"], "base": "nobody"}).status_code == 400


def test_an_experiment_has_the_colour_that_the_pages_give_it() -> None:
    light, dark = (
        tuple(re.findall(r"#[0-9a-f]{6}", part))
        for part in re.findall(r"= \[(.*?)\]", (WEB / "charts/palette.ts").read_text(), re.DOTALL)[:2]
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
