"""Points where the paper's numbers contradict one another, each with its arithmetic, and numbers that do agree."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from bench.reproduce import published as paper
from bridge.vehicle.references import DoubleS
from identify.words import count, fixed, significant

STEP_S = 0.01
FRESH_WATER_KG_M3 = 998.2


def longest_distance(samples: float, rate_hz: float, speeds_m_s: Sequence[float]) -> float:
    """Longest total distance, m, of equal laps, one per speed, within that many samples if none is dropped."""
    return len(speeds_m_s) * samples / rate_hz / sum(1 / speed for speed in speeds_m_s)


def acceleration_error(
    missing_kg: float, used_kg: float, damping: float, speed_m_s: float, transient_s: float
) -> float:
    """Mean |v_d - v| in m/s during a double-S acceleration when the feed-forward lacks part of the mass.

    M e_dot + D e = (M - X) v_d_dot for tau = X v_d_dot + D v_d, M = X + missing; the desired acceleration is held
    over steps of 10 ms.
    """
    total = used_kg + missing_kg
    profile = DoubleS(0.0, speed_m_s, transient_s)
    keep = math.exp(-damping / total * STEP_S)
    steps = round(transient_s / STEP_S)
    error = total_error = 0.0
    for k in range(steps):
        slope = profile.at((k + 0.5) * STEP_S)[1]
        before, error = error, keep * error + (1 - keep) * missing_kg * slope / damping
        total_error += 0.5 * (before + error)
    return total_error / steps


def mass_left_out(
    mean_error_m_s: float, used_kg: float, damping: float, speed_m_s: float, transient_s: float
) -> float:
    """Mass, kg, missing from the feed-forward that explains the given mean error while speeding up (by bisection)."""
    low, high = 0.0, 1e3
    for _ in range(60):
        middle = 0.5 * (low + high)
        if acceleration_error(middle, used_kg, damping, speed_m_s, transient_s) < mean_error_m_s:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


def hotel_over_thrusters(power_ratio: float, thruster_ratio: float) -> float:
    """Constant load that reduces the thrusters' power ratio to a total of `power_ratio`.

    It is relative to the thrusters' power before the rise: (hotel + thruster_ratio) / (hotel + 1) = power_ratio.
    """
    return (thruster_ratio - power_ratio) / (power_ratio - 1)


def propeller_power(thrust_n: float, inflow_m_s: float, disc_m2: float) -> float:
    """Ideal power, W, of a propeller in water that flows in at `inflow_m_s`: momentum theory (Rankine 1865)."""
    half = 0.5 * inflow_m_s
    return thrust_n * (half + math.sqrt(half**2 + thrust_n / (2 * FRESH_WATER_KG_M3 * disc_m2)))


def steady_share(acceleration: float, steady: float, deceleration: float, overall: float) -> float:
    """Share of steady time that yields `overall` from the three, for equally long acceleration and deceleration."""
    moving = (overall - steady) / (acceleration + deceleration - 2 * steady)
    return 1 - 2 * moving


def lstm_weights(inputs: int, hidden: int, depth: int, head: int, outputs: int) -> int:
    """Number of trainable weights of an LSTM of `depth` layers (PyTorch's: two biases a gate) and two linear layers."""
    first = 4 * hidden * (inputs + hidden + 2)
    further = (depth - 1) * 4 * hidden * (2 * hidden + 2)
    return first + further + (hidden + 1) * head + (head + 1) * outputs


PROPELLERS, DIAMETER_M = 4, 0.076
DISC_M2 = math.pi / 4 * DIAMETER_M**2
"""Four T200 propellers: number, diameter and disc area of those that drive the simulated vehicle forward."""


@dataclass(frozen=True)
class Point:
    """A contradiction in the paper. `says`: the paper's statement. `follows`: the consequence of its own numbers.
    `fits_if` completes the sentence "It fits if ...".
    """

    title: str
    says: str
    follows: str
    fits_if: str
    numbers: dict[str, float]


@dataclass(frozen=True)
class Check:
    """A number that the paper states, and the same number computed from its other numbers."""

    what: str
    stated: str
    computed: str


def points(dry_mass_kg: float) -> tuple[Point, ...]:
    return (added_or_total(dry_mass_kg), *(point() for point in POINTS))


def added_or_total(dry_mass_kg: float) -> Point:
    """Is X the added mass or the total mass? `dry_mass_kg` is the dry mass of the simulated vehicle."""
    x, damping = paper.TABLE_4["X_udot"].value, paper.TABLE_4["D_u"].value
    target, transient_s = paper.HOVERING_TARGET.value, paper.TRANSIENT.value
    stated, lighter = paper.HOVERING_ACCELERATION.value, paper.TABLE_3["X_udot"].value
    left_kg = mass_left_out(stated, x, damping, target, transient_s)
    without = acceleration_error(dry_mass_kg, x, damping, target, transient_s)
    return Point(
        "X, added or total mass",
        "Tables 3 and 4 call X the added mass. Section 4 says that the network estimates the sum of dry and "
        "added mass. Eq. 12 asks for M_A >= 0; Algorithm 1 puts the trained value through softplus, which "
        "keeps that sum above zero and so allows an added mass down to minus the dry mass. Eq. 14 "
        "multiplies X alone by the acceleration. The dry mass is not given.",
        f"With X = {x:.2f} kg in eq. 14 and the campaigns' double-S of {transient_s:g} s to {target:g} m/s, "
        f"the mean error of {stated:.4f} m/s while speeding up in Fig. 15 leaves room for {left_kg:.1f} kg "
        f"that eq. 14 lacks; a dry mass of {dry_mass_kg:g} kg left out would make it {without:.3f} m/s. So "
        "eq. 14 was flown with nearly the whole mass.",
        f"X is the total, and the vehicle weighs less than {lighter:g} kg; or if X is added, and the dry "
        "mass was in the feed-forward that was flown. The simulated vehicle takes X for added, on top of "
        f"{dry_mass_kg:g} kg, and feeds the total forward.",
        {"left_out_kg": left_kg, "error_without_dry_mass_m_s": without},
    )


def yaw_inertia() -> Point:
    damping, lag_s, delay_s = paper.TABLE_3["D_r"].value, paper.HEADING_LAG.value, paper.SURGE_DELAY.value
    most, least = lag_s * damping, (lag_s - delay_s) * damping
    return Point(
        "Yaw inertia",
        "Algorithm 1 returns I_r; neither Table 3 nor Table 4 has it, and eq. 16 does without it.",
        f"Under eq. 16, D_r being right, a heading ramp is followed I_r / D_r late. The {lag_s:.1f} s of "
        f"Fig. 14 and D_r = {damping:g} N m/(rad/s) make I_r = {most:.1f} kg m², or {least:.1f} kg m² where "
        f"{delay_s:.1f} s of it are the thrusters' dead zone, as in surge.",
        "the I_r of Algorithm 1, which is not printed, lies in that range.",
        {"inertia_most_kg_m2": most, "inertia_least_kg_m2": least},
    )


def overshoot() -> Point:
    return Point(
        "Overshoot of the heading",
        "Section 4 explains the overshoot in Fig. 14, like the lag, by the inertia that eq. 16 leaves out, "
        "and calls the divergence temporary.",
        "Integrated from rest to rest, I_r r_dot + D_r r = D_r' r_d gives a turn of D_r' / D_r times the "
        "one asked for, whatever I_r is: the vehicle coasts exactly the angle by which it lagged. With the "
        "feed-forward alone nothing turns it back either, for eq. 16 asks for no moment once the reference "
        "rests.",
        "D_r is higher than the damping that ends the turn, as it comes out where damping grows with the "
        "rate (the quadratic term that eq. 10 leaves out); or if the water turned the vehicle.",
        {},
    )


def measured_velocity() -> Point:
    return Point(
        "Measured or desired velocity",
        "Section 3.3 says that v_d of eqs 14 and 15 comes from the DVL, and its derivative and the yaw rate "
        "of eq. 16 from the IMU.",
        "Then a vehicle at rest measures zero, gets no force and stays at rest: (M - X) v_dot + (D - D') v "
        "= 0 has no reference in it. Figs 12 and 14 to 16, in which the feed-forward alone drives the "
        "vehicle to its target, can't have come about so.",
        "the references were used, as the names and section 3.3's own first paragraph have it.",
        {},
    )


def units_of_the_abstract() -> Point:
    surge, sway = paper.HOVERING_STEADY.value, paper.SWAY_STEADY.value
    ratio = paper.ABSTRACT_SPEED.value / sway
    return Point(
        "Units and bounds of the abstract",
        f"Discrepancies are below {paper.ABSTRACT_SURGE.value:g} N in surge and below "
        f"{paper.ABSTRACT_YAW.value:g} N in heading rotations; velocity errors are about "
        f"{paper.ABSTRACT_SPEED.value:g} m/s in surge and sway.",
        f"A yaw bound is a moment: Fig. 11 has {paper.SHADOW_YAW.value:g} N m. Of the speeds, surge has "
        f"{surge:.4f} m/s and sway {sway:.4f} m/s, {ratio:.0f} times smaller: here the abstract says less "
        "than was reached.",
        "N is read as N m, and 0.03 m/s as surge's alone.",
        {"abstract_over_sway": ratio},
    )


def shadow_in_surge() -> Point:
    damping, speed, apart_n = paper.TABLE_3["D_u"].value, paper.TOP_SPEED.value, paper.SHADOW_SURGE.value
    force, off, alone = damping * speed, apart_n / damping, paper.SURVEY_STEADY.value
    return Point(
        f"{apart_n:.2f} N in surge",
        f"At {speed:g} m/s PID and feed-forward are nearly identical, {apart_n:.2f} N apart on average (Fig. 10).",
        f"D_u times {speed:g} m/s is {force:.1f} N, so that is {100 * apart_n / force:.0f} % of it. As a "
        f"steady offset it would put the feed-forward alone {1000 * off:.0f} mm/s off; Fig. 12 has "
        f"{1000 * alone:.1f} mm/s, which is {alone * damping:.2f} N.",
        f"part of the {apart_n:.2f} N is the PID's own noise, which a mean of magnitudes counts; or if Fig. "
        "12 was slower.",
        {"force_n": force, "share": apart_n / force, "speed_m_s": off, "alone_n": alone * damping},
    )


def shadow_in_yaw() -> Point:
    damping, lasts_s, apart_nm = paper.TABLE_3["D_r"].value, paper.RAMP.value, paper.SHADOW_YAW.value
    moments = {angle: damping * math.radians(angle) / lasts_s for angle in (90, 180, 360)}
    shares = ", ".join(
        f"{100 * apart_nm / moment:.0f} % of the {moment:.1f} N m of {angle}°"
        for angle, moment in moments.items()
    )
    tenth_deg = math.degrees(10 * apart_nm / damping) * lasts_s
    return Point(
        f"{apart_nm:.1f} N m in yaw",
        f"In the {lasts_s:g} s of the ramp PID and feed-forward are nearly equal, {apart_nm:g} N m apart on "
        "average (Fig. 11). The text does not give the angle.",
        f"Over {lasts_s:g} s that is {shares}.",
        "much of it is the PID's own noise, as above. As an error it would be a tenth of the moment only in "
        f"a turn of {tenth_deg:.0f}°.",
        {f"moment_{angle}_deg_nm": moment for angle, moment in moments.items()},
    )


def distance() -> Point:
    samples, rate_hz, stated_m = (
        number.value for number in (paper.SURVEY_SAMPLES, paper.SAMPLE_HZ, paper.SURVEY_DISTANCE)
    )
    speeds, seconds = paper.SURVEY_SPEEDS_M_S, samples / rate_hz
    most_m = longest_distance(samples, rate_hz, speeds)
    needed_s = seconds * stated_m / most_m
    laps = " + ".join(f"1/{speed:g}" for speed in speeds)
    return Point(
        "Distance of the survey",
        f"The same path at {', '.join(f'{speed:g}' for speed in speeds)} m/s, just under {stated_m:g} m in "
        f"all, gave about {count(round(samples))} samples at {rate_hz:g} Hz.",
        f"Those are {count(round(seconds))} s. Laps of length L take L ({laps}), so at most {most_m:.0f} m "
        f"fit, without a moment for changes of speed and turns; {stated_m:g} m take {count(round(needed_s))} "
        "s at least.",
        "samples were dropped before training, for example turns or moments without bottom lock.",
        {"most_m": most_m, "needed_s": needed_s},
    )


def power() -> Point:
    thrust, rise, speed = paper.THRUST_RATIO.value, paper.POWER_RISE.value, paper.POWER_SPEED.value
    each_n, along = (
        paper.TABLE_3["D_u"].value * speed / PROPELLERS,
        speed * math.cos(paper.THRUSTER_ANGLE.value),
    )
    at_rest = thrust**1.5
    moving = propeller_power(thrust * each_n, along, DISC_M2) / propeller_power(each_n, speed, DISC_M2)
    low, high = (hotel_over_thrusters(1 + rise, ratio) for ratio in (moving, at_rest))
    return Point(
        "Power and thrust",
        f"Eq. 17 finds {100 * (thrust - 1):.0f} % more thrust in hovering, supported by {100 * rise:.0f} % "
        f"more power, measured in a transient at {speed:g} m/s.",
        f"The power of an ideal propeller in still water goes with thrust to the power 1.5: {thrust:.3f}^1.5 "
        f"= {at_rest:.2f}, {100 * (at_rest - 1):.0f} % more. With the water streaming in at that speed it is "
        f"{100 * (moving - 1):.0f} % for {PROPELLERS} propellers of {1000 * DIAMETER_M:.0f} mm, as the "
        f"simulated vehicle has. {100 * rise:.0f} % more in all then takes a hotel load of {100 * low:.0f} "
        f"to {100 * high:.0f} % of what the thrusters drew in survey.",
        "the hotel load (computer, DVL, lights) is that large, which at so low a speed it may well be. It "
        "is not given, and without it the one number does not support the other.",
        {"ratio_at_rest": at_rest, "ratio_moving": moving, "hotel_low": low, "hotel_high": high},
    )


def pid_in_both() -> Point:
    target, settled, surge_off = (
        number.value for number in (paper.HOVERING_TARGET, paper.HOVERING_SETTLED, paper.HOVERING_STEADY)
    )
    sway_off, sway_pid = paper.SWAY_STEADY.value, paper.SWAY_PID.value
    implied, d_v = paper.TABLE_4["D_u"].value * target / settled, paper.TABLE_4["D_v"].value
    surge_n, sway_n, would_off = implied * surge_off, d_v * sway_off, sway_pid / d_v
    return Point(
        "What the PID adds to the feed-forward",
        f"With both (Fig. 17) the PID gives {fixed(paper.SURGE_PID.value, 2)} N in surge and {sway_pid:.2f} "
        f"N in sway on average. Alone, the feed-forward is {surge_off:.4f} and {sway_off:.4f} m/s off (Figs "
        "15, 16).",
        f"In surge the force for {target:g} m/s held {settled:g} m/s, so {implied:.1f} N/(m/s) held it back, "
        f"{100 * (target / settled - 1):.0f} % more than Table 4 has, and a PID would have to add "
        f"{surge_n:.2f} N. In sway it would have to add {sway_n:.2f} N; the {sway_pid:.2f} N of Fig. 17 "
        f"would, left out, make {1000 * would_off:.0f} mm/s, {would_off / sway_off:.0f} times the error of "
        "Fig. 16.",
        "the water moved otherwise in that dive (the paper names disturbances), or if the mean is over "
        "transients too; the minus in surge may be a motion astern. Speeds and directions of Fig. 17 are "
        "not given.",
        {"drag": implied, "surge_n": surge_n, "sway_n": sway_n, "sway_off_m_s": would_off},
    )


def loss_without_network() -> Point:
    weights = lstm_weights(
        paper.INPUTS, paper.LSTM_HIDDEN, paper.LSTM_DEPTH, head=paper.HEAD, outputs=paper.OUTPUTS
    )
    return Point(
        "The network's part",
        "Eq. 13 adds the physics' residual and the network's error. Algorithm 1 weighs the latter by alpha, "
        "which eq. 13 lacks and the text does not give.",
        "The residual (line 9) holds the measured v and v_dot and the parameters, and neither the network's "
        f"output nor its weights; the network's error holds no parameter. So the {weights / 1e6:.1f} million "
        "weights of Table 1 have no part in the parameters, which are those of a constrained least-squares "
        "fit, whatever alpha is. The tables above show that fit beside the end of the training.",
        "the network is seen as a second, separate result: a predictor of velocity.",
        {"weights": float(weights)},
    )


def slips() -> Point:
    return Point(
        "Slips that touch the numbers",
        "Section 4 calls the 24.40 kg and 39.60 kg D_u, the caption of Fig. 9 speaks of the survey "
        "configuration, the captions of Figs 15 and 16 of heading.",
        "The text around them discusses masses, the hovering configuration, and speeds in surge and sway.",
        "they are read as X_u, hovering and speed, as they are here.",
        {},
    )


POINTS: tuple[Callable[[], Point], ...] = (
    yaw_inertia,
    overshoot,
    measured_velocity,
    units_of_the_abstract,
    shadow_in_surge,
    shadow_in_yaw,
    distance,
    power,
    pid_in_both,
    loss_without_network,
    slips,
)


def checks() -> tuple[Check, ...]:
    x_survey, x_hovering = paper.TABLE_3["X_udot"].value, paper.TABLE_4["X_udot"].value
    d_survey, d_hovering = paper.TABLE_3["D_u"].value, paper.TABLE_4["D_u"].value
    most_m = longest_distance(paper.HOVERING_SAMPLES.value, paper.SAMPLE_HZ.value, paper.HOVERING_SPEEDS_M_S)
    fallen_short = paper.HOVERING_TARGET.value - paper.HOVERING_SETTLED.value
    rounded_rise = 1.33
    return (
        Check("Rise of X_u", _per_cent(paper.MASS_RISE.value), _per_cent(x_hovering / x_survey - 1)),
        Check("Rise of D_u", _per_cent(paper.DRAG_RISE.value), _per_cent(d_hovering / d_survey - 1)),
        Check(
            f"Eq. 17: {rounded_rise} / cos 34°",
            fixed(paper.THRUST_RATIO.value, 3),
            fixed(rounded_rise / math.cos(paper.THRUSTER_ANGLE.value), 3),
        ),
        Check(
            "Fig. 15: target less settled speed",
            f"{paper.HOVERING_STEADY.value:.4f} m/s",
            f"{fallen_short:.4f} m/s",
        ),
        Check(
            f"Hovering: metres in {count(round(paper.HOVERING_SAMPLES.value))} samples",
            f"around {paper.HOVERING_DISTANCE.value:g} m",
            f"at most {significant(most_m)} m",
        ),
        *(
            Check(
                f"Table 5, {axis}: overall from the phases",
                f"{paper.TABLE_5[axis, 'Overall']:.4f} m/s",
                f"the same, with {100 * _steady(axis):.0f} % of the time steady",
            )
            for axis in ("surge", "sway")
        ),
    )


def _steady(axis: str) -> float:
    acceleration, steady, deceleration, overall = (
        paper.TABLE_5[axis, phase] for phase in ("Acceleration", "Steady state", "Deceleration", "Overall")
    )
    return steady_share(acceleration, steady, deceleration, overall)


def _per_cent(ratio: float) -> str:
    return f"{fixed(100 * ratio, 2)} %"
