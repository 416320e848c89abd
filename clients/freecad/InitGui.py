# SPDX-License-Identifier: MIT
"""FreeCAD runs this at the start of its window: the workbench, with one command."""
import FreeCADGui


class VitrailDock:
    """Shows the dock and sends the active document."""

    def GetResources(self):
        return {"MenuText": "Lit picture",
                "ToolTip": "Shows the document, lit by Vitrail, in a dock"}

    def IsActive(self):
        import FreeCAD
        return FreeCAD.ActiveDocument is not None

    def Activated(self):
        from vitrail_cad import dock
        dock.show().start()


class VitrailWorkbench(FreeCADGui.Workbench):
    MenuText = "Vitrail"
    ToolTip = "Pictures of the document with light through its glass"

    def Initialize(self):
        self.appendToolbar("Vitrail", ["Vitrail_Dock"])
        self.appendMenu("Vitrail", ["Vitrail_Dock"])

    def GetClassName(self):
        return "Gui::PythonWorkbench"


FreeCADGui.addCommand("Vitrail_Dock", VitrailDock())
FreeCADGui.addWorkbench(VitrailWorkbench())
