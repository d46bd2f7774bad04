"""Files of other programs, each read into `streams` of named numbers.

`text_table`, `parquet`, `arrays`, `matlab`, `ulog`, `json_lines` the readers, with libraries by `optional_libraries` ·
`tables_of_one_dive` a table a topic · `run_column` runs in one table · `clock` dates and whole seconds ·
`split_stamps` seconds and nanoseconds · `sentinels` numbers for "no reading".
"""
