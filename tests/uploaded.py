"""A verified upload, as its files in a folder of receipts keep it."""

import json
from pathlib import Path

from gcs_plugin.params.last_accepted import keep_accepted
from gcs_plugin.params.receipt import Line, Receipt, next_number
from gcs_plugin.params.sidecar import Sidecar
from gcs_plugin.params.transfer import Outcome


def uploaded(receipts: Path, time: str, sidecar: Sidecar, **values: float) -> Path:
    """Keep an upload begun at `time`, as in a file's name; return its -before.param."""
    receipts.mkdir(exist_ok=True)
    preimage = receipts / f"{time}-before.param"
    lines = tuple(
        Line(name, 1.0, value, value, Outcome.APPLIED, "")
        for name, value in (values or {"FF1_M_U": 111.0}).items()
    )
    receipt = Receipt(Outcome.APPLIED, "", 1, 1, lines, preimage, None, "", 1.0, "", next_number(receipts))
    keep_accepted(receipt, sidecar, True)
    (receipts / f"{time}-receipt.json").write_text(json.dumps(receipt.to_json()), encoding="utf-8")
    return preimage
