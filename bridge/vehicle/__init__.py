"""The vehicle model and its control: configuration, coefficients, dynamics, thrusters, references, controller and
feed-forward."""
