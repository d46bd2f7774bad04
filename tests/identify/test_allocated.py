"""Gains of a vehicle's own allocation, from drawn commands whose gains are known exactly."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bridge.vehicle.config import load_vehicle
from bridge.vehicle.controller import load_gains
from bridge.vehicle.feedforward import FEEDFORWARD_DOFS
from bridge.vehicle.mode import Mode
from bridge.vehicle.thrusters import Allocator, Pulses, thrust_curve
from identify.dive import Dive, Signal
from identify.thrust.thruster_allocation import allocated_gains

FILE = load_vehicle("ruvifist:hovering")
SHAPE = FILE.vehicle.configurations["hovering"]
CURVE = thrust_curve(FILE.vehicle.thrust_curve, FILE.path.parent)


def commanded(gains, dofs=(0, 1, 2, 3, 4, 5), mode=Mode.OFF):
    """Ten minutes of slow wrenches in some degrees of freedom, allocated by these gains over the curve."""
    thrusters = tuple(
        replace(thruster, gain=gains.get(number, 1.0)) for number, thruster in enumerate(SHAPE.thrusters, 1)
    )
    allocator, table = Allocator(replace(SHAPE, thrusters=thrusters), CURVE), load_gains(SHAPE.gains)
    driven = np.abs(allocator.matrix[list(FEEDFORWARD_DOFS)]).max(axis=0) > 1e-6
    below_n = np.where(driven & mode.applies_feedforward, table.fed.straight_below_n, table.straight_below_n)
    pulses = Pulses(CURVE, below_n)
    time_s = np.arange(0.0, 600.0, 0.25)
    tau = np.zeros((len(time_s), 6))
    for n, dof in enumerate(dofs):
        tau[:, dof] = 0.2 * allocator.reach()[dof] * np.sin(2 * np.pi * time_s / (31.0 + 7.0 * n))
    given = [allocator.allocate(wrench) for wrench in tau]
    return Dive(
        "d",
        Path("d.tlog"),
        "0",
        pwm=Signal(time_s, np.array([pulses(thrust) for thrust, _, _ in given])),
        tau_cmd=Signal(time_s, np.array([wrench for _, wrench, _ in given])),
        ff_mode=Signal(time_s, np.full((len(time_s), 1), float(mode))),
    )


@pytest.mark.parametrize("mode", [Mode.OFF, Mode.BOTH])
@pytest.mark.parametrize("gains", [{}, {1: 0.8}, {2: 0.64, 7: 1.2}], ids=str)
def test_each_thruster_s_gain_is_found_as_the_allocation_has_it(gains, mode):
    allocated = allocated_gains(commanded(gains, mode=mode), FILE, "hovering")
    assert allocated == pytest.approx([gains.get(number, 1.0) for number in range(1, 9)], abs=2e-4)


def test_the_file_s_own_gain_is_part_of_it():
    thrusters = (replace(SHAPE.thrusters[0], gain=0.5), *SHAPE.thrusters[1:])
    shapes = {**FILE.vehicle.configurations, "hovering": replace(SHAPE, thrusters=thrusters)}
    weak = replace(FILE, vehicle=replace(FILE.vehicle, configurations=shapes))
    allocated = allocated_gains(commanded({1: 0.8}), weak, "hovering")
    assert allocated[0] == pytest.approx(0.8, abs=2e-4)


def test_thrusters_that_did_not_push_or_pushed_all_alike_are_not_told():
    allocated = allocated_gains(commanded({1: 0.8}, dofs=(0,)), FILE, "hovering")
    assert np.isnan(allocated).all()
    horizontal = allocated_gains(commanded({1: 0.8}, dofs=(0, 1, 5)), FILE, "hovering")
    assert horizontal[:4] == pytest.approx([0.8, 1.0, 1.0, 1.0], abs=2e-4)
    assert np.isnan(horizontal[4:]).all()


def test_pulses_that_don_t_follow_from_the_wrench_are_of_another_allocation():
    dive = commanded({})
    mixed = dive.pwm.value[:, [3, 0, 1, 2, 4, 5, 6, 7]]
    assert allocated_gains(replace(dive, pwm=Signal(dive.pwm.time_s, mixed)), FILE, "hovering") is None


@pytest.mark.parametrize("lacking", ["pwm", "tau_cmd"])
def test_without_wrench_or_pulses_nothing_is_told(lacking):
    assert allocated_gains(replace(commanded({}), **{lacking: None}), FILE, "hovering") is None
