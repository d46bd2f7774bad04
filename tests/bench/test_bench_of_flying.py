"""The benchmark of flying a plan: its table."""

from bench.flying import lines


def test_the_table_has_medians_and_the_share_of_the_time_by_hand():
    data = {
        "hand_s": 800.0, "known_s": 100.0, "whole_s": 120.0, "identify_s": 0.5, "share": 0.05,
        "hand": {"M_u": 0.013, "D_u": 0.05}, "flown": {"M_u": 0.003, "D_u": 0.012},
    }  # fmt: skip
    results = {f"{c} {n}": data for c in ("survey", "hovering") for n in range(3)}
    results["hovering 1"] = data | {"known_s": 90.0}
    page = "\n".join(lines(results))
    assert "| hovering | 3 | 5.0% | 800 s | 100 s | 1/8.0 | 120 s |" in page
    assert "| survey | M_u | D_u |" in page
    assert "| flown | 0.3 | 1.2 |" in page
    assert "took 0.5 s on average" in " ".join(page.split())
