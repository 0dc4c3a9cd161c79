"""Pictures of a Chain and a Trajectory. The library does not depend on this package."""
