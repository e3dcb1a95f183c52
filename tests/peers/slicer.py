"""3D Slicer connects to hapticd-igtl and gets the tool's pose.

    Slicer --no-main-window --python-script slicer.py      needs the extension SlicerOpenIGTLink, a daemon, and hapticd-igtl
"""

import sys
import time

import slicer  # of Slicer's own Python

SECONDS = 10.0

connector = slicer.vtkMRMLIGTLConnectorNode()
slicer.mrmlScene.AddNode(connector)
connector.SetTypeClient("127.0.0.1", 18944)
connector.Start()
end = time.monotonic() + SECONDS
places = set()
while time.monotonic() < end:
    slicer.app.processEvents()
    connector.PeriodicProcess()
    node = slicer.mrmlScene.GetFirstNodeByName("ToolToRig")
    if node is not None:
        matrix = slicer.vtkMatrix4x4()
        node.GetMatrixTransformToParent(matrix)
        places.add(tuple(matrix.GetElement(i, 3) for i in range(3)))
    time.sleep(0.01)
connected = connector.GetState() == connector.StateConnected
print(f"Slicer: connected {connected}, {len(places)} places of the tool")
sys.exit(0 if connected and places else 1)
