"""What accuracy costs in time: references, work-precision, drift over long times."""
