"""The exceptions of this library.

Each message is one sentence: "<name> must be …; got …", with the location.
"""

from twolink.text import printable


class TwolinkError(Exception):
    """Base class of all exceptions of the library.

    A message may quote names of files and effects: characters that a terminal cannot show are
    escaped.
    """

    def __str__(self) -> str:
        """Return the message, in printable text."""
        return printable(super().__str__())


class ParameterError(TwolinkError):
    """A parameter of the chain, of a load or of a call is invalid."""


class FileError(TwolinkError):
    """A file cannot be read or written: the disk is full, or something else is in its place."""


class UrdfError(TwolinkError):
    """A URDF file is missing, malformed, or does not describe a planar two-link chain."""


class EngineError(TwolinkError):
    """A dynamics engine is missing, or rejects a model."""


class SceneError(TwolinkError):
    """A scene file is missing, malformed, or not supported."""


class SimulationError(TwolinkError):
    """A motion cannot be computed with the given scene and options."""


class IntegrationError(SimulationError):
    """An integration failed with valid input."""


class TooMuchError(SimulationError):
    """A run would take more time or memory than its limits allow."""


class PictureError(TwolinkError):
    """A motion cannot be drawn, shown or recorded with the given options."""


class BrowserError(TwolinkError):
    """A browser or an encoder failed with valid input."""
