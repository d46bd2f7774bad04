"""Turn the frames of a wet check, live or recorded, into findings."""

from collections.abc import Iterable

from bridge.framing import Frame
from bridge.vehicle.config import VehicleFile
from bridge.vehicle.thrusters import thrust_curve
from gcs_plugin.doctor.findings import Finding
from gcs_plugin.doctor.latency import latencies, latency_findings
from gcs_plugin.doctor.wet import diagnose, findings
from gcs_plugin.doctor.wet_record import record_of


def wet_findings(file: VehicleFile, configuration: str, frames: Iterable[Frame]) -> list[Finding]:
    """Findings on thrusters, mountings and latencies. Raises LogError if the frames hold no wet check."""
    vehicle = file.vehicle
    shape = vehicle.configurations[vehicle.configuration_named(configuration)]
    curve = thrust_curve(vehicle.thrust_curve, file.path.parent)
    record = record_of(frames, len(shape.thrusters))
    diagnosis = diagnose(vehicle, shape, curve, record)
    late = latency_findings(latencies(vehicle, shape, curve, record, diagnosis))
    return [*findings(diagnosis, vehicle), *late]
