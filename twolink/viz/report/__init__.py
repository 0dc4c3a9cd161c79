"""The report: one self-contained page of checks, simulations and measurements."""
