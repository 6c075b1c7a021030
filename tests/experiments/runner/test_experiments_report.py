"""Results on disk and the report made of them."""

import csv
import json
import re
from dataclasses import replace
from html import unescape
from html.parser import HTMLParser
from importlib import import_module
from importlib.metadata import packages_distributions
from itertools import combinations
from pathlib import Path
from shutil import copytree, ignore_patterns

import numpy as np
import pytest
from example_result import example
from places import PACKAGE, ROOT

import experiments
from experiments.command_line import main
from experiments.runner import committed
from experiments.runner.catalogue import EXPERIMENTS
from experiments.runner.committed import read_origin, read_rows, stored_outcome, table_with_origin
from experiments.runner.registry import Context, Experiment
from experiments.runner.report import check_page, report_fingerprint, write_report
from pymoo_hdte._io.csv_table import csv_text
from pymoo_hdte._runner import provenance
from pymoo_hdte._runner.campaign import Campaign
from pymoo_hdte._runner.result import (
    FIRST_PAGE,
    OF_MODELS,
    WITHIN_PAPER,
    Column,
    Finding,
    Result,
    Table,
    significant,
)
from pymoo_hdte._runner.store import load, png_bytes, save
from pymoo_hdte.checks import InvalidInput


@pytest.fixture
def out(tmp_path):
    save(tmp_path, "table7", example(), report_fingerprint())
    return tmp_path


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (0.0180, 3, "0.0180"),
        (88.767, 4, "88.77"),
        (9.9996, 4, "10.00"),
        (12345.6, 3, "12346"),
        (-0.25, 2, "\N{MINUS SIGN}0.25"),
        (1.9e-7, 2, "1.9e\N{MINUS SIGN}07"),
        (0.0, 3, "0"),
        (float("nan"), 3, "\N{EM DASH}"),
        (float("inf"), 3, "∞"),
    ],
)
def test_numbers_keep_their_significant_digits(value, digits, text):
    assert significant(value, digits) == text


def test_csv_keeps_every_digit(out):
    with (out / "table7" / "quality.csv").open(newline="") as file:
        heading, first, second, _ = csv.reader(file)
    assert heading == ["algorithm", "IGD mean [arcsec]", "IGD paper [arcsec]", "runs"]
    assert float(first[1]) == 1 / 3
    assert second == ["none", "nan", "", "0"]


def test_floats_survive_csv_bit_for_bit():
    values = np.random.default_rng(3).normal(size=(50, 2)) * 10.0 ** np.arange(-25, 25)[:, None]
    text = csv_text(["a", "b"], values.tolist())
    read = [[float(cell) for cell in line.split(",")] for line in text.splitlines()[1:]]
    np.testing.assert_array_equal(read, values)


def shown(table):
    return [
        [column.show(cell) for column, cell in zip(table.columns, row, strict=True)]
        for row in table.rows
    ]


def test_a_stored_result_reads_back_as_it_was(out):
    written, read = example(), load(out, "table7")
    for table, again in zip(written.tables, read.tables, strict=True):
        assert replace(again, rows=()) == replace(table, rows=())
        assert again.rows[0] == table.rows[0]
        assert shown(again) == shown(table)
        places = range(len(table.columns))
        assert [again.holds_text(i) for i in places] == [table.holds_text(i) for i in places]
    assert (read.title, read.notes, read.answer) == ("An example", ("A note.",), "They differ.")
    assert (read.models, read.first_page) == (written.models, written.first_page)
    assert (out / "table7" / "line.png").read_bytes() == png_bytes(written.pictures[0])


def test_a_result_in_the_form_of_another_version_is_left_out(out):
    stored = out / "table7" / "result.json"
    content = json.loads(stored.read_text())
    content["opening"] = content.pop("answer")
    stored.write_text(json.dumps(content))
    assert load(out, "table7") is None
    assert "An example" not in write_report(out).read_text()


def test_stored_results_are_json_that_any_reader_takes(out):
    def refuse(word):
        raise AssertionError(word)

    stored = json.loads((out / "table7" / "result.json").read_text(), parse_constant=refuse)
    assert [row[1] for row in stored["tables"][0]["rows"]] == [1 / 3, None, "∞"]


