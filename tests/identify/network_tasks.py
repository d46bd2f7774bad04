"""Dives and readings as the network gets them, and its loss with the weights solved for."""

from dataclasses import replace

import numpy as np
import torch
from fakes.planted import quiet

from bench.missions.mission import draw_one
from bridge.vehicle.config import VehicleFile
from identify.dive import Dive, Signal
from identify.estimators.axes.axis import Axis
from identify.estimators.axes.build import build_axes
from identify.estimators.axes.readings import Channel
from identify.estimators.pinn.parameters import Noise, of_logarithm
from identify.estimators.pinn.training import Point, Task, Trainer, task_of

CPU = torch.device("cpu")


def task_for(dive: Dive, file: VehicleFile, configuration: str) -> Task:
    built = build_axes(dive, file, configuration)
    return task_of(dive, file, configuration, built, CPU, quiet)


def drawn(seed: int, kind: str, seconds: float, fog_gap_s: tuple[float, float] | None = None) -> Task:
    """The task of a drawn mission, its fibre-optic gyro silent in a gap where one is given."""
    mission = draw_one(seed, seconds=seconds, kind=kind)
    dive = mission.dive
    if fog_gap_s is not None:
        silent = (dive.fog.time_s > fog_gap_s[0]) & (dive.fog.time_s < fog_gap_s[1])
        dive = replace(dive, fog=Signal(dive.fog.time_s[~silent], dive.fog.value[~silent]))
    return task_for(dive, mission.file, mission.configuration)


def settled(trainer: Trainer, raw: torch.Tensor, noise: Noise, state: torch.Tensor) -> Point:
    """The point at these values, its weights solved for until they stay."""
    for _ in range(3):
        point = trainer.at(raw, noise, state)
        state = point.equations.state
    return point


def at_row(trainer: Trainer, near: Point, row: torch.Tensor) -> Point:
    """The settled point at raw parameters and logarithms of noise levels in one row, as `Point.where` has them."""
    count = len(near.raw)
    noise = of_logarithm(row[count:], trainer.data.axes)
    return settled(trainer, row[:count], noise, near.equations.state)


def read_by(state_read, time_s, value, scale=None, dof=2):
    """An axis with one channel that was read at these times."""
    n = len(time_s)
    scale = np.ones(n) if scale is None else np.asarray(scale)
    channel = Channel("made up", np.asarray(time_s), np.asarray(value), scale, state_read, 1e-3)
    return Axis(
        dof=dof,
        time_s=np.asarray(time_s),
        step_s=np.zeros(n),
        different_s=np.zeros(0),
        white_times=np.zeros(0),
        step=np.zeros(n, dtype=np.int64),
        reading=np.asarray(value),
        scale=scale,
        state_read=np.full(n, state_read),
        channel=np.zeros(n, dtype=np.int64),
        channels=(channel,),
        initial=np.zeros((1, 4)),
        force=np.zeros((n, 2)),
        coriolis=np.zeros((n, 6)),
        stiffness=0.0,
        speed=np.zeros(n),
        before_filter=np.zeros(n),
    )
