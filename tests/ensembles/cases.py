"""Ensembles whose runs have known motions."""

from pathlib import Path

from twolink.ensembles.file import ensemble_of

GRID = {"first": -3.0, "last": 3.0, "count": 6}

# The mass centre of link 2 is at B, so that the links are uncoupled: I2 q2″ is the torque at B,
# and link 1 is a pendulum with the moment of inertia of its bar and of link 2's mass at B.
UNCOUPLED = {
    "chain": {
        "mass": [1.0, 1.0],
        "length": [1.0, 1.0],
        "centre": [[0.5, 0.0], [0.0, 0.0]],
        "inertia": [1.0 / 12, 0.5],
    },
    "start": {"q": [0.0, 0.0]},
    "run": {"duration": 4.0},
}


def ensemble(**tables):
    """Return the ensemble of the tables of a sweep file."""
    return ensemble_of({"scene": "free_fall", **tables}, "<dict>", Path())


def axis(parameter, *values, **kinds):
    return {"parameter": parameter, **({"values": list(values)} if values else {}), **kinds}


def starts(count=6, **tables):
    """Return an ensemble of free falls from a grid of poses."""
    grid = {"first": -3.0, "last": 3.0, "count": count}
    axes = [axis(f"start.q.{k}", grid=grid) for k in (0, 1)]
    tables.setdefault("keep", {"final": True, "first": [{"name": "flip"}]})
    tables.setdefault("runs", {"accuracy": 1e-6, "duration": 3.0})
    return ensemble(axes=axes, **tables)


def words_of(table):
    """Return the rows of a table as lines."""
    return [" ".join(cell.text for cell in row) for row in table.rows]


def torques(*values, keep, q2=0.0, u2=0.0, duration=4.0, refine=False):
    """Return an ensemble of uncoupled chains with torques at B: q2″ = 2 torque."""
    scene = {
        **UNCOUPLED,
        "start": {"q": [0.0, q2], "u": [0.0, u2]},
        "run": {"duration": duration},
        "effects": {"joint_torque": {"torque": [0.0, 0.0]}},
    }
    return ensemble(
        scene=scene,
        axes=[axis("effects.joint_torque.torque.1", *values)],
        runs={"refine": refine},
        keep=keep,
    )
