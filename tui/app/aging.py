"""Aging of the picture itself: when the engine falls silent, no number may stay bright."""

from dataclasses import replace

from gcs_plugin.watch.picture import Freshness, Picture

STALE_S, GONE_S = 3.0, 10.0


def aged(picture: Picture, behind_s: float) -> Picture:
    """Return the picture as it looks `behind_s` after it was made."""
    picture = replace(
        picture,
        armed_age_s=picture.armed_age_s + behind_s,
        ff_mode_age_s=picture.ff_mode_age_s + behind_s,
        active_set_age_s=picture.active_set_age_s + behind_s,
        links=tuple(
            replace(link, age_s=link.age_s + behind_s, lost=link.lost or behind_s > STALE_S)
            for link in picture.links
        ),
    )
    if behind_s <= STALE_S:
        return picture

    def older(freshness: Freshness) -> Freshness:
        return Freshness.GONE if behind_s > GONE_S or freshness is Freshness.GONE else Freshness.STALE

    return replace(
        picture,
        sensors=tuple(
            replace(row, age_s=row.age_s + behind_s, freshness=older(row.freshness))
            for row in picture.sensors
        ),
        traces={
            key: replace(trace, age_s=trace.age_s + behind_s, freshness=older(trace.freshness))
            for key, trace in picture.traces.items()
        },
        thrusters=tuple(
            replace(row, age_s=row.age_s + behind_s, freshness=older(row.freshness))
            for row in picture.thrusters
        ),
    )
