"""What the network's other forms are made of, against exact answers; and each of them answers a mission."""

import math
from importlib import import_module

import numpy as np
import pytest
import torch
from torch import Tensor, nn

from bench.accuracy_trials import Bound, Stated, Trial
from bench.forms import left_out, shooting
from bench.forms.disturbance import Disturbance
from bench.forms.integration import coriolis_terms, integrated
from bench.forms.judge import FORMS, Judged, leaning, relative
from bench.forms.page import record
from bench.forms.physics import FINE, UNDER_ONE, Coefficients, accelerations, misfit
from bench.forms.reasons import MECHANISMS, standing, why
from bench.forms.task import STEP_S, Task, hermite, task_of
from bench.forms.training import SETTLED, Budget, by_adam, by_lbfgs
from bench.forms.waves import Waves
from bench.missions.mission import Mission, draw_one
from bench.tally import tally
from bridge.vehicle.dynamics import coriolis

FEW_SECONDS = 20.0


@pytest.fixture(scope="module")
def mission() -> Mission:
    return draw_one(100_002, seconds=60.0)


@pytest.fixture(scope="module")
def task(mission: Mission) -> Task:
    return task_of(mission)


def test_the_terms_of_coriolis_are_those_of_the_bridge() -> None:
    rng = np.random.default_rng(1)
    mass, nu = rng.uniform(1, 9, 6), rng.standard_normal(6)
    found = np.zeros(6)
    for (i, j, k, m), sign in zip(*coriolis_terms(), strict=True):
        found[i] += sign * mass[j] * nu[k] * nu[m]
    assert found == pytest.approx(coriolis(mass.tolist(), nu.tolist()))


def test_a_constant_push_ends_in_the_exact_exponential() -> None:
    mass, damping, push = 20.0, 8.0, 4.0
    steps = 100
    path = integrated(
        torch.zeros(1, 1, dtype=torch.float64),
        torch.full((1, 2 * steps + 1, 1), push, dtype=torch.float64),
        torch.full((6,), mass, dtype=torch.float64),
        torch.tensor([damping], dtype=torch.float64),
        torch.zeros(1, 2 * steps + 1, 6, dtype=torch.float64),
        (0,),
        STEP_S,
    )
    time_s = STEP_S * np.arange(steps + 1)
    exact = push / damping * (1 - np.exp(-damping / mass * time_s))
    assert path[0, :, 0].numpy() == pytest.approx(exact, abs=1e-9)


def test_the_way_back_through_an_integration_is_its_exact_slope() -> None:
    torch.manual_seed(2)
    steps = 5
    free = [torch.randn(2, 4), torch.randn(2, 2 * steps + 1, 4), 1 + torch.rand(6), 0.5 + torch.rand(4)]
    inputs = [x.double().requires_grad_() for x in free]
    others = torch.zeros(2, 2 * steps + 1, 6, dtype=torch.float64)
    others[..., 3], others[..., 4] = 0.3, -0.2

    def path(start: Tensor, drive: Tensor, mass: Tensor, damping: Tensor) -> Tensor:
        return integrated(start, drive, mass, damping, others, (0, 1, 2, 5), STEP_S)

    assert torch.autograd.gradcheck(path, inputs)


def test_a_coloured_disturbance_is_as_rough_as_its_white_numbers(task: Task) -> None:
    disturbance = Disturbance(task, 3)
    torch.manual_seed(3)
    white = torch.randn(disturbance.instants, len(task.dofs), dtype=torch.float64, requires_grad=True)
    slow = disturbance.coloured(white)
    rough = disturbance.roughness(slow)
    assert float(rough.detach()) == pytest.approx(0.5 * float(white.detach().square().sum()))
    (slope,) = torch.autograd.grad(rough, white)
    assert slope.numpy() == pytest.approx(white.detach().numpy())


def test_a_disturbance_is_straight_between_its_instants(task: Task) -> None:
    disturbance = Disturbance(task, 4)
    slow = torch.arange(disturbance.instants, dtype=torch.float64)[:, None]
    halves = torch.arange(2 * task.steps + 1, dtype=torch.float64)
    assert disturbance.at_halves(slow)[:, 0].numpy() == pytest.approx(halves.numpy() / 8)


def test_a_cubic_is_read_exactly_between_two_instants() -> None:
    share = np.linspace(0, 1, 7)
    time_s = STEP_S * np.array([0.0, 1.0])

    def cubic(t: np.ndarray) -> np.ndarray:
        return 2 - t + 30 * t**2 - 500 * t**3

    ends, slopes = cubic(time_s), -1 + 60 * time_s - 1500 * time_s**2
    read = hermite(share) @ np.array([ends[0], slopes[0], ends[1], slopes[1]])
    assert read == pytest.approx(cubic(STEP_S * share))


