"""Column maps: which column of a foreign file is which signal.

`column_map` the map · `signals` a dive of streams by the map, `lost_lock`, `units` · `names`, `ranges`, `candidates`
meanings of a column · `profiles`, `time_column`, `proposal`, `proposal_of_runs`, `map_text` a proposed map.
"""