def test_a_page_of_somebody_else_is_not_overwritten(tmp_path, capsys):
    (tmp_path / "index.html").write_text("my page")
    with pytest.raises(SystemExit) as stopped:
        main(["table5", "--out", str(tmp_path)])
    assert stopped.value.code == 2
    assert "such a report" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["index.html"]
    assert (tmp_path / "index.html").read_text() == "my page"


def test_a_page_that_is_no_file_is_not_overwritten(tmp_path):
    (tmp_path / "index.html").symlink_to(tmp_path / "nowhere")
    with pytest.raises(InvalidInput, match="such a report"):
        check_page(tmp_path)
    (tmp_path / "index.html").unlink()
    (tmp_path / "index.html").mkdir()
    with pytest.raises(InvalidInput, match="such a report"):
        check_page(tmp_path)
    write_report(tmp_path / "other")
    check_page(tmp_path / "other")


def test_stored_outcomes_say_when_they_were_made(tmp_path, monkeypatch):
    monkeypatch.setattr(committed, "DATA", tmp_path)
    text = table_with_origin(["kind", "n"], [["# {x}", 3]], seed=[7])
    (tmp_path / "a.csv").write_text(text, encoding="utf-8")
    assert read_rows(tmp_path / "a.csv") == [{"kind": "# {x}", "n": "3"}]
    assert read_origin(tmp_path / "a.csv")["seed"] == [7]
    context = Context(1, tmp_path, Campaign(tmp_path))
    (paragraph,) = stored_outcome(context, "a")
    assert read_origin(tmp_path / "a.csv")["date"] in paragraph
    assert stored_outcome(replace(context, full=True), "a") == ()
    (tmp_path / "b.csv").write_text(csv_text(["kind"], [["x"]]), encoding="utf-8")
    assert read_rows(tmp_path / "b.csv") == [{"kind": "x"}]
    with pytest.raises(OSError, match="does not say"):
        stored_outcome(context, "b")


@pytest.mark.parametrize("experiment", EXPERIMENTS, ids=lambda one: one.name)
def test_whatever_reads_a_stored_outcome_says_so(experiment):
    module = import_module(f"experiments.{experiment.module}")
    assert hasattr(module, "stored_outcome") == experiment.reads_outcome


def test_full_is_refused_where_there_is_no_long_campaign(tmp_path, capsys):
    with pytest.raises(SystemExit):
        main(["table5", "--full", "--out", str(tmp_path / "out")])
    assert (
        "--full is for anytime, calibration, inference, blind, sealed_rigs, real, peers"
        in capsys.readouterr().err
    )


@pytest.mark.parametrize("experiment", EXPERIMENTS, ids=lambda one: one.name)
def test_seeds_are_refused_where_they_would_change_nothing(experiment, tmp_path, capsys):
    module = import_module(f"experiments.{experiment.module}")
    asks = "context.seeds" in Path(module.__file__).read_text()
    assert experiment.takes_seeds == asks
    if asks:
        return
    with pytest.raises(SystemExit) as stopped:
        main([experiment.name, "--seeds", "20", "--out", str(tmp_path / "out")])
    assert stopped.value.code == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "--seeds is for table7, ablation; see" in line
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("name", "option", "seeds"),
    [
        (["table7"], [], 20),
        (["table7"], ["--seeds", "3"], 3),
        pytest.param([], [], 20, marks=pytest.mark.nightly),
        pytest.param([], ["--seeds", "3"], 3, marks=pytest.mark.nightly),
    ],
)
def test_the_number_of_seeds_reaches_what_takes_it(name, option, seeds, tmp_path, monkeypatch):
    asked = []

    def run(experiment, context):
        asked.append((experiment.name, context.seeds))
        return Result("", "")

    monkeypatch.setattr(Experiment, "run", run)
    assert main([*name, *option, "--workers", "1", "--out", str(tmp_path)]) == 0
    assert asked[0] == ("table7", seeds)


def test_wall_times_are_stored_apart_from_what_must_come_out_the_same(out):
    assert (out / "times" / "table7" / "times.csv").is_file()
    assert not (out / "table7" / "times.csv").exists()
    assert "Wall times" not in (out / "table7" / "result.json").read_text()


def test_a_table_with_a_short_row_is_refused():
    with pytest.raises(ValueError, match="1 cells for 2 columns"):
        Table("broken", "Broken", (Column("a"), Column("b")), ((1.0,),))


def pages(out):
    write_report(out)
    return sorted(out.rglob("*.html"))


