"""Figures drawn: inline SVG in the reader's colours for the page; SVG and PNG files, a column wide, for a paper."""

import io
import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from matplotlib import rc_context
from matplotlib.figure import Figure as Picture
from matplotlib.text import Text

from bridge.text import printable
from identify.report.plot import LIGHT, Draw
from identify.words import safe

WIDE_IN, COLUMN_IN = 10.0, 3.46
"""Width of the page on a wide screen; width of a paper's column (88 mm), which also fits a phone."""

COLUMN_DPI = 300
LOOK: dict[str, Any] = {
    "axes.axisbelow": True,
    "axes.edgecolor": LIGHT["rule"],
    "axes.facecolor": "none",
    "axes.formatter.limits": (-9, 12),
    "axes.formatter.useoffset": False,
    "axes.grid": True,
    "axes.labelcolor": LIGHT["ink"],
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlecolor": LIGHT["ink"],
    "axes.titlesize": "medium",
    "axes.titleweight": "bold",
    "axes.xmargin": 0.0,
    "axes.ymargin": 0.06,
    "figure.constrained_layout.use": True,
    "figure.facecolor": "none",
    "grid.color": LIGHT["tick"],
    "legend.borderpad": 0.0,
    "legend.frameon": False,
    "legend.fontsize": "medium",
    "lines.markersize": 5.0,
    "lines.solid_capstyle": "butt",
    "path.simplify_threshold": 0.7,
    "svg.fonttype": "none",
    "svg.hashsalt": "seatrial",
    "text.color": LIGHT["ink"],
    "text.parse_math": False,
    "xtick.bottom": False,
    "xtick.labelcolor": LIGHT["ink"],
    "ytick.labelcolor": LIGHT["ink"],
    "ytick.left": False,
}
"""matplotlib's settings while a figure is drawn. Lines are thinned to the visible points, text stays text, and the
same figure gives the same bytes. The grid shows where the numbers stand; tick marks in addition would be a tenth of a
page's size.
"""

FONT_PT = {WIDE_IN: 10.0, COLUMN_IN: 8.5}
NO_METADATA = {"Date": None, "Creator": None, "Format": None, "Type": None}

_NAMES = {colour: name for name, colour in LIGHT.items()}
_PLACES = re.compile(r' (?:d|x|y|width|height|transform)="[^"]*"')
_NUMBER = re.compile(r"-?\d+\.\d+")
_PATH = re.compile(r' d="((?:[ML] \S+ \S+\s*)+)"')
_POINT = re.compile(r"([ML]) (\S+) (\S+)")


def inline(draw: Draw, label: str, key: str) -> str:
    """The figure in two widths; the page shows the fitting width. `key` makes the ids of its parts unique."""
    parts = []
    for width_in, kind in ((WIDE_IN, "wide"), (COLUMN_IN, "column")):
        with _drawn(draw, width_in) as picture:
            parts.append(_for_page(_svg(picture), label, f"{key}{kind[0]}", kind))
    return "".join(parts)


def write_files(draw: Draw, stem: Path) -> tuple[Path, Path]:
    """Write `stem`.svg and `stem`.png, a column wide, on white."""
    places = stem.with_name(f"{stem.name}.svg"), stem.with_name(f"{stem.name}.png")
    with _drawn(draw, COLUMN_IN) as picture:
        places[0].write_text(_svg(picture, facecolor=LIGHT["ground"]), encoding="utf-8")
        white = {"facecolor": LIGHT["ground"], "metadata": {"Software": None}}
        picture.savefig(places[1], format="png", dpi=COLUMN_DPI, **white)
    return places


@contextmanager
def _drawn(draw: Draw, width_in: float) -> Iterator[Picture]:
    """The drawn figure, with the settings still active that saving it needs."""
    with rc_context({**LOOK, "font.size": FONT_PT[width_in]}), warnings.catch_warnings():
        # Glyphs missing from matplotlib's font are drawn with the page's font.
        warnings.filterwarnings("ignore", message="Glyph")
        picture = draw(width_in)
        for words in picture.findobj(Text):
            words.set_text(printable(words.get_text(), "\N{REPLACEMENT CHARACTER}", "\n"))
        yield picture


def _svg(picture: Picture, **how: Any) -> str:
    written = io.StringIO()
    picture.savefig(written, format="svg", metadata=NO_METADATA, **how)
    return written.getvalue()


def _for_page(svg: str, label: str, key: str, kind: str) -> str:
    """Adapt matplotlib's SVG to the page: colours by name, the page's font, ids that are unique to the figure."""
    box = re.search(r'viewBox="[^"]*"', svg)
    assert box
    inner = svg[svg.index(">", box.end()) + 1 :]
    # The SVG's own style sheet would apply to the whole page.
    inner = re.sub(r"<defs>\s*<style.*?</style>\s*</defs>", "", inner, count=1, flags=re.DOTALL)
    inner = re.sub(r" font-family: [^;\"]*;?", "", inner)
    inner = re.sub(r"#[0-9a-f]{6}\b", lambda c: f"var(--{_NAMES[c[0]]})" if c[0] in _NAMES else c[0], inner)
    inner = _with_own_ids(inner.replace("xlink:href", "href"), key)
    inner = re.sub(r' transform="rotate\(-0 [^"]*\)"', "", inner)
    inner = _PATH.sub(lambda path: f' d="{_steps(path[1])}"', inner)
    inner = _PLACES.sub(
        lambda place: _NUMBER.sub(lambda number: _tenths(10 * float(number[0])), place[0]), inner
    )
    inner = re.sub(r"\s*\n\s*", "\n", inner)
    return f'<svg class="{kind}-picture" {box[0]} role="img" aria-label="{safe(label)}">{inner}'


def _steps(path: str) -> str:
    """Write the path of a line as relative steps in tenths of a point: finer than visible, and half as long."""
    out, pen = [], (0, 0)
    for letter, across, down in _POINT.findall(path):
        at = round(10 * float(across)), round(10 * float(down))
        if letter == "M":
            out.append(f"M{_tenths(at[0])} {_tenths(at[1])}l0 0")
        elif at != pen:
            out.append(f"{_tenths(at[0] - pen[0])} {_tenths(at[1] - pen[1])}")
        pen = at
    return re.sub(r" (?=[-M])", "", " ".join(out))


def _tenths(number: float) -> str:
    """A number of tenths, as short as possible: `-.5`, `12`, `3.4`."""
    return f"{round(number) / 10:g}".replace("0.", ".", 1) if abs(number) < 10 else f"{round(number) / 10:g}"


def _with_own_ids(svg: str, key: str) -> str:
    """Prefix ids that are referred to with `key`, and remove all others."""
    used = set(re.findall(r'(?:href="|url\()#([^")]+)', svg))
    short = {name: f"{key}-{number}" for number, name in enumerate(sorted(used))}
    svg = re.sub(r' id="([^"]*)"', lambda of: f' id="{short[of[1]]}"' if of[1] in short else "", svg)
    return re.sub(r'(href="|url\()#([^")]+)', lambda of: f"{of[1]}#{short[of[2]]}", svg)
