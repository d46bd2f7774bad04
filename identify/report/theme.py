"""The style sheet: dark ink on white and large for the sun, a dark scheme for the night, black on paper.

Every colour has a line style or a shape beside it, so that none has to be told apart by colour. The four line
colours keep a contrast of at least 5 to 1 to their ground in both schemes.
"""

STYLE = """
:root { --ink: #111; --soft: #444; --ground: #fff; --raised: #f1f4f7; --tick: #c9d0d6; --rule: #5a646d;
  --first: #0a4a94; --second: #b03000; --third: #00663c; --fourth: #7a1fa0;
  --alarm: #a30b0b; --alarm-ground: #fdecea; --heat1: #e3edf7; --heat2: #bcd3ea; --heat3: #8fb4dc;
  --heat4: #2a66ad; --heat5: #0a4a94; color-scheme: light dark; }
@media screen and (prefers-color-scheme: dark) {
  :root { --ink: #f2f2f2; --soft: #c4c9ce; --ground: #101418; --raised: #1c2329; --tick: #353e46;
    --rule: #8b959e; --first: #7cc0ff; --second: #ffb070; --third: #7fe0a0; --fourth: #e2a6ff;
    --alarm: #ffa198; --alarm-ground: #3a1513; --heat1: #172a3c; --heat2: #1d3f5e; --heat3: #255780;
    --heat4: #5ea6e8; --heat5: #9dd0ff; } }
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
section > p, section > ul { max-width: 75ch; }
.subtitle { color: var(--soft); margin: .3em 0 0; }
.verdict { font-size: 1.2em; font-weight: 600; margin: 1em 0; padding: .7em .9em; background: var(--raised);
  border-left: 8px solid var(--first); }
.warning { max-width: 85ch; margin: 1em 0; padding: .1em .9em; background: var(--alarm-ground);
  border: 3px solid var(--alarm); border-left-width: 12px; }
.warning p { margin: .6em 0; }
.warning strong { font-size: 1.15em; color: var(--alarm); }
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
table:not(.wide) thead th { white-space: normal; }
.scroll { overflow-x: auto; margin: 1.2em 0; }
tbody th { font-weight: 600; }
figure { display: flow-root; margin: 1.4em 0 2em; }
figcaption { margin-top: .3em; }
.panel { display: block; overflow: visible; margin: 34px 22px 52px 66px; width: calc(100% - 88px);
  font-size: 15px; fill: var(--ink); }
.upper { margin-bottom: 0; }
.title { font-weight: 600; }
.box { fill: none; stroke: var(--rule); }
.tick { stroke: var(--tick); }
.rule { stroke: var(--rule); stroke-width: 1.5; }
.line { fill: none; stroke-width: 2; stroke-linejoin: round; vector-effect: non-scaling-stroke; }
.solid { stroke: var(--first); stroke-linecap: round; }
.dashed { stroke: var(--second); stroke-width: 2.5; stroke-dasharray: 9 5; }
.dotted { stroke: var(--third); stroke-width: 3; stroke-dasharray: 2 5; }
.dashdot { stroke: var(--fourth); stroke-width: 2.5; stroke-dasharray: 12 4 2 4; }
.mark { overflow: visible; fill: var(--ink); stroke: var(--ink); }
.mark text { stroke: var(--ground); stroke-width: 4; paint-order: stroke; font-weight: 600; }
.hollow { fill: var(--ground); stroke: var(--second); stroke-width: 3; }
.legend { display: flex; flex-wrap: wrap; gap: .2em 1.6em; list-style: none; margin: 0 0 0 66px; padding: 0; }
.legend li { display: flex; align-items: center; gap: .5em; }
.grid { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 340px), 1fr)); }
.bars { width: 100%; }
.bars caption { color: var(--ink); font-weight: 600; }
.bars th { font-weight: 400; width: 44%; padding-right: .6em; }
.bars td.number { width: 1%; padding-right: 0; padding-left: .6em; }
.bars td, .bars th { padding-top: .15em; padding-bottom: .15em; vertical-align: middle; }
.filledbar, .hollowbar { display: block; height: .95em; border: 2px solid var(--first); }
.filledbar { background: var(--first); }
.bargrid th { white-space: nowrap; }
.bargrid > div { max-width: 560px; }
.bargrid { gap: .6em 2.4em; margin: 1em 0; }
summary { cursor: pointer; padding: .5em 0; color: var(--first); }
.heat { table-layout: fixed; width: 100%; max-width: 820px; }
.heat tr { height: 2.7em; }
.heat th { font-weight: 600; border: 0; padding: .3em .2em; text-align: center; overflow-wrap: normal; }
.heat th[scope=row] { text-align: left; }
.heat tr > :first-child { width: 7.6em; }
.heat td { text-align: center; padding: .55em .1em; border: 2px solid var(--ground); }
.heat td[class^=heat] { outline: 1px solid var(--tick); outline-offset: -1px; font-weight: 600; }
.heat1 { background: var(--heat1); } .heat2 { background: var(--heat2); } .heat3 { background: var(--heat3); }
.heat4 { background: var(--heat4); color: var(--ground); } .heat5 { background: var(--heat5); color: var(--ground); }
.sum { color: var(--soft); }
@media screen and (max-width: 700px) {
  body { font-size: 17px; padding: 14px 12px 40px; }
  .panel { margin-left: 54px; margin-right: 14px; width: calc(100% - 68px); font-size: 14px; }
  .legend { margin-left: 0; }
  .odd { display: none; }
  table { font-size: 15px; }
  .heat { font-size: 13.5px; }
  .heat tr > :first-child { width: 7em; font-weight: 400; font-size: 12.5px; padding-right: .8em; }
  .heat thead th { font-size: 11.5px; padding: .3em 0; }
  th, td { padding-right: .5em; }
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
  .panel { font-size: 9pt; }
  figure, tr, .verdict, .warning { break-inside: avoid; }
  h2 { break-after: avoid; } }
"""
