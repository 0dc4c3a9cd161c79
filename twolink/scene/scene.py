"""A scene: what the chain is, where it starts, for how long, and which effects act.

A scene is read from a TOML file, and written to one. What the file does not name does not exist: an
effect that is left out is not imported, not evaluated, not compiled.
"""

from __future__ import annotations

from dataclasses import dataclass
from os import PathLike
from pathlib import Path

from twolink.arithmetic import Pair
from twolink.chain import Chain
from twolink.effects import EFFECTS, Effect
from twolink.errors import ParameterError, SceneError, TwolinkError
from twolink.finite import check_finite
from twolink.scene.model import checked, scene_model
from twolink.scene.reading import chain_of, effects_of
from twolink.scene.text import read_text, tables
from twolink.scene.writing import written


@dataclass(frozen=True)
class Scene:
    """A chain, its start, a duration (s), and the tuple of effects that act.

    `q` (rad) and `u` (rad/s) are the start. `accuracy` is the global error that is allowed in q
    (rad) and u (rad/s) over the whole run; `method` names an integration method. `shows` is one
    line on what the scene is for.
    """

    chain: Chain
    q: Pair
    u: Pair
    duration: float
    effects: tuple[Effect, ...] = ()
    accuracy: float = 1e-9
    method: str = "taylor"
    title: str = "untitled"
    shows: str = ""

    def __post_init__(self) -> None:
        """Refuse a start that is no place, and a run that has no end."""
        check_finite("start", q=self.q, u=self.u)
        for name in ("duration", "accuracy"):
            value = getattr(self, name)
            if isinstance(value, (int, float)) and not 0 < value < float("inf"):
                raise ParameterError(f"run: {name} is {value!r}; allowed is a positive number")

    @property
    def equipped(self) -> Chain:
        """The chain that moves: with the rotors that effects put on it."""
        chain = self.chain
        for effect in self.effects:
            if hasattr(effect, "equipped"):
                chain = effect.equipped(chain)
        return chain

    @classmethod
    def load(cls, path: str | PathLike[str]) -> Scene:
        """Return the scene in a TOML file.

        Raises `SceneError`, in one sentence with the file, the key, what was received and what is
        allowed.
        """
        file = Path(path)
        return cls.parse(read_text(file), source=str(file), folder=file.parent)

    @classmethod
    def parse(cls, text: str, *, source: str = "<string>", folder: Path = Path()) -> Scene:
        """Return the scene in a TOML text; `urdf = "…"` is looked for from `folder`."""
        table = tables(text, source)
        named = table.get("effects")
        known = [name for name in named if name in EFFECTS] if isinstance(named, dict) else []
        given = checked(scene_model(tuple(known)), table, source)
        try:
            chain, of_urdf = chain_of(given["chain"], folder)
            return cls(
                chain=chain,
                q=given["start"]["q"],
                u=given["start"]["u"],
                effects=(*effects_of(given["effects"]), *of_urdf),
                title=given["title"],
                shows=given["shows"],
                **given["run"],
            )
        except TwolinkError as error:
            raise SceneError(f"{source}: {error}") from error

    def to_toml(self) -> str:
        """Return a TOML text that `Scene.parse` reads back to an equal scene, to the last bit.

        What is as by default is left out. Raises `SceneError` for what no scene file can say:
        effects of one's own, rotors that no effect has put there, values that are not allowed.
        """
        text = written(self)
        in_a_file = text.encode("utf-8", errors="replace").decode("utf-8")
        if Scene.parse(in_a_file, source="the scene as TOML") != self:
            raise SceneError(
                "the scene as TOML reads back otherwise; allowed are numbers that float64 can hold "
                "and words that UTF-8 can"
            )
        return text
