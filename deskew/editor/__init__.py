"""The stiffness editor: paint materials over a page, and see what each choice makes of it (section 4.3).

:mod:`.materials`, :mod:`.strokes` and :mod:`.draft` say what is painted and keep it; :mod:`.preview` solves and
:mod:`.pictures` colours; the :mod:`.desk` holds all of it, :mod:`.talk` speaks for it, and :mod:`.serving` serves the
notebook :mod:`.page`, whose one component is the :mod:`.widget`. Only these last two need marimo.
"""

from deskew.editor.desk import Desk, Files
from deskew.editor.serving import PORT, require_editor, serve

__all__ = ["PORT", "Desk", "Files", "require_editor", "serve"]
