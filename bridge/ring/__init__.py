"""The ring: the vehicle's own bounded recording of the frames it sends, so that a dive without a link is not lost."""
