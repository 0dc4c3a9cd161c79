"""Where the data that comes with the library lies: beside the package, or in a clone."""

from pathlib import Path


def shipped(name: str) -> Path:
    """Return the path of a shipped file, such as "twolink.urdf"."""
    package = Path(__file__).parent
    installed = package / "models" / name
    return installed if installed.exists() else package.parent / "models" / name
