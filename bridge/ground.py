"""The address that may give the vehicle orders."""

from dataclasses import dataclass

STATION_SYSTEM = 255


@dataclass(frozen=True, slots=True)
class Ground:
    """MAVLink address whose writes and commands are accepted; `component` None accepts all of the system."""

    system: int = STATION_SYSTEM
    component: int | None = None

    def gives(self, system: int, component: int) -> bool:
        """Whether an order from this address comes from the ground."""
        return system == self.system and self.component in (None, component)

    def __str__(self) -> str:
        return f"system {self.system}" + ("" if self.component is None else f", component {self.component}")
