"""Scenes: a chain, its start, the options of a run, and the effects that act."""

from twolink.scene.model import scene_model
from twolink.scene.names import scene_file, scene_names
from twolink.scene.scene import Scene
from twolink.scene.text import LARGEST_FILE

__all__ = ["LARGEST_FILE", "Scene", "scene_file", "scene_model", "scene_names"]
