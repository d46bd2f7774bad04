"""`python -m bridge`, and the script `seatrial-bridge`: the vehicle's program, without the ground's packages."""

from bridge.onboard.program import main

if __name__ == "__main__":
    raise SystemExit(main())
