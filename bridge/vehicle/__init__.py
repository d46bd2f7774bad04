"""What the vehicle is: configuration, coefficients, dynamics, thrusters, references, controller, feed-forward."""
