"""The proof of the diagnosis: hundreds of dives with hidden effects, answered and judged, beside rival methods."""
