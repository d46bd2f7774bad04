"""The screens; `table` lists them: `watch` · `dives` · `identify` · `diagnose` · `parameters` · `validate` · `fly`.

`watch_lines`, `dives_lines`, `diagnose_lines`, `identify_lines`, `identify_progress`, `parameters_lines`,
`parameters_table`, `parameters_in_file` have the text of the five that have most of it.
Shared: `frame` base of all · `on_dive` base of those that run a verb on a dive · `overlays` help, questions, forms,
`connect` the box that connects · `parameters_transfer` upload and roll back · `strip_chart`.
"""
