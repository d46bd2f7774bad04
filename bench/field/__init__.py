"""Dives as a stock autopilot records them, each with a drawn vehicle, filter and sea: made, diagnosed and judged."""
