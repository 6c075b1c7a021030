"""Draw docs/rooms.png, a picture of the package's architecture, made from its imports.

A room is a folder with all below its second level; modules outside all folders, which every room
may use, are not drawn.
An arrow means "imports from"; one that follows from others (a over b over c) is left out.
"""

import ast
from collections import defaultdict
from pathlib import Path

from matplotlib.figure import Figure

PICTURE = Path(__file__).with_name("rooms.png")
ROOT = Path(__file__).resolve().parents[1] / "pymoo_hdte"
WIDTH = 12.0
COLOURS = {
    "discrepancy": "#FBE3D1",
    "drive": "#D6E8F5",
    "mechanism": "#D6E8F5",
    "effects": "#D6E8F5",
}
OTHER = "#EEF0F2"


def imports() -> dict[str, set[str]]:
    """Return for every room the rooms that its modules import from."""
    found: dict[str, set[str]] = defaultdict(set)
    for path in ROOT.rglob("*.py"):
        here = _room(path)
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and str(node.module).startswith("pymoo_hdte"):
                for alias in node.names:
                    found[here].add(_room(_file(f"{node.module}.{alias.name}")))
    ground = {path.stem for path in ROOT.glob("*.py")} | {""}
    return {
        room: {other for other in others if other not in ground and other != room}
        for room, others in found.items()
        if room not in ground
    }


def _file(module: str) -> Path:
    """Return the file of a module, or of the module that defines a name."""
    parts = module.split(".")[1:]
    while parts:
        path = ROOT.joinpath(*parts)
        if path.with_suffix(".py").is_file():
            return path.with_suffix(".py")
        if path.is_dir():
            return path / "__init__.py"
        parts.pop()
    return ROOT / "__init__.py"


def _room(path: Path) -> str:
    folder = path.relative_to(ROOT).parent
    return ".".join(folder.parts[:2]) if folder.parts else path.stem


def rows(arrows: dict[str, set[str]]) -> list[list[str]]:
    """Return the rooms floor by floor, the uppermost first: each right below the lowest user."""
    users = {room: [one for one, others in arrows.items() if room in others] for room in arrows}
    found: dict[str, int] = {}

    def floor(room: str) -> int:
        if room not in found:
            found[room] = 1 + max((floor(one) for one in users[room]), default=-1)
        return found[room]

    levels = [
        [r for r in sorted(arrows) if floor(r) == n] for n in range(max(map(floor, arrows)) + 1)
    ]
    place: dict[str, float] = {}
    for level in levels:
        # Below the rooms that import from it, so that arrows cross little.
        level.sort(
            key=lambda room: sum(place[one] for one in users[room]) / max(len(users[room]), 1)
        )
        place |= {room: (at + 0.5) / len(level) for at, room in enumerate(level)}
    return levels


def direct(arrows: dict[str, set[str]]) -> list[tuple[str, str]]:
    """Return the arrows that do not follow from others."""
    reached: dict[str, set[str]] = {}

    def below(room: str) -> set[str]:
        if room not in reached:
            reached[room] = set().union(*({one} | below(one) for one in arrows.get(room, ())))
        return reached[room]

    return [
        (room, one)
        for room, others in arrows.items()
        for one in others
        if not any(one in below(other) for other in others - {one})
    ]


def draw(target: Path = PICTURE) -> None:
    """Draw the rooms floor by floor, each with the number of its modules."""
    arrows = imports()
    levels = rows(arrows)
    figure = Figure(figsize=(WIDTH, 0.95 * len(levels)), layout="constrained")
    axis = figure.subplots()
    place = {
        room: ((at + 0.5) * WIDTH / len(row), -level)
        for level, row in enumerate(levels)
        for at, room in enumerate(row)
    }
    for room, other in direct(arrows):
        axis.annotate(
            "",
            xy=(place[other][0], place[other][1] + 0.2),
            xytext=(place[room][0], place[room][1] - 0.2),
            arrowprops={"arrowstyle": "->", "color": "0.45", "shrinkA": 0, "shrinkB": 0},
        )
    for room, (x, y) in place.items():
        paths = [path for path in ROOT.rglob("*.py") if path.stem != "__init__"]
        modules = sum(_room(path) == room for path in paths)
        style = {"boxstyle": "round,pad=0.4", "edgecolor": "0.4"}
        colour = COLOURS.get(room.split(".")[0], OTHER)
        axis.text(
            x, y, f"{room}  ({modules})", ha="center", va="center", fontsize=10,
            bbox=style | {"facecolor": colour},
        )  # fmt: skip
    axis.set(xlim=(0.0, WIDTH), ylim=(0.4 - len(levels), 0.6))
    axis.set_axis_off()
    # A test compares the words, which say more than pixels.
    described = {
        "Software": None,
        "Description": "; ".join(sorted(f"{a}>{b}" for a, b in direct(arrows))),
    }
    figure.savefig(target, dpi=100, metadata=described)


if __name__ == "__main__":
    draw()
