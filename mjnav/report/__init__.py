"""Pictures and pages for people. Only this folder and `paper` import matplotlib.

`mjnav.report` is this folder and, in Python, the call that makes a page of logs: `mjnav.report("a.mcap", "a.html")`.
"""

import sys
from types import ModuleType
from typing import Any


class _CallableFolder(ModuleType):
    """Importing anything from here makes `mjnav.report` this module, whatever `mjnav` itself says that name is."""

    def __call__(self, *arguments: Any, **named: Any) -> Any:
        from mjnav.report.run_page.page import report

        return report(*arguments, **named)


sys.modules[__name__].__class__ = _CallableFolder
