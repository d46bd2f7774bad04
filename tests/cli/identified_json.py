"""The JSON of `identify`, with values that are known and one that is not."""

import json


def identified(path, weighed=False, **changed):
    """Written to `path`, some of it changed; `weighed`: a prior that rests on weight has moved the thrust."""
    known = {"M_u": (111.0, 1.11), "D_u": (56.0, 0.56), "M_w": (130.0, 100.0), "X_udot": (39.0, 1.0)}
    parameters = [
        {
            "name": name, "value": value, "std": std,
            "identifiable": name != "M_w", "reason": "too little" if name == "M_w" else "",
            "given_thrust": 0.9 * value if weighed else value, "given_thrust_std": std,
            "given_thrust_low95": value - 2.0 * std, "given_thrust_high95": value + 2.0 * std,
        }
        for name, (value, std) in known.items()
    ]  # fmt: skip
    data = {
        "method": "likelihood", "outcome": "converged", "configuration": "hovering", "parameters": parameters,
        "dive": {"name": "hovering-7", "sha256": "7" * 64, "date": "2026-11-20"},
        "vehicle": {"name": "ruvifist", "sha256": "0" * 64}, "thrust_scale": {"weighed": weighed},
    }  # fmt: skip
    path.write_text(json.dumps(data | changed), encoding="utf-8")
    return path
