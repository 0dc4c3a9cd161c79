"""Drawing: takes a Chain and a Trajectory, gives pictures. The library does not know it."""
