"""The simulated vehicle as seen from the ground: dives recorded by the real recorder, and a link that runs it."""

import shutil
from collections.abc import Callable, Sequence
from pathlib import Path

from bridge.clock import SimulatedClock
from bridge.links.link import Link, Wrapper, memory_pair
from bridge.onboard.parameters import ParameterServer, parameters_of
from bridge.simulator.body import Start
from bridge.simulator.dive import WARM_UP_S, SimulatedVehicle, disarm, simulate_dive
from bridge.simulator.missions import AFLOAT_M
from bridge.simulator.truth import Truth, load_truth
from bridge.vehicle.config import VehicleFile
from bridge.vehicle.legs import Mission
from bridge.vehicle.mode import Mode
from gcs_plugin.dives.folder import DiveFolder, about_vehicle, new_folder
from gcs_plugin.recording.recorder import Recorder


def record_dive(
    file: VehicleFile,
    configuration: str,
    mission: Mission,
    root: Path,
    *,
    seed: int,
    unix_s: float,
    mode: Mode | None,
    parameters: ParameterServer | None = None,
    truth: Truth | None = None,
    progress: Callable[[float], None] = lambda _: None,
    links: Sequence[Link] = (),
    pace: Callable[[float], None] = lambda _: None,
) -> DiveFolder:
    """Dive a mission into a new folder under `root`; the recorder reads the vehicle's link tick by tick.

    The vehicle boots at `unix_s`. Give it the present, so that the dive comes after the uploads for it; if
    simulated faster than real time, it ends later than now.
    `mode` None leaves FF_MODE as in the parameters, `parameters` None those that the vehicle starts with, which are
    not stored; `truth` None means the truth file next to the vehicle file.
    `links` get the same frames, `pace` may delay a tick.
    """
    truth, parameters = truth or load_truth(file, configuration), parameters or parameters_of(file, None)
    applied = Mode(parameters.mode) if mode is None else mode
    folder = new_folder(root, unix_s, f"{mission.name}-{applied.word}")
    notes = f"simulated, seed {seed}"
    folder.describe(about_vehicle(file, configuration, notes))
    clock = SimulatedClock(unix_at_boot_s=unix_s)
    near, far = memory_pair()
    troubles: list[str] = []
    recorder = Recorder(
        [far],
        folder.open_telemetry,
        clock,
        lambda: shutil.disk_usage(folder.path).free,
        lambda notice: troubles.append(notice.sentence),
    )

    def record(boot_s: float) -> None:
        clock.advance_to(boot_s)
        while recorder.step(0.0):
            pass
        pace(boot_s)

    share = 0.0

    def advance(done: float) -> None:
        nonlocal share
        share = done
        progress(done)

    try:
        simulate_dive(
            file,
            configuration,
            mission,
            seed=seed,
            sink=lambda *_: None,  # the frames reach the recorder through a link
            parameters=parameters,
            mode=mode,
            truth=truth,
            unix_at_boot_s=unix_s,
            links=[near, *links],
            pace=record,
            progress=advance,
            after=disarm,
        )
    finally:
        recorder.close()
        if not clock.boot_s():
            folder.discard(notes)
        elif share < 1.0:
            begun_s, whole_s = clock.boot_s(), WARM_UP_S + mission.duration_s
            folder.add_event(clock.unix_s(), f"cut short: {begun_s:.0f} s of {whole_s:.0f} s were dived")
    for trouble in troubles:
        folder.add_event(clock.unix_s(), trouble)
    return folder


class AlongsideLink(Wrapper):
    """The ground's end of a link to an idle simulated vehicle, which keeps running while the ground waits for it."""

    def __init__(self, vehicle: SimulatedVehicle, ground: Link) -> None:
        super().__init__(ground)
        self.name, self.vehicle = "simulated", vehicle

    def read(self, timeout_s: float) -> bytes:
        until_s = self.vehicle.clock.boot_s() + timeout_s
        data = self._link.read(0.0)
        while not data and self.vehicle.clock.boot_s() < until_s:
            self.vehicle.rest()
            data = self._link.read(0.0)
        return data


def afloat(
    file: VehicleFile,
    configuration: str,
    seed: int,
    parameters: ParameterServer,
    unix_s: float = Start.unix_at_boot_s,
) -> tuple[AlongsideLink, SimulatedClock]:
    """A link to a vehicle that lies disarmed at the surface and boots at `unix_s`, and its clock."""
    near, far = memory_pair()
    start = Start(seed, AFLOAT_M, unix_at_boot_s=unix_s)
    vehicle = SimulatedVehicle(file, configuration, [near], start, parameters)
    return AlongsideLink(vehicle, far), vehicle.clock