def test_pages_ask_for_nothing_but_files_beside_them(out):
    found = pages(out)
    assert [str(page.relative_to(out)) for page in found] == [
        "comparisons.html", "index.html", "models.html", "table7/index.html",
    ]  # fmt: skip
    for page in found:
        text = page.read_text()
        for source in re.findall(r'(?:src|href)="([^"]*)"', text):
            path, _, anchor = source.partition("#")
            target = page.parent / path if path else page
            assert target.is_file(), source
            assert not anchor or f'id="{anchor}"' in target.read_text()
        assert "<script" not in text
        assert "@import" not in text


def test_every_table_is_linked_as_csv_and_every_picture_shown(out):
    pages(out)
    text = (out / "table7" / "index.html").read_text()
    assert re.findall(r'href="([^"]*csv)"', text) == [
        "quality.csv", "../times/table7/times.csv",
    ]  # fmt: skip
    assert re.findall(r'<img src="([^"]*)"', text) == ["line.png"]


def test_pages_are_well_formed_and_escape_what_they_show(out):
    class Balance(HTMLParser):
        def __init__(self):
            super().__init__()
            self.open = []

        def handle_starttag(self, tag, attributes):
            if tag not in {"meta", "img"}:
                self.open.append(tag)

        def handle_endtag(self, tag):
            assert self.open.pop() == tag

    for page in pages(out):
        parser = Balance()
        parser.feed(page.read_text())
        assert parser.open == []
    assert "&lt;script&gt;" in (out / "table7" / "index.html").read_text()


def sections_of_the_first_page(out):
    """Return heading and parts of each section, and what follows them."""
    text = write_report(out).read_text()
    sections, rest = text.split('<ul class="cards">')
    headings = [piece.split("</section>")[0] for piece in sections.split("<section>")[1:]]
    return [
        (re.search("<h2>([^<]+)</h2>", piece)[1], re.findall("<li><a [^>]+>([^<]+)</a>", piece))
        for piece in headings
    ], rest


def test_the_first_page_has_sections_pictures_and_a_card_for_each_result(out):
    sections, cards = sections_of_the_first_page(out)
    assert sections == [(WITHIN_PAPER, ["This holds."]), (OF_MODELS, ["That does not."])]
    first = (out / "index.html").read_text()
    before, _ = first.split('<ul class="cards">')
    assert re.findall(r'<img src="([^"]*)"', before) == ["table7/line.png"]
    (card,) = cards.split("<li>")[1:]
    question = next(one.question for one in EXPERIMENTS if one.name == "table7")
    for words in ("An example", question.replace("'", "&#39;"), "They differ."):
        assert words in card
    assert "<table>" not in first


def test_sections_come_in_the_order_of_the_first_page_whatever_says_them(tmp_path):
    names = ("table7", "table2", "table6", "robust")
    for name in names:
        parts = {about: f"by {name}" for about in reversed(FIRST_PAGE)}
        save(tmp_path, name, replace(example(), first_page=parts), report_fingerprint())
    sections, _ = sections_of_the_first_page(tmp_path)
    assert [about for about, _ in sections] == list(FIRST_PAGE)
    for _, parts in sections:
        assert parts == ["By robust.", "By table6.", "By table2.", "By table7."]


def test_comparisons_are_sorted_by_what_came_out(out):
    first = write_report(out).read_text()
    text = (out / "comparisons.html").read_text()
    lists = {
        number: (unescape(heading), re.findall("<li>(.+?) <a", body))
        for number, heading, body in re.findall(
            r'<section id="(.+?)">\s*<h2[^>]*>(.+?)</h2>(.+?)</section>', text, re.DOTALL
        )
    }
    headings = [heading for heading, _ in lists.values()]
    assert len(set(headings)) == len(headings)
    # Each list holds the findings of one verdict, and the summary counts them.
    findings = example().tables[0].findings
    by_verdict = {}
    for finding in findings:
        by_verdict.setdefault(finding.verdict, []).append(finding.sentence)
    assert sorted(entries for _, entries in lists.values()) == sorted(by_verdict.values())
    counts = re.findall(r'href="comparisons.html#(.+?)">(.+?): <b>(\d+)</b>', first)
    assert [(number, unescape(heading), int(count)) for number, heading, count in counts] == [
        (number, heading, len(entries)) for number, (heading, entries) in lists.items()
    ]
    page = (out / "table7" / "index.html").read_text()
    shown = re.findall(r'class="finding[^>]*><b>([^<]+)\.</b>', page)
    assert shown == [finding.verdict for finding in findings]


