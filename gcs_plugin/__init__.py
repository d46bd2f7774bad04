"""The ground station: record, replay, parameters (plan, apply, verify, roll back), doctor, the MAVProxy adapter."""
