"""`python -m tests.campaign --scenes 2000 --seed S`: random scenes against the laws of mechanics.

The exit code is 1 if a scene violates them, crashes or hangs, or if too many are refused.
"""

from __future__ import annotations

import argparse
import sys
import time
from contextlib import suppress
from pathlib import Path

from tests.campaign.comparisons import COMPARISONS
from tests.campaign.draw import DRAWS
from tests.campaign.judge import OK, OUT_OF_RANGE, Judged
from tests.campaign.report import is_good, report
from tests.campaign.run import Campaign, judged_scenes


def main() -> int:
    """Run a campaign as the command line says, and return the exit code."""
    given = _arguments()
    shares = {name: getattr(given, f"{name}_share") for name in COMPARISONS}
    limits = given.limit, shares, given.comparison_limit
    campaign = Campaign(given.seed, *limits, draw=given.draw)
    indices = given.only or list(range(given.first, given.first + given.scenes))
    started = time.monotonic()
    results: list[Judged] = []

    def progress(text: str) -> None:
        bad = sum(judged.outcome not in (OK, OUT_OF_RANGE) for judged in results)
        line = f"\r{text}, {bad} not ok, {time.monotonic() - started:.0f} s"
        print(line, end="", file=sys.stderr, flush=True)

    # Interrupted from the keyboard it reports on the finished scenes.
    with suppress(KeyboardInterrupt):
        for judged in judged_scenes(campaign, indices, given.workers, progress):
            results.append(judged)
            if given.keep is not None and judged.outcome not in (OK, OUT_OF_RANGE):
                _keep(given.keep, campaign, judged)
    print(file=sys.stderr)
    options = "".join(f" --{name}-share {own}" for name, own in shares.items() if own != 0.1)
    options += "" if given.draw == "any" else f" --draw {given.draw}"
    command = f"uv run python -m tests.campaign --seed {given.seed}{options}"
    print(report(results, command))
    return 0 if is_good(results) and len(results) == len(indices) else 1


def _arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m tests.campaign", description=__doc__)
    parser.add_argument("--scenes", type=int, default=2000, help="how many scenes")
    parser.add_argument("--seed", type=int, default=1, help="which scenes")
    parser.add_argument("--draw", choices=DRAWS, default="any", help="which kind of scenes")
    parser.add_argument("--first", type=int, default=0, help="index of the first scene")
    parser.add_argument("--only", type=int, action="append", help="only the scene of this index")
    parser.add_argument("--workers", type=int, default=2, help="processes at a time")
    parser.add_argument("--keep", type=Path, help="a folder for scenes that are not ok, as TOML")
    parser.add_argument("--limit", type=float, default=60.0, help="seconds for a scene")
    for name in COMPARISONS:
        parser.add_argument(f"--{name}-share", type=float, default=0.1, help="share compared")
    parser.add_argument("--comparison-limit", type=float, default=120.0, help="seconds for one")
    return parser.parse_args()


def _keep(folder: Path, campaign: Campaign, judged: Judged) -> None:
    """Write a scene to a folder, with its failures as comments."""
    if any(name == "draw" for name, _ in judged.wrong):
        return
    folder.mkdir(parents=True, exist_ok=True)
    failures = [f"{name}: {sentence}" for name, sentence in judged.wrong] or [judged.remark]
    comment = "".join(f"# {line}\n" for text in failures for line in text.splitlines())
    text = DRAWS[campaign.draw](campaign.seed, judged.index).to_toml()
    name = f"{judged.outcome.replace(' ', '_')}_{campaign.seed}_{judged.index}.toml"
    (folder / name).write_text(f"# {judged.outcome}\n{comment}{text}", encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
