"""The page itself: well-formed, self-contained, harmless, in order."""

import csv
import re
from html.parser import HTMLParser

import pytest

from bridge.errors import LogError
from identify.report.cells import fixed
from identify.report.page import Figure, Report, Section, Table, render_report, write_report
from identify.report.plot import Panel, lines_panel, stack

VOID = {"meta", "br", "hr", "img", "input", "link"}
HOSTILE = (
    "</td></script><script>alert(1)</script><img src=http://evil/x onerror='a()'>\x1b[31m\u202e\ud800\"&"
)


class Page(HTMLParser):
    """Elements in order, with their attributes and the text inside each; fails on one that is not closed."""

    def __init__(self, html):
        super().__init__()
        self.open: list[str] = []
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.texts: list[tuple[str, str]] = []
        self.feed(html)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if data.strip() and self.open:
            self.texts.append((self.open[-1], data))

    def texts_in(self, *tags):
        return [text for tag, text in self.texts if tag in tags]


TABLE = Table(
    ("Name", "Value"), (("a", fixed(1, 0, "m")), ("b", fixed(-2, 0, "m")), ("c", "—")), "Three things"
)
FIGURE = Figure("line", "A line", stack([Panel(lambda box: box.plot([0, 1], [0, 1]))]))


def report(*sections):
    return Report("Title", "Subtitle", "It works.", sections)


def test_each_table_stands_there_as_csv_to_be_copied():
    odd = Table(("Name", "Words"), (("a", 'said "no", twice'), ("b", "x < y")))
    page = Page(render_report(report(Section("Part", "", (TABLE, odd)))))
    first, second = page.texts_in("pre")
    assert first == 'Name,"Value, m"\na,1\nb,-2\nc,\n'
    assert list(csv.reader(second.splitlines())) == [list(odd.columns), *map(list, odd.rows)]


def test_a_row_becomes_a_block_on_a_phone_where_its_unbroken_cells_leave_no_room_for_its_name():
    def kind(*cells, name="roll", heads=("off", "shadow", "both")):
        table = Table(("Axis", *heads), ((name, *cells),))
        page = Page(render_report(report(Section("Part", "", (table,)))))
        return next(attrs.get("class") for tag, attrs in page.elements if tag == "table")

    assert kind("0.08 deg/s", "0.08 deg/s", "0.08 deg/s") is None
    assert kind("0.081 deg/s", "0.081 deg/s", "0.081 deg/s") == "wide"
    assert kind("8.0", "8.1", "8.2", name="Acceleration, mm/s") is None
    dives = ("0323Z-hovering-6 both", "0321Z-hovering-5 both", "0319Z-hovering-4 both")
    assert kind("8.0", "8.1", "8.2", name="Acceleration, mm/s", heads=dives) == "wide"
    assert kind("8.0", "8.1", "8.2", name="yaw", heads=dives) is None
    assert kind("0.081 deg/s", "a sentence that is broken anywhere, however long", "0.081 deg/s") is None


def test_the_date_that_names_a_row_stays_in_one_piece_on_a_wide_screen():
    table = Table(("Date, UTC", "Dive"), (("2026-11-30 11:20", "a dive"),))
    html = render_report(report(Section("Part", "", (table,))))
    assert '<th scope="row" class="short">2026-11-30 11:20</th>' in html


def test_a_page_stands_alone_and_runs_nothing():
    page = Page(render_report(report(Section("Part", "Words.", (TABLE,), (FIGURE,)))))
    tags = [tag for tag, _ in page.elements]
    assert not {"script", "link", "img", "iframe", "object", "base", "form"} & set(tags)
    links = [value for _, attrs in page.elements for key, value in attrs.items() if key in ("href", "src")]
    assert "#part-1" in links
    saved, inside = [
        [link for link in links if str(link).startswith(start)] for start in ("data:text/csv;", "#part-1")
    ]
    assert sorted(links) == sorted([*saved, *inside])
    assert len(saved) == 1
    assert "http" not in render_report(report()).replace("http-equiv", "")
    assert "http" not in render_report(report(Section("Part", figures=(FIGURE,)))).replace("http-equiv", "")
    assert all(
        place.startswith("#part-1")
        for place in re.findall(r"url\(([^)]*)", render_report(report(Section("Part", figures=(FIGURE,)))))
    )
    policy = [attrs["content"] for tag, attrs in page.elements if attrs.get("http-equiv")]
    assert policy == ["default-src 'none'; style-src 'unsafe-inline'"]


def test_title_verdict_sections_figures_and_tables_come_in_order():
    second = Section(
        "Second", "First paragraph.\n\nSecond paragraph.", (TABLE, Table(("X",), (("y",),))), (FIGURE,)
    )
    page = Page(render_report(report(Section("First"), second)))
    words = page.texts_in("h1", "p", "h2", "caption", "th", "td", "figcaption")
    assert words == [
        *("Title", "It works.", "Subtitle"),
        *("First", "Nothing to show."),
        *("Second", "First paragraph.", "A line", "Second paragraph."),
        *("Three things", "Name", "Value", "a", "1 m", "b", "−2 m", "c", "—", "X", "y"),
    ]


def test_a_warning_stands_first_and_in_words():
    page = Page(render_report(report(Section("Part", "Words.", (TABLE,), warning="Look out\n\nIt leaks."))))
    words = page.texts_in("h2", "strong", "p", "caption")
    assert words[3:] == ["Look out", "It leaks.", "Words.", "Three things"]
    assert [a.get("role") for _, a in page.elements if a.get("class") == "warning"] == ["note"]
    calm = Page(render_report(report(Section("Part", "Words."))))
    assert "warning" not in [attrs.get("class") for _, attrs in calm.elements]


def test_sections_of_the_same_heading_are_numbered_in_heading_and_link():
    page = Page(render_report(report(Section("Dive"), Section("Other"), Section("Dive"))))
    assert page.texts_in("a") == page.texts_in("h2") == ["Dive", "Other", "Dive (2)"]


def labelled(words):
    """A figure that is called, captioned and titled so."""
    return Figure(words, words, stack([lines_panel(words, words, ())]))


def test_hostile_text_stays_text_wherever_it_stands():
    table = Table((HOSTILE, HOSTILE), ((HOSTILE, HOSTILE),), HOSTILE)
    hostile = Report(
        HOSTILE,
        HOSTILE,
        HOSTILE,
        (Section(HOSTILE, HOSTILE, (table,), (labelled(HOSTILE),), HOSTILE),),
    )
    tame = Report(
        "t",
        "t",
        "t",
        (Section("t", "t", (Table(("t", "t"), (("t", "t"),), "t"),), (labelled("t"),), "t"),),
    )
    html = render_report(hostile)
    assert [tag for tag, _ in Page(html).elements] == [tag for tag, _ in Page(render_report(tame)).elements]
    assert not {"\x1b", "\u202e", "\ud800"} & set(html)
    shown = HOSTILE.replace("\x1b", "\ufffd").replace("\u202e", "\ufffd").replace("\ud800", "\ufffd")
    assert Page(html).texts_in("h1") == [shown]


def test_a_report_is_written_whole_in_a_new_folder_and_a_place_that_cannot_be_is_named(tmp_path):
    path = tmp_path / "new" / "report.html"
    assert write_report(path, report()) == path
    assert path.read_text(encoding="utf-8") == render_report(report())
    assert [p.name for p in path.parent.iterdir()] == ["report.html"]
    with pytest.raises(LogError, match=r"report\.html/in\.html: the report can't be written"):
        write_report(path / "in.html", report())
