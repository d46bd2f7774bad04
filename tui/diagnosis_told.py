"""A diagnosis as `diagnose --json` writes it: the answer, followed by the texts and values shown on a page."""

from typing import Any

from identify.diagnose import wording, wording_verdict
from identify.diagnose.result import Diagnosis, Finding, by_axis, plain


def with_words(found: Diagnosis, check: str = "") -> dict[str, Any]:
    """Add `told` to `plain`: sentences, evidence in nats, drifts of the dive itself. `check`: the check dive."""
    after = [item.total for item in found.gap.after if item.horizon_s == wording.DRIFT_S]
    more = {
        "dive": found.dive,
        "check": check,
        "configuration": found.configuration,
        "verdict": wording_verdict.verdict_sentence(found),
        "after": after[0] if after else None,
        "causes": [_cause(item) for item in found.findings],
        "tried": [
            {"name": wording.candidate_words(item.effect), "gain_nats": item.gain_nats, "why": item.why}
            for item in found.tried
            if not item.accepted and item.gain_nats > 0
        ],
        "heldout": None
        if found.heldout is None
        else {
            "before": found.heldout.before,
            "after": found.heldout.after,
            "by_axis": by_axis(found.heldout),
        },
        "disturbance": wording.disturbance_line(found.gap.disturbance),
        "character": wording_verdict.character_lines(found),
        "next": wording.next_lines(found),
        "notes": found.notes,
    }
    return {**plain(found), "told": more}


def _cause(one: Finding) -> dict[str, Any]:
    return {
        "name": wording.name_of(one),
        "gain_nats": one.gain_nats,
        "sentence": wording.cause_sentence(one),
        "alike": wording.alike_sentence(one) if one.also else "",
        "values": [wording.value_words(name, value) for name, value in wording.told_parameters(one).items()],
    }
