"""The proof of the diagnosis: hundreds of dives with hidden effects, diagnosed and judged, compared with rival
methods."""