def test_a_network_of_waves_begins_where_it_is_told_and_knows_its_slope() -> None:
    steps = 1000
    waves = Waves(steps, STEP_S, 1.0, torch.tensor([0.3, 0.3], dtype=torch.float64), 2.0, 8)
    time_s = STEP_S * torch.arange(steps + 1, dtype=torch.float64)
    wanted = torch.stack([torch.cos(0.5 * time_s), torch.exp(-0.1 * time_s)], dim=1)
    waves.begin_at(wanted)
    value, slope = (x.detach().numpy() for x in waves())
    assert value == pytest.approx(wanted.numpy(), abs=0.02)
    nn.init.normal_(waves.last.weight)
    value, slope = (x.detach().numpy() for x in waves())
    between = (value[2:] - value[:-2]) / (2 * STEP_S)
    assert slope[1:-1] == pytest.approx(between, abs=0.05 * float(np.abs(slope).max()))


def test_readings_lie_as_far_from_the_true_motion_as_their_noise(mission: Mission, task: Task) -> None:
    dofs = list(task.dofs)
    start_s = mission.time_s[-1] - STEP_S * task.steps
    start_s = 0.1 * math.floor(start_s / 0.1 + 1e-6)
    halves_s = start_s + 0.5 * STEP_S * np.arange(2 * task.steps + 1)

    def at(values: np.ndarray) -> Tensor:
        return torch.from_numpy(
            np.column_stack([np.interp(halves_s, mission.time_s, values[:, dof]) for dof in range(6)])
        )

    given = Coefficients(task)
    with torch.no_grad():
        for fine, truth, start in (
            (given.fine_mass, mission.drawn.mass, task.mass),
            (given.fine_damping, mission.drawn.damping[dofs], task.damping),
        ):
            fine.copy_((torch.log(torch.expm1(torch.from_numpy(truth) / start)) - UNDER_ONE) / FINE)
        given.fine_trim.copy_(torch.from_numpy(mission.drawn.trim[dofs]) / task.trim / FINE)
        drive = given.drive(at(mission.disturbance / mission.drawn.mass)[:, dofs])
        nu = at(mission.nu)[::2, dofs]
        rate = accelerations(task, given, nu, drive[::2], task.others[::2])
        missed = float(misfit(task, nu, rate))
    count = len(task.instants.value)
    count += len(task.means.value) if task.means is not None else 0
    count += len(task.depths.value) if task.depths is not None else 0
    assert missed == pytest.approx(0.5 * count, rel=0.15)


def test_coefficients_begin_where_the_task_says(task: Task) -> None:
    given = Coefficients(task)
    assert given.mass.detach().numpy() == pytest.approx(task.mass.numpy())
    assert given.damping.detach().numpy() == pytest.approx(task.damping.numpy())
    assert float(given.prior().detach()) == pytest.approx(0.0)


def test_segments_share_their_ends_and_the_last_one_holds_still() -> None:
    places = shooting.places_of(steps=70, segments=2)
    assert int(places[0, -1]) == int(places[1, 0]) == 2 * shooting.SEGMENT_STEPS
    assert int(places.max()) == 140
    assert places.shape == (2, 2 * shooting.SEGMENT_STEPS + 1)


@pytest.mark.parametrize("trained", ["adam", "lbfgs"])
def test_training_stops_by_itself_at_the_least_loss(trained: str) -> None:
    x = nn.Parameter(torch.tensor([3.0, -2.0], dtype=torch.float64))

    def loss() -> Tensor:
        return (x - torch.tensor([1.0, 1.0], dtype=torch.float64)).square().sum()

    budget = Budget(FEW_SECONDS)
    reason, _ = by_adam(loss, [([x], 0.05)], budget) if trained == "adam" else by_lbfgs(loss, [x], budget)
    assert reason == SETTLED
    assert x.detach().numpy() == pytest.approx([1.0, 1.0], abs=0.05)
    assert budget.spent_s < FEW_SECONDS


@pytest.mark.parametrize("form", FORMS)
def test_every_form_answers_a_mission(form: str, task: Task) -> None:
    torch.manual_seed(0)
    found = import_module(FORMS[form]).fit(task, 1.0)
    assert set(found.values) == {"M_u", "M_v", "M_w", "I_r", "D_u", "D_v", "D_w", "D_r"}
    assert all(math.isfinite(value) and value > 0 for value in found.values.values())
    assert found.steps > 0


