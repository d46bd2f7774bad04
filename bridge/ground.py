"""Who gives the vehicle orders."""

from dataclasses import dataclass

STATION_SYSTEM = 255


@dataclass(frozen=True, slots=True)
class Ground:
    """The MAVLink address whose writes and commands are taken; any component of the system where it is None."""

    system: int = STATION_SYSTEM
    component: int | None = None

    def gives(self, system: int, component: int) -> bool:
        """Whether an order from that address is the ground's."""
        return system == self.system and self.component in (None, component)

    def __str__(self) -> str:
        return f"system {self.system}" + ("" if self.component is None else f", component {self.component}")
