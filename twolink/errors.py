"""The errors this library raises on purpose.

Each message is one sentence that says what was received, what is allowed, and where.
"""


class TwolinkError(Exception):
    """Base of every error that the library raises on purpose."""


class ParameterError(TwolinkError):
    """A parameter of the chain, of a load or of a call is outside what is allowed."""


class UrdfError(TwolinkError):
    """A URDF file is missing, malformed, or does not describe a planar two-link chain."""


class EngineError(TwolinkError):
    """A dynamics engine is missing, or refuses the model it was given."""


class SceneError(TwolinkError):
    """A scene file is missing or malformed, or asks for what cannot be simulated."""


class SimulationError(TwolinkError):
    """A motion cannot be computed as asked."""


class IntegrationError(SimulationError):
    """A run failed on its way: nothing that was asked for was wrong."""


class PictureError(TwolinkError):
    """A motion cannot be drawn, shown or recorded as asked."""


class BrowserError(TwolinkError):
    """A browser or an encoder failed on the way: nothing that was asked for was wrong."""
