"""What a crew does at sea.

`station` from a dive to an upload, `flying` by itself, `gap_monitor` alarms while it dives.
"""
