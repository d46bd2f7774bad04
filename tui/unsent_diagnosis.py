"""A diagnosis that was accepted into a file, and that no vehicle was ever sent."""

from collections.abc import Iterator
from pathlib import Path

from bridge.errors import ParamError
from bridge.text import typed
from bridge.vehicle.config import VehicleFile
from gcs_plugin.params.files import SUFFIXES
from gcs_plugin.params.last_accepted import ever_accepted, model_in_force
from gcs_plugin.params.sidecar import Sidecar, read_sidecar, sidecar_path
from identify.diagnose.words.causes import effects_words
from identify.dive import Dive
from identify.validation.against_forecast import began, began_for_receipts
from tui.app.desk import ACCEPTABLE, is_acceptable


def unsent(receipts: Path, dive: Dive, file: VehicleFile, configuration: str) -> tuple[Path, Sidecar] | None:
    """The newest parameter file with causes of this vehicle's configuration that was diagnosed from an earlier dive and
    that no receipt tells of; None without one, and for a dive with causes in force, which the dive itself judges.

    Looked for in this folder, and where the app leaves it beside this dive and its neighbours.
    """
    flown_with = model_in_force(receipts, file.vehicle.name, configuration, began_for_receipts(dive))
    if flown_with is not None and flown_with.sidecar.effects:
        return None
    sent = {model.dive_sha256 for model in ever_accepted(receipts) if model.effects}
    begun = began(dive)
    unsent_models = [
        (path, model)
        for path, model in _models(dive)
        if (model.vehicle, model.configuration) == (file.vehicle.name, configuration)
        and model.effects
        and model.dive_sha256 not in {*sent, dive.sha256}
        and (not (begun and model.dived) or model.dived < begun)
    ]
    return max(unsent_models, key=lambda each: each[0].stat().st_mtime_ns, default=None)


def how_to_send(path: Path, model: Sidecar) -> str:
    """The remedy for an accepted diagnosis that was never sent."""
    return (
        f"by the receipts, what makes up for {effects_words(model.effects)} was never sent: upload it "
        f"({typed('seatrial', 'params', 'upload', _from_here(path))}, in the app Parameters), or diagnose this dive"
    )


def _from_here(path: Path) -> Path:
    """The path as one would type it in this folder."""
    here = Path.cwd()
    return path.relative_to(here) if path.is_relative_to(here) else path


def _models(dive: Dive) -> Iterator[tuple[Path, Sidecar]]:
    here = [path for path in Path().iterdir() if path.suffix in SUFFIXES]
    folder = dive.source if dive.source.is_dir() else dive.source.parent
    neighbours = folder.resolve().parent.glob(f"*/{ACCEPTABLE}")
    in_dives = [path for path in neighbours if is_acceptable(path.parent)]
    for path in (*here, *in_dives):
        if not sidecar_path(path).is_file():
            continue
        try:
            model = read_sidecar(path)
        except ParamError:
            continue
        if model is not None:
            yield path, model
