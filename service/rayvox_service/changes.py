"""`changes` frames, for the HTTP route and for the stream's subscribers."""

from __future__ import annotations

from rayvox import MapSnapshot

from rayvox_service.frame import encode_frame


def changes_frame(snapshot: MapSnapshot, since: int) -> tuple[bytes, int]:
    """The frame that brings a copy from revision `since` to the snapshot's, and that revision."""
    change = snapshot.changes_since(since)
    fields = {
        "since": change.since,
        "revision": change.revision,
        "full": change.full,
        "resolution_m": snapshot.resolution_m,
        "depth": snapshot.depth,
    }
    # Keys of at most 21 levels fit 32 bits.
    arrays = {
        "region_keys": change.region_keys.astype("<i4"),
        "region_depth": change.region_depth,
        "keys": change.keys.astype("<i4"),
        "leaf_depth": change.leaf_depth,
        "log_odds": change.log_odds,
    }
    return encode_frame("changes", fields, arrays), change.revision
