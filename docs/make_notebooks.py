"""Runs the notebooks from top to bottom and keeps what they show: `python docs/make_notebooks.py`.

Each in a kernel of its own and an empty folder, as a stranger runs it; pictures in few colours.
"""

import base64
import io
import sys
import tempfile
from pathlib import Path

COLOURS = 48
BOOKS = sorted((Path(__file__).parent / "notebooks").glob("*.ipynb"))


def ran(path: Path, folder: Path):
    """The notebook with its outputs, run in a folder."""
    import nbclient
    import nbformat

    book = nbformat.read(path, as_version=4)
    resources = {"metadata": {"path": str(folder)}}
    nbclient.NotebookClient(book, kernel_name="python3", resources=resources).execute()
    for cell in book.cells:
        cell.metadata.pop("execution", None)  # when it was run
    book.metadata = {"kernelspec": book.metadata.kernelspec, "language_info": {"name": "python"}}
    return book


def smaller(book):
    """The notebook with its pictures in few colours."""
    from PIL import Image

    for cell in book.cells:
        for out in cell.get("outputs", []):
            if "image/png" in out.get("data", {}):
                picture = Image.open(io.BytesIO(base64.b64decode(out.data["image/png"])))
                kept = io.BytesIO()
                picture.convert("RGB").quantize(COLOURS).save(kept, "PNG", optimize=True)
                out.data["image/png"] = base64.b64encode(kept.getvalue()).decode()
    return book


def main(names: list[str]) -> None:
    """All of them, or those named."""
    import nbformat

    for path in BOOKS:
        if not names or path.stem in names:
            with tempfile.TemporaryDirectory() as folder:
                nbformat.write(smaller(ran(path, Path(folder))), path)


if __name__ == "__main__":
    main(sys.argv[1:])
