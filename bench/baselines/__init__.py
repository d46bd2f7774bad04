"""Other methods' answers to a dive, each as `estimate(dive, file, configuration, progress) -> Identification`."""
