"""Models of mechanisms as files of other tools, each with a list of what it leaves out."""

from pymoo_hdte.export.exported import Exported
from pymoo_hdte.export.modelica import to_modelica
from pymoo_hdte.export.mujoco import to_mujoco
from pymoo_hdte.export.python import to_python
from pymoo_hdte.export.urdf import to_urdf

__all__ = ["Exported", "to_modelica", "to_mujoco", "to_python", "to_urdf"]
