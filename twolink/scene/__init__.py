"""A scene: what the chain is, where it starts, for how long, and which effects act."""

from twolink.scene.model import METHODS, scene_model
from twolink.scene.scene import Scene
from twolink.scene.text import LARGEST_FILE

__all__ = ["LARGEST_FILE", "METHODS", "Scene", "scene_model"]