def test_contradictions_within_the_paper_are_no_misfits_of_ours(out):
    sentences = {"It contradicts itself.", "They differ.", "They agree.", "It fits itself."}
    findings = [one for one in example().tables[0].findings if one.sentence in sentences]
    assert len({one.verdict for one in findings}) == len(sentences)
    write_report(out)
    (within,) = (
        section
        for section in (out / "comparisons.html").read_text().split("<section ")
        if "It contradicts itself." in section
    )
    assert "They differ." not in within
    assert 'class="no"' in within


def test_a_page_begins_with_its_answer_and_a_leading_picture(tmp_path):
    result = example()
    (picture,) = result.pictures
    leading = replace(picture, name="first", caption="Look here first.", leading=True)
    opened = replace(result, answer="This came out.", pictures=(picture, leading))
    save(tmp_path, "table7", opened, report_fingerprint())
    write_report(tmp_path)
    article = (tmp_path / "table7" / "index.html").read_text().split("<article>")[1]
    assert re.match(r"\s*<h1>[^<]+</h1>\s*<p class=\"answer\">This came out\.", article)
    places = [
        article.index(words) for words in ("Look here first.</fig", "<table>", picture.caption)
    ]
    assert places == sorted(places)


def test_a_result_speaks_of_no_other_section_of_the_first_page():
    with pytest.raises(ValueError, match="What else"):
        Result("", "", first_page={"What else": "this"})


@pytest.mark.parametrize("kinds", [*combinations(("check", "fitted", "within_paper"), 2)])
def test_a_finding_is_judged_in_one_way(kinds):
    with pytest.raises(ValueError, match="not two"):
        Finding(True, "Both.", **dict.fromkeys(kinds, True))


def test_results_of_another_source_are_marked(out):
    assert "run again" not in write_report(out).read_text()
    stored = out / "table7" / "result.json"
    stored.write_text(re.sub(r'"made_by": "\w+"', '"made_by": "older"', stored.read_text()))
    assert "run again" in write_report(out).read_text()


@pytest.mark.parametrize(
    "changed", ["runner/report.py", "data/reliability.csv", "templates/index.html"]
)
def test_a_result_depends_on_source_stored_outcomes_and_template(changed, tmp_path, monkeypatch):
    folder = tmp_path / "experiments"
    copytree(Path(experiments.__file__).parent, folder, ignore=ignore_patterns("__pycache__"))
    monkeypatch.setattr(experiments, "__file__", str(folder / "__init__.py"))
    before = report_fingerprint()
    provenance.fingerprint.cache_clear()
    assert report_fingerprint() == before
    with (folder / changed).open("a") as file:
        file.write("\n")
    provenance.fingerprint.cache_clear()
    assert report_fingerprint() != before


def test_the_versions_are_those_of_all_that_computes_a_result():
    """Every package that the sources import, but for those that only run or show a computation."""
    imported = set()
    for path in [*PACKAGE.rglob("*.py"), *(ROOT / "experiments").rglob("*.py")]:
        imported |= set(re.findall(r"^ *(?:import|from) (\w+)", path.read_text(), re.MULTILINE))
    distributions = packages_distributions()
    found = {name for module in imported & distributions.keys() for name in distributions[module]}
    bystanders = {"pymoo-hdte", "tqdm", "Jinja2", "tomli_w", "threadpoolctl"}
    # Parts of mujoco.
    bystanders |= {"mujoco-core", "mujoco-studio"}
    # They carry calls to workers.
    bystanders |= {"distributed", "cloudpickle"}
    named = {name.lower() for name in provenance.PACKAGES}
    assert {name.lower() for name in found - bystanders} <= named


def test_an_empty_folder_gives_an_empty_report(tmp_path):
    page = write_report(tmp_path, notice="Interrupted.").read_text()
    assert "Interrupted." in page
    assert "<img" not in page


def test_a_table_without_rows_says_so_and_shows_no_head(tmp_path):
    result = example()
    empty = replace(result.tables[0], rows=(), note="", findings=())
    save(tmp_path, "table7", replace(result, tables=(empty,), pictures=(), shown_first=""))
    pages(tmp_path)
    text = (tmp_path / "table7" / "index.html").read_text()
    assert "<table" not in text
    assert "None." in text
