"""A campaign of random scenes, each simulated and held against the laws of mechanics."""
