"""Shipped data: vehicles, thruster curves, column maps. `bridge.vehicle.config.CONFIGS` is its path."""
