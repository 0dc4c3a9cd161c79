"""Paths of the library's data, in an installation or in a clone."""

from pathlib import Path


def data_path(name: str) -> Path:
    """Return the path of a data file of the library, such as "twolink.urdf"."""
    package = Path(__file__).parent
    installed = package / "models" / name
    return installed if installed.exists() else package.parent / "models" / name


def harness_path() -> Path:
    """Return the folder of the harness skeletons."""
    package = Path(__file__).parent
    installed = package / "models" / "harness"
    return installed if installed.exists() else package.parent / "examples" / "harness"
