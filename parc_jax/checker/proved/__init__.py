"""The second checker, which is itself proved: theorems in Coq (theories), and the program that is
extracted from them, with its reader (program), natively or as JavaScript (js).

No Python runs here. docs/proved_checker.md says what is proved, and how it is built.
"""

from pathlib import Path

PROVED_JS = Path(__file__).with_name("proved.js")  # the program as node and browsers run it
