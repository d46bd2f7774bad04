# SPDX-License-Identifier: GPL-3.0-or-later
"""seatrial inside MAVProxy: `mavproxy.py --load-module=gcs_plugin.mavproxy`, then `seatrial help`.

Licence of this package: GPL-3.0-or-later, because it adapts MAVProxy, which is. Nothing else imports it.
"""

from typing import Any

from gcs_plugin.mavproxy.module import SeatrialModule


def init(mpstate: Any) -> SeatrialModule:
    """What MAVProxy calls."""
    return SeatrialModule(mpstate)
