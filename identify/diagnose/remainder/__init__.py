"""What no cause explains: `unexplained`, by `generic_forces`, spectral `lines`, `bursts`, and `slow` forces."""
