"""The ladder of PIDs, alone and with the feed-forward."""

from bench import ladder

TUNED = ladder.Pid(8.0, 64.0, 0.6)


def test_a_pid_flies_the_same_gains_and_dead_zone_alone_and_beside_the_feed_forward():
    paper, gains = ladder.paper_table(), ladder.table(ladder.Pid(2.0, 4.0, 0.7))
    assert gains["fed"] == {"gain": 1.0, "straight_below_n": 0.7}
    assert gains["straight_below_n"] == 0.7
    assert gains["surge"]["kp"] == [2.0 * gain for gain in paper["surge"]["kp"]]
    assert gains["sway"]["ki"] == [4.0 * gain for gain in paper["sway"]["ki"]]
    assert gains["yaw"] == paper["yaw"]


def test_the_page_gives_both_errors_and_their_ratio():
    flight = {
        name: {"OFF": {"surge": 0.06, "sway": 0.05}, "BOTH": {"surge": 0.005, "sway": 0.004}}
        for name in ("the paper's", "as beside the feed-forward", "tuned")
    }
    page = ladder.lines(TUNED, [flight, flight])
    assert page[-1] == "| tuned | 60.0 | 5.0 | 12.0 | 50.0 | 4.0 | 12.5 |"
    assert "8 times the paper's proportional gain, 64 times its integral" in " ".join(page)
