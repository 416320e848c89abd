# SPDX-License-Identifier: MIT
"""FreeCAD runs this at its start; the workbench has nothing to do without a window."""
