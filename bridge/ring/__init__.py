"""The ring: the vehicle's own recording of what it sends, bounded, so that a dive without a link is not lost."""
