"""Dives as a stock autopilot records them, each with a drawn vehicle, velocity filter and sea: made, diagnosed, judged."""
