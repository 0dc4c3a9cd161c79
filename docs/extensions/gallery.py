"""The gallery of the shipped scenes: a strip of stills, and a page that plays the film."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from pathlib import Path

import twolink
from twolink.scene import Scene, scene_names
from twolink.simulation import simulate
from twolink.text import as_sentence

FILMS = Path("site", "films")
"""Pages that play films, in the folder whose content is copied into the site as it is."""

_HEAD = """# Gallery

Every scene that comes with twolink, simulated when this page was built. Each strip has the chain at
five times and the path of the free end D. Only the point that a surface names, D in most scenes,
touches it: links pass through. The films play offline in the browser.
`twolink simulate NAME` computes a motion, `twolink view NAME` shows it live.
"""


def gallery_page(folder: Path) -> str:
    """Return the page, and draw missing pictures into `folder`."""
    return _HEAD + "".join(_section(name, file, folder) for name, file in _by_origin())


def _by_origin() -> Iterator[tuple[str, Path]]:
    """Yield the scenes of the library, and then those that others have published."""
    every = scene_names()
    yield from sorted(every.items(), key=lambda item: "published" in item[1].parts)


def _section(name: str, file: Path, folder: Path) -> str:
    scene = Scene.load(file)
    stem = f"{name}-{_key(file)}"
    _draw(scene, folder, stem)
    effects = ", ".join(type(effect).__name__ for effect in scene.effects)
    alternative = f"The chain at five times, from {scene.title}"
    return f"""
## {scene.title}

{as_sentence(scene.shows)} {scene.duration:g} s with {effects}.

````{{container}} strip
```{{image}} {stem}-light.svg
:alt: {alternative}
:class: only-light scene
```
```{{image}} {stem}-dark.svg
:alt: {alternative}
:class: only-dark scene
```
````

<a href="../films/{stem}.html">Play the film</a> · {{download}}`scene file <{name}.toml>` · `{name}`
"""


def _key(file: Path) -> str:
    """Return a word that changes with the scene and with the code that simulates and draws it."""
    root = Path(twolink.__file__).parent
    digest = hashlib.sha256(file.read_bytes())
    for package in (root / "simulation", root / "viz"):
        for source in sorted(package.rglob("*.py")):
            digest.update(source.read_bytes())
    return digest.hexdigest()[:8]


def _draw(scene: Scene, folder: Path, stem: str) -> None:
    """Write the strip of a scene in both themes and the page that plays it, unless they exist."""
    from twolink.viz.display import page
    from twolink.viz.plots.strip import strip
    from twolink.viz.plots.style import save

    name = stem.rpartition("-")[0]
    films = folder / FILMS
    films.mkdir(parents=True, exist_ok=True)
    film = films / f"{stem}.html"
    if film.exists():
        return
    for old in (*folder.glob(f"{name}-????????-*.svg"), *films.glob(f"{name}-????????.html")):
        old.unlink()
    trajectory = simulate(scene)
    for theme in ("light", "dark"):
        save(strip(trajectory, theme), folder / f"{stem}-{theme}.svg")
    (folder / f"{name}.toml").write_text(scene_names()[name].read_text(encoding="utf-8"))
    film.write_text(page(trajectory), encoding="utf-8")
