"""Runs the checker, as a module of a package or as a folder copied anywhere."""

import importlib
import sys
from pathlib import Path

if __package__:
    name = __package__
else:  # python checker answer.json: the folder becomes a package of its own name
    folder = Path(__file__).resolve().parent
    sys.path[0] = str(folder.parent)
    name = folder.name

sys.exit(importlib.import_module(name).main())
