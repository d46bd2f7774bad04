"""Colours and style sheet of the page: dark ink on white and large type for the sun, a dark scheme for the night.

The four colours of lines are distinct for readers who see no red, no green or no blue, and keep a contrast of about 5
to 1 to their background in both schemes; each nevertheless has a line style or a shape as well.
"""

LIGHT = {
    "ink": "#111111", "soft": "#444444", "ground": "#ffffff", "raised": "#f1f4f7", "tick": "#c9d0d6", "rule": "#5a646d",
    "first": "#0a4fa3", "second": "#c04600", "third": "#1a1a1a", "fourth": "#007d67",
    "alarm": "#a30b0b", "alarm-ground": "#fdecea",
    "heat0": "#fbfcfd", "heat1": "#e3edf7", "heat2": "#bcd3ea", "heat3": "#8fb4dc",
    "heat4": "#2a66ad", "heat5": "#0a4a94",
}  # fmt: skip
"""By name. All differ, because `picture` finds the name of a colour in the drawn SVG."""

DARK = {
    "ink": "#f2f2f2", "soft": "#c4c9ce", "ground": "#101418", "raised": "#1c2329", "tick": "#353e46", "rule": "#8b959e",
    "first": "#6db8ff", "second": "#ff9a4d", "third": "#f4f4f4", "fourth": "#2fc7a4",
    "alarm": "#ffa198", "alarm-ground": "#3a1513",
    "heat0": "#12171b", "heat1": "#172a3c", "heat2": "#1d3f5e", "heat3": "#255780",
    "heat4": "#5ea6e8", "heat5": "#9dd0ff",
}  # fmt: skip


def _variables(colours: dict[str, str]) -> str:
    return " ".join(f"--{name}: {colour};" for name, colour in colours.items())


STYLE = (
    f"""
:root {{ {_variables(LIGHT)} color-scheme: light dark; }}
@media screen and (prefers-color-scheme: dark) {{ :root {{ {_variables(DARK)} }} }}
"""
    + """
* { box-sizing: border-box; }
html { -webkit-text-size-adjust: 100%; }
body { margin: 0 auto; max-width: 1240px; padding: 20px 16px 60px; background: var(--ground);
  color: var(--ink);
  font: 18px/1.5 system-ui, "Segoe UI", Roboto, "Helvetica Neue", "Noto Sans", "DejaVu Sans", sans-serif; }
h1 { font-size: 1.9em; line-height: 1.2; margin: 0; }
h2 { font-size: 1.4em; line-height: 1.25; margin: 2.4em 0 .4em; padding-top: .5em;
  border-top: 3px solid var(--ink); }
h1, h2, p, li, caption, figcaption { overflow-wrap: anywhere; }
td, th { overflow-wrap: break-word; }
td.long { overflow-wrap: anywhere; }
section > p, section > ul { max-width: 75ch; }
.subtitle { color: var(--soft); margin: .3em 0 0; }
.verdict { font-size: 1.2em; font-weight: 600; margin: 1em 0; padding: .7em .9em; background: var(--raised);
  border-left: 8px solid var(--first); }
.warning { max-width: 85ch; margin: 1em 0; padding: .1em .9em; background: var(--alarm-ground);
  border: 3px solid var(--alarm); border-left-width: 12px; }
.warning p { margin: .6em 0; }
.warning strong { font-size: 1.15em; color: var(--alarm); }
.judged { padding: .5em .9em; background: var(--raised); border-left: 8px solid var(--fourth); font-weight: 600; }
.judged span { color: var(--fourth); }
.judged.no { background: var(--alarm-ground); border-color: var(--alarm); }
.judged.no span { color: var(--alarm); }
nav ul { display: flex; flex-wrap: wrap; gap: .3em 1.4em; list-style: none; margin: 0; padding: 0; }
a { color: var(--first); }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
caption, figcaption { text-align: left; color: var(--soft); font-size: .92em; max-width: 85ch; }
caption { padding-bottom: .4em; }
table:not(.bars):has(> caption) { min-width: min(100%, 60ch); }
th, td { text-align: left; vertical-align: baseline; padding: .32em 1.1em .32em 0;
  border-bottom: 1px solid var(--tick); }
thead th { border-bottom: 2px solid var(--ink); vertical-align: bottom; line-height: 1.25; }
.number { text-align: right; }
.number, .short { white-space: nowrap; }
.scroll thead th { white-space: normal; }
.scroll { overflow-x: auto; margin: 1.2em 0; }
tbody th { font-weight: 600; }
figure { display: flow-root; margin: 1.4em 0 2em; }
figcaption { margin-top: .3em; }
.wide-picture, .column-picture { display: block; width: 100%; height: auto; stroke-linejoin: round; }
.column-picture { display: none; max-width: 480px; }
@media screen and (max-width: 700px) {
  body { font-size: 17px; padding: 14px 12px 40px; }
  table { font-size: 15px; }
  .wide-picture { display: none; }
  .column-picture { display: block; }
  th, td { padding-right: .5em; }
  td:not(.number):not(.short) { overflow-wrap: anywhere; }
  .wide, .wide tbody, .wide tr, .wide td, .wide th { display: block; }
  .wide caption { display: block; }
  .wide thead { display: none; }
  .wide tr { border-bottom: 2px solid var(--ink); padding: .4em 0; }
  .wide td { display: inline-block; border: 0; padding: .05em 1.2em .05em 0; white-space: normal; }
  .wide td:empty { display: none; }
  .wide td::before { content: attr(data-label) "\\00a0 "; color: var(--soft); font-size: .9em; }
  .wide tbody th { border: 0; padding: .1em 0; } }
@media print {
  body { max-width: none; padding: 0; font-size: 11pt; }
  nav { display: none; }
  figure, tr, .verdict, .warning { break-inside: avoid; }
  h2 { break-after: avoid; } }
"""
)