def test_one_axis_alone_is_scored_as_the_whole_covariance_does() -> None:
    rng = np.random.default_rng(5)
    count, h, std, slow_s, variance, mass, damping = 30, 0.2, 0.05, 2.0, 1e-4, 12.0, 9.0
    time_s = h * np.arange(count)
    reading = 0.1 * rng.standard_normal(count)
    rate, keep = damping / mass, 1 / slow_s
    apart = np.abs(time_s[:, None] - time_s)
    own = std**2 / (rate**2 - keep**2) * (np.exp(-keep * apart) - keep / rate * np.exp(-rate * apart))
    # The filter begins with a wide velocity that the acceleration does not know of.
    begin = np.exp(-rate * time_s)
    gain = (np.exp(-keep * time_s) - begin) / (rate - keep)
    both = std**2 / (rate + keep)
    start = (left_out.WIDE - both / rate) * np.outer(begin, begin)
    start -= both * (np.outer(begin, gain) + np.outer(gain, begin))
    covariance = own + start + variance * np.eye(count)
    step_s = np.concatenate([[0.0], np.full(count - 1, h)])
    squares, spread = left_out.scored(step_s, np.zeros(count), reading, variance, std, slow_s, mass, damping)
    assert squares == pytest.approx(0.5 * reading @ np.linalg.solve(covariance, reading))
    assert spread == pytest.approx(0.5 * np.linalg.slogdet(covariance)[1])


def test_a_fitted_disturbance_weighs_the_inertia_wrong_and_an_integrated_one_right() -> None:
    fitted, integrated_out = left_out.of_mission(draw_one(100_002))["yaw"]
    assert fitted > 1.2
    assert integrated_out == pytest.approx(1.0, abs=0.1)


def test_the_record_says_who_erred_by_how_much_and_what_was_left_out() -> None:
    bound = Bound(7, "spin", 100.0, {"M_u": 50.0, "D_u": 10.0}, {"M_u": 0.01, "D_u": 0.02})
    nan = math.nan
    stated = {"M_u": Stated(50.0 * math.exp(0.03), nan, nan, False), "D_u": Stated(10.0, nan, nan, False)}
    trial = Trial(7, "strong form", stated, (), SETTLED, 60.0)
    one = Judged("strong form", tally("strong form", [bound], [trial]), 1)
    assert leaning(one.masses) == pytest.approx(3.0)
    assert relative(one.masses) == pytest.approx(math.expm1(0.03))
    page = record([bound], [trial], [one], {7: {"surge": (1.2, 1.0)}})
    assert (
        "| strong form | 0 | 2.12 (2.22) | 3.00 | +3.00 | 0.00 | +0.00 | 3.0 % | 0.0 % | 1 of 1 | 60.0 |"
        in page
    )
    assert "| 7, spin, 100 s | 2.12 |" in page
    assert "| 7 | 1.20 -> 1.00 |" in page


def _judged(method: str, error: float) -> Judged:
    bound = Bound(7, "spin", 100.0, {"M_u": 50.0}, {"M_u": 0.01})
    stated = {"M_u": Stated(50.0 * math.exp(0.01 * error), math.nan, math.nan, False)}
    trial = Trial(7, method, stated, (), SETTLED, 60.0)
    return Judged(method, tally(method, [bound], [trial]), 1 if method in FORMS else None)


@pytest.mark.parametrize(
    ("errors", "who"),
    [
        ((2.0, 3.0), "All 2 forms err"),
        ((0.5, 3.0), "Of the 2 forms, 1 errs"),
        ((0.5, 0.6), "No form errs"),
    ],
)
def test_who_errs_more_is_what_the_tallies_say(errors: tuple[float, float], who: str) -> None:
    found = [_judged("neural ODE", errors[1]), _judged("pinn", 1.0), _judged("strong form", errors[0])]
    words = " ".join(standing(found))
    assert f"{who} by more than `pinn`." in words
    assert words.index("strong form") < words.index("neural ODE")


def test_a_forms_figures_stand_before_its_mechanism() -> None:
    missed = _judged("strong form", -2.5)
    words = " ".join(" ".join(why([missed], {7: {"surge": (1.2, 1.0)}, 8: {"surge": (1.4, 1.0)}})).split())
    assert "**Strong form.** Rms error over the bound 2.50; masses lean by M_u -2.5 bounds; settled" in words
    assert "on the mean over missions: surge 1.30 (integrated out: 1.00)." in words


def test_no_words_rank_a_form_without_its_figures() -> None:
    for words in MECHANISMS.values():
        assert not any(
            rank in words for rank in ("the best of", "closest", "any other form", "lost", "loses")
        )
    assert set(MECHANISMS) == set(FORMS)
