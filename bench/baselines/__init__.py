"""What others would do with a dive, each as `estimate(dive, file, configuration, progress) -> Identification`."""
