"""The screens, each with its text in a module of its own (NAME_lines).

`table` lists them: `watch` · `dives` · `identify` · `diagnose` · `parameters` · `validate`. Shared: `frame` base of all
· `on_dive` base of those that run a verb on a dive · `asking` questions · `transfer` upload and roll back · `panes`
sensors, thrusters, messages · `strip_chart` · `help`.
"""
