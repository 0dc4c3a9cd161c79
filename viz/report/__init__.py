"""The report: one self-contained page of what was checked, simulated, measured, and how well."""
