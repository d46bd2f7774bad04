# SPDX-License-Identifier: GPL-3.0-or-later
"""seatrial inside MAVProxy: `mavproxy.py --load-module=gcs_plugin.mavproxy`, then `seatrial help`.

`module` what MAVProxy loads · `help_and_completion` of its commands · `recordings` for record · `parameters` for
params · `switching` for ff · `work` for identify and diagnose.

This package is licensed GPL-3.0-or-later, because it adapts MAVProxy, whose licence that is. Nothing else imports it.
"""

from typing import Any

from gcs_plugin.mavproxy.module import SeatrialModule


def init(mpstate: Any) -> SeatrialModule:
    """Entry point that MAVProxy calls."""
    return SeatrialModule(mpstate)
