"""Pictures of the documentation: as their scripts draw them now, and as they are stored."""

from PIL import Image


def drawn_and_stored(script, folder):
    """Return the picture of a script in docs, drawn now into a folder and as it is stored."""
    scope = {"__file__": str(script), "__name__": "picture"}
    exec(compile(script.read_text(encoding="utf-8"), str(script), "exec"), scope)
    scope["draw"](folder / "drawn.png")
    return [Image.open(path) for path in (folder / "drawn.png", scope["PICTURE"])]
